"""Pictures of a check's findings, for `unitcad check --show`.

For each file with findings a folder that holds

- a picture a finding (SVG with two shaded views): the whole part with the place marked, and the place from near;
- findings.3mf: its meshes, faces that a finding concerns in the colour of the worst severity.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from unitcad import files
from unitcad.export import drawing, raster, threemf
from unitcad.export.marks import Marks, marks_of
from unitcad.meshcheck.findings import SEVERITIES, FileReport, Finding, Location
from unitcad.meshcheck.geometry.mesh import LARGEST, Mesh, weld_exact
from unitcad.meshcheck.rules.registry import rules
from unitcad.text import printable, xml_attribute, xml_text

COLOURS = {"error": (0.86, 0.10, 0.12), "warning": (0.98, 0.58, 0.05), "info": (0.15, 0.45, 0.90)}
PART = (0.74, 0.79, 0.85)
SECOND = (0.55, 0.12, 0.75)
"""The other face of a pair."""
SIZE = (560, 440)
"""The size of one view, px."""
_SHARPER = 2
_MARGIN = 14.0
_TITLE, _LINE = 118, 165  # characters
_DIRECTIONS = [
    (1.0, -1.4, 0.9), (-1.2, -1.3, 0.9), (1.2, 1.3, 0.9), (-1.2, 1.3, 0.9), (1.0, -1.4, -0.9), (-1.2, -1.3, -0.9),
    (1.2, 1.3, -0.9), (-1.2, 1.3, -0.9), (0.1, -1.0, 0.15), (1.0, 0.1, 0.15), (-0.1, 1.0, 0.15), (-1.0, -0.1, 0.15),
    (0.1, -0.15, 1.0), (0.1, -0.15, -1.0),
]  # fmt: skip
_MANY = 200_000  # faces, above which fewer directions are tried


@dataclass(frozen=True)
class Scene:
    """A mesh as it is drawn: welded vertices (n, 3) mm, faces (m, 3), its box's diagonal mm, its sharp sides (m, 3)."""

    vertices: np.ndarray
    faces: np.ndarray
    size: float
    sharp: np.ndarray


def write(folder: Path, report: FileReport) -> FileReport:
    """Write the pictures of a report into a folder of its own below `folder`; the report without its meshes.

    A file without findings, or without a mesh that can be drawn, has none. Raises OSError.
    """
    scenes = [_scene(mesh) for mesh in report.meshes]
    if report.findings and any(scenes):
        own = folder / folder_name(report.path)
        own.mkdir(parents=True, exist_ok=True)
        for finding in report.findings:
            if picture := draw(report, finding, scenes):
                files.write(own / f"{finding.code}.svg", picture.encode())
        files.write(own / "findings.3mf", coloured(report))
    return FileReport(report.path, report.findings, report.facts, report.seconds)


def folder_name(path: str) -> str:
    """Return a name for a file's pictures on any system: its path where that is a plain name, else that and a hash."""
    shown = os.path.relpath(path) if os.path.isabs(path) else os.path.normpath(path)
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", shown).strip("._-") or "file"
    if name == shown and len(name) <= 80 and not re.match(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\.|$)", name):
        return name
    return f"{name[-80:].strip('._-')}-{hashlib.sha256(os.fsencode(shown)).hexdigest()[:8]}"


def coloured(report: FileReport) -> bytes:
    """Return a 3MF of the report's meshes, faces coloured by the worst severity that concerns them."""
    parts = []
    for number, mesh in enumerate(report.meshes):
        if not len(mesh.faces) or not (np.abs(mesh.vertices) <= LARGEST).all():
            continue
        paint = np.zeros(len(mesh.faces), int)
        for finding in report.findings:
            for place in finding.locations:
                if place.mesh == number and place.region is not None:
                    which = np.asarray(place.region, int)
                    paint[which] = np.maximum(paint[which], 1 + SEVERITIES.index(finding.severity))
        a, b, c = mesh.faces.T
        sound = (a != b) & (b != c) & (c != a)  # 3MF has no triangle with a vertex twice
        palette = (PART, *(COLOURS[severity] for severity in SEVERITIES))
        name = " ".join(filter(None, (Path(report.path).name, mesh.name)))
        parts.append(threemf.MeshPart(printable(name), PART, mesh.vertices, mesh.faces[sound], palette, paint[sound]))
    return threemf.content(parts)


def draw(report: FileReport, finding: Finding, scenes: Sequence[Scene | None]) -> str | None:
    """Draw a finding as SVG; None where nothing of it can be drawn."""
    places = [place for place in finding.locations if place.mesh is not None and scenes[place.mesh]]
    number = places[0].mesh if places else next(i for i, scene in enumerate(scenes) if scene)
    assert number is not None
    scene = scenes[number]
    assert scene is not None
    here = [place for place in places if place.mesh == number]
    colour = COLOURS[finding.severity]
    title = f"{Path(report.path).name}: {finding.code} {rules()[finding.code].title} ({finding.severity})"
    if not here:
        return _page(title, finding, [_View(scene, Marks(), _DIRECTIONS[0], None, colour)], None)
    marks = marks_of(finding.code, report.meshes[number], here)
    middle, reach = _near(scene, marks)
    towards, cut = _direction(scene, marks, middle, reach)
    views = [
        _View(scene, marks, towards, None, colour, (middle, reach)),
        _View(scene, marks, towards, (middle, reach), colour, None, cut),
    ]
    return _page(title, finding, views, here[0])


def _scene(mesh: Mesh) -> Scene | None:
    if not len(mesh.faces) or not (np.abs(mesh.vertices) <= LARGEST).all():
        return None
    vertices, faces = weld_exact(mesh.vertices[mesh.faces])
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    return Scene(vertices, faces, size, _sharp(vertices, faces)) if size > 0 else None


def _sharp(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Mark sides (m, 3) that do not have one neighbour, or have one at more than 25 degrees."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, side, count = np.unique(
        ends[:, 0].astype(np.int64) * len(vertices) + ends[:, 1], return_inverse=True, return_counts=True
    )
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    total = np.zeros((len(count), 3))
    np.add.at(total, side, np.repeat(normal, 3, axis=0))
    bent = (count != 2) | (np.einsum("ij,ij->i", total, total) < 2 + 2 * np.cos(np.radians(25)))
    return bent[side].reshape(-1, 3)


def _near(scene: Scene, marks: Marks) -> tuple[np.ndarray, float]:
    """Return middle and reach (mm) of the near view: the first place, and those close to it."""
    low, high = marks.boxes[0]
    for other_low, other_high in marks.boxes[1:]:
        both = np.minimum(low, other_low), np.maximum(high, other_high)
        gap = np.linalg.norm(np.maximum(np.maximum(other_low - high, low - other_high), 0))
        if gap <= 0.02 * scene.size and np.linalg.norm(both[1] - both[0]) <= 0.3 * scene.size:
            low, high = both
    across = float(np.linalg.norm(high - low))
    reach = float(np.clip(0.9 * across, 0.08 * scene.size, 0.3 * scene.size))
    return (low + high) / 2 if across <= 0.5 * scene.size else marks.point, reach


def _direction(
    scene: Scene, marks: Marks, middle: np.ndarray, reach: float
) -> tuple[tuple[float, float, float], float]:
    """Return from where the place is seen best, and how near to the eye the part is cut so that it is seen at all."""
    best, most = _DIRECTIONS[0], 0.0
    samples = marks.samples()
    for i, towards in enumerate(_DIRECTIONS[:4] if len(scene.faces) > _MANY else _DIRECTIONS):
        view = raster.camera(towards, middle, reach, (SIZE[0] // 4, SIZE[1] // 4))
        seen = raster.look(scene.vertices, scene.faces, view)
        if marks.at_point:
            score = _shown(samples, seen, view, 0.2 * reach if len(marks.points) else 0.0)
        else:
            score = float(np.isin(seen.face, marks.faces[0]).mean()) * marks.askew(view.eye)
        if score > most * (1.0 if i == 0 else 1.3):
            best, most = towards, score
    if most > 0.004:
        return best, np.inf
    view = raster.camera(best, middle, reach, SIZE)
    depth = view.project(samples)[:, 2]
    return best, float(np.median(depth))


def _shown(points: np.ndarray, seen: raster.Seen, view: raster.Camera, deep: float = 0.0) -> float:
    """Return the share of the points that no face hides by more than `deep` mm."""
    at = view.project(points)
    column, row = at[:, 0].astype(int), at[:, 1].astype(int)
    height, width = seen.depth.shape
    there = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    if not there.any():
        return 0.0
    return float((seen.depth[row[there], column[there]] <= at[there, 2] + deep + 1.5 / view.scale).mean())


class _View:
    """One of the two views: its pixels, and the marks drawn over them."""

    def __init__(
        self,
        scene: Scene,
        marks: Marks,
        towards: tuple[float, float, float],
        near: tuple[np.ndarray, float] | None,
        colour: tuple[float, float, float],
        frame: tuple[np.ndarray, float] | None = None,
        cut: float = np.inf,
    ) -> None:
        self.marks, self.frame, self.near, self.cut = marks, frame, near, cut
        low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
        middle, reach = near or ((low + high) / 2, scene.vertices)
        self.view = raster.camera(towards, middle, reach, SIZE)
        sharp = raster.camera(towards, middle, reach, (SIZE[0] * _SHARPER, SIZE[1] * _SHARPER))
        colours = np.tile(PART, (len(scene.faces), 1))
        unmarked = np.ones(len(scene.faces), bool)
        for faces, tint in ((marks.others, _pale(colour)), (marks.faces[1], SECOND), (marks.faces[0], colour)):
            colours[faces], unmarked[faces] = tint, False
        lines = np.where(scene.sharp, 1.6, 0.0)
        if near is not None:
            lines = np.where(scene.sharp, 2.2, 1.1)
        seen = raster.look(scene.vertices, scene.faces, sharp, cut, ~unmarked)
        picture = raster.shade(
            scene.vertices, scene.faces, colours, unmarked, seen, sharp, lines, bool(np.isfinite(cut))
        )
        if near is None:  # what is marked shows through what lies before it
            which = np.unique(np.concatenate([*marks.faces, marks.others]))
            behind = raster.look(scene.vertices, scene.faces[which], sharp)
            hidden = (behind.face >= 0) & (behind.depth < seen.depth - 1.0 / sharp.scale)
            picture[hidden] += 0.45 * (np.array(colour) - picture[hidden])
        self.pixels = raster.shrunk(picture, _SHARPER)
        self.seen = raster.Seen(seen.face[::_SHARPER, ::_SHARPER], seen.depth[::_SHARPER, ::_SHARPER])
        self.sides = np.ptp(scene.vertices, axis=0)
        self.colour = threemf.colour_hex(colour)

    def svg(self, left: float, top: float) -> list[str]:
        """Draw the view with its marks, its upper left corner at (`left`, `top`)."""
        width, height = SIZE
        data = base64.b64encode(raster.png(self.pixels)).decode()
        over = [*self._segments(), *self._points(), *self._where(), *self._scale(), *self._axes()]
        return [
            f'<svg x="{drawing.number(left)}" y="{drawing.number(top)}" width="{width}" height="{height}">',
            f'<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/>',
            *over,
            f'<rect class="frame" x=".5" y=".5" width="{width - 1}" height="{height - 1}"/>',
            "</svg>",
        ]

    def _segments(self) -> list[str]:
        if not len(self.marks.segments):
            return []
        clear = np.array([_shown(line.mean(axis=0)[None], self.seen, self.view) > 0 for line in self.marks.segments])
        drawn = []
        for lines, kind in ((self.marks.segments[~clear], "mark hidden"), (self.marks.segments[clear], "mark")):
            ends = self.view.project(lines.reshape(-1, 3))[:, :2].reshape(-1, 2, 2)
            path = "".join(
                f"M{drawing.number(x0)} {drawing.number(y0)}L{drawing.number(x1)} {drawing.number(y1)}"
                for (x0, y0), (x1, y1) in ends.tolist()
            )
            if path:
                drawn.append(f'<path class="halo" d="{path}"/>')
                drawn.append(f'<path class="{kind}" stroke={xml_attribute(self.colour)} d="{path}"/>')
        return drawn

    def _points(self) -> list[str]:
        if not len(self.marks.points):
            return []
        at = self.view.project(self.marks.points)[:, :2]
        form = f'<circle class="point" r="5" fill={xml_attribute(self.colour)} cx="%s" cy="%s"/>'
        return [form % (drawing.number(x), drawing.number(y)) for x, y in at.tolist()]

    def _where(self) -> list[str]:
        """Draw, in the whole view, a circle round what the near view shows."""
        if self.frame is None:
            return []
        middle, reach = self.frame
        x, y, _ = self.view.project(middle)[0].tolist()
        radius = max(reach * self.view.scale, 16.0)
        ring = f'cx="{drawing.number(x)}" cy="{drawing.number(y)}" r="{drawing.number(radius)}"'
        return [f'<circle class="ring halo" {ring}/>', f'<circle class="ring" {ring}/>']

    def _scale(self) -> list[str]:
        """Draw a bar of a round length."""
        room = 0.25 * SIZE[0] / self.view.scale
        length = 10.0 ** np.floor(np.log10(room))
        length = float(next(length * step for step in (5.0, 2.0, 1.0) if length * step <= room))
        end, y = SIZE[0] - 16.0, SIZE[1] - 16.0
        start = end - length * self.view.scale
        bar = f"M{drawing.number(start)} {y - 4}v8M{drawing.number(start)} {y}H{end}M{end} {y - 4}v8"
        label = drawing.text(f"{length:g} mm", ((start + end) / 2, y - 14))
        return ['<g class="scale">', f'<path class="halo" d="{bar}"/>', f'<path class="bar" d="{bar}"/>', label, "</g>"]

    def _axes(self) -> list[str]:
        """Draw the three axes, which show a view from below."""
        drawn = ['<g class="scale">']
        start = (40.0, SIZE[1] - 40.0)
        for name, axis in zip("xyz", np.eye(3), strict=True):
            x, y = start[0] + 24 * float(axis @ self.view.right), start[1] - 24 * float(axis @ self.view.up)
            drawn.append(f'<path class="bar" d="M{start[0]} {start[1]}L{drawing.number(x)} {drawing.number(y)}"/>')
            drawn.append(drawing.text(name, (x + (x - start[0]) * 0.35, y + (y - start[1]) * 0.35)))
        return [*drawn, "</g>"]


def _pale(colour: tuple[float, float, float]) -> tuple[float, float, float]:
    red, green, blue = (0.5 * channel + 0.5 * base for channel, base in zip(colour, PART, strict=True))
    return red, green, blue


_STYLE = (
    f"text{{font:{drawing.number(drawing.TEXT_PX)}px Helvetica,Arial,sans-serif;fill:#111}}"
    ".title{font-weight:bold;font-size:15px}path,.ring,.frame{fill:none}.frame{stroke:#888}"
    ".scale text{paint-order:stroke;stroke:#fff;stroke-width:4px;stroke-opacity:.85}.hidden{stroke-dasharray:2 6}"
    ".mark{stroke-width:3;stroke-linecap:round}.halo{stroke:#fff;stroke-width:6;stroke-linecap:round;stroke-opacity:.85}"
    ".ring{stroke:#111;stroke-width:2}.ring.halo{stroke:#fff;stroke-width:5}"
    ".bar{stroke:#111;stroke-width:1.5}circle.point{stroke:#fff;stroke-width:1.5}"
)


def _page(title: str, finding: Finding, views: Sequence[_View], place: Location | None) -> str:
    """Draw title and message, the views side by side, and below them what each shows."""
    lines = [*_wrapped(finding.message), *_wrapped(f"Fix: {rules()[finding.code].fix}")]
    top = 2 * _MARGIN + 20 + 17 * len(lines)
    width = _MARGIN + len(views) * (SIZE[0] + _MARGIN)
    height = top + SIZE[1] + 46
    marks = [f'<text class="title" x="{_MARGIN}" y="{_MARGIN + 12}">{xml_text(_fitting(printable(title)))}</text>']
    for i, line in enumerate(lines):
        marks.append(drawing.text(line, (_MARGIN, _MARGIN + 32 + 17 * i), "start"))
    for i, view in enumerate(views):
        left = _MARGIN + i * (SIZE[0] + _MARGIN)
        marks += view.svg(left, top)
        marks.append(drawing.text(_caption(view, finding, place), (left, top + SIZE[1] + 16), "start"))
    size = f'width="{drawing.number(width)}" height="{drawing.number(height)}"'
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" {size} '
        f'viewBox="0 0 {drawing.number(width)} {drawing.number(height)}">'
        f"<title>{xml_text(printable(title))}</title><style>{_STYLE}</style>"
        f'<rect {size} fill="#fff"/>'
    )
    return "\n".join([head, *marks, "</svg>", ""])


def _caption(view: _View, finding: Finding, place: Location | None) -> str:
    if place is None:
        return f"the whole part, {' x '.join(f'{side:.6g}' for side in view.sides)} mm"
    if view.near is None:
        many = f"; {len(finding.locations)} of {finding.count} places are marked" if finding.count > 1 else ""
        return f"the whole part{many}; the ring is the view on the right"
    cut = ", cut open in front of it" if np.isfinite(view.cut) else ""
    return printable(f"near{cut}: {place}")[:100]


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(printable(text), _LINE, break_on_hyphens=False)


def _fitting(text: str) -> str:
    return text if len(text) <= _TITLE else text[: _TITLE - 1] + "…"
