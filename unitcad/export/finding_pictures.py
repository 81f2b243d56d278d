"""Pictures of a check's findings, for `unitcad check --pictures`.

For each file with findings a folder with

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
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image

from unitcad import files
from unitcad.export import printing, raster
from unitcad.export.chart import coord, round_step, text
from unitcad.export.raster import Colour, Surface
from unitcad.meshcheck.findings import SEVERITIES, FileReport, Finding, Location
from unitcad.meshcheck.geometry.mesh import LARGEST, Mesh, weld_exact
from unitcad.meshcheck.rules.registry import rules
from unitcad.text import printable, xml_attribute, xml_text

COLOURS = {"error": (0.86, 0.10, 0.12), "warning": (0.98, 0.58, 0.05), "info": (0.15, 0.45, 0.90)}
PART = (0.74, 0.79, 0.85)
INSIDE = (0.62, 0.50, 0.40)
"""The colour of faces seen from behind: the inside of a part, through a hole."""
CUT = (0.93, 0.87, 0.76)
SECOND = (0.55, 0.12, 0.75)
"""The other face of a pair."""
SIZE = (560, 440)
"""The size of one view, px."""
_MARGIN = 14.0
_TITLE, _LINE = 118, 165  # characters
_DIRECTIONS = [
    (1.0, -1.4, 0.9), (-1.2, -1.3, 0.9), (1.2, 1.3, 0.9), (-1.2, 1.3, 0.9), (1.0, -1.4, -0.9), (-1.2, -1.3, -0.9),
    (1.2, 1.3, -0.9), (-1.2, 1.3, -0.9), (0.1, -1.0, 0.15), (1.0, 0.1, 0.15), (-0.1, 1.0, 0.15), (-1.0, -0.1, 0.15),
    (0.1, -0.15, 1.0), (0.1, -0.15, -1.0),
]  # fmt: skip
_MANY = 200_000  # faces, above which fewer directions are tried


_EDGES = {"T001", "T002", "T003", "T005", "T006", "T007", "G008", "G009"}
_POINTS = {"T004", "G003"}
_LINES = {"T010", "T011"}  # faces without area
_MOST = 3000  # places of a finding that are drawn
_NONE = np.empty(0, np.int64)


@dataclass(frozen=True)
class Scene:
    """A mesh as it is drawn: welded vertices (n, 3) mm, faces (m, 3), the diagonal of its box in mm."""

    vertices: np.ndarray
    faces: np.ndarray
    size: float


@dataclass(frozen=True)
class Marks:
    """The marks of a finding on one mesh.

    `faces`: those of the first place, the first and the second one of a pair apart; `others`: those of other places.
    `segments` (n, 2, 3) and `points` (n, 3) are drawn over everything; `boxes`: low and high corner of each place, the
    first one first; `point` its middle. `at_point`: that point, not the faces, must be visible.
    `across`: the unit vector through a thin wall.
    """

    faces: tuple[np.ndarray, np.ndarray] = (_NONE, _NONE)
    others: np.ndarray = field(default_factory=lambda: _NONE)
    segments: np.ndarray = field(default_factory=lambda: np.empty((0, 2, 3)))
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    boxes: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    point: np.ndarray = field(default_factory=lambda: np.zeros(3))
    at_point: bool = False
    across: np.ndarray | None = None

    def askew(self, eye: np.ndarray) -> float:
        """Return how well a thin wall's thickness shows from a direction, 0 to 1; 1 for other findings."""
        return 1.0 if self.across is None else 1.0 - float(self.across @ eye) ** 4

    def samples(self) -> np.ndarray:
        """Return points (n, 3) of the first place that ought to be seen."""
        if len(self.segments):
            return self.segments[0].mean(axis=0)[None]
        return self.point[None]


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
        files.write(own / "findings.3mf", colour_3mf(report))
    return FileReport(report.path, report.findings, report.facts, report.seconds)


def folder_name(path: str) -> str:
    """Return a name for a file's pictures that every system accepts: its path, with a hash if it is no plain name."""
    shown = os.path.relpath(path) if os.path.isabs(path) else os.path.normpath(path)
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", shown).strip("._-") or "file"
    if name == shown and len(name) <= 80 and not re.match(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\.|$)", name):
        return name
    return f"{name[-80:].strip('._-')}-{hashlib.sha256(os.fsencode(shown)).hexdigest()[:8]}"


def colour_3mf(report: FileReport) -> bytes:
    """Return a 3MF of the report's meshes, faces coloured by the worst severity that concerns them."""
    parts = []
    for index, mesh in enumerate(report.meshes):
        if not len(mesh.faces) or not (np.abs(mesh.vertices) <= LARGEST).all():
            continue
        paint = np.zeros(len(mesh.faces), int)
        for finding in report.findings:
            for place in finding.locations:
                if place.mesh == index and place.region is not None:
                    which = np.asarray(place.region, int)
                    paint[which] = np.maximum(paint[which], 1 + SEVERITIES.index(finding.severity))
        a, b, c = mesh.faces.T
        sound = (a != b) & (b != c) & (c != a)  # 3MF has no triangle with a vertex twice
        palette = (PART, *(COLOURS[severity] for severity in SEVERITIES))
        name = " ".join(filter(None, (Path(report.path).name, mesh.name)))
        parts.append(printing.MeshPart(printable(name), PART, mesh.vertices, mesh.faces[sound], palette, paint[sound]))
    return printing.content(parts)


def draw(report: FileReport, finding: Finding, scenes: Sequence[Scene | None]) -> str | None:
    """Draw a finding as SVG; None if nothing of it can be drawn."""
    places = [place for place in finding.locations if place.mesh is not None and scenes[place.mesh]]
    coord = places[0].mesh if places else next(i for i, scene in enumerate(scenes) if scene)
    assert coord is not None
    scene = scenes[coord]
    assert scene is not None
    here = [place for place in places if place.mesh == coord]
    colour = COLOURS[finding.severity]
    title = f"{Path(report.path).name}: {finding.code} {rules()[finding.code].title} ({finding.severity})"
    if not here:
        return _page(title, finding, [_View(scene, Marks(), _DIRECTIONS[0], None, colour)], None)
    marks = marks_of(finding.code, report.meshes[coord], here)
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
    return Scene(vertices, faces, size) if size > 0 else None


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


def _direction(scene: Scene, marks: Marks, middle: np.ndarray, reach: float) -> tuple[Colour, float]:
    """Return the best direction of view, and how near to the eye the part is cut to show the place."""
    best, most = _DIRECTIONS[0], 0.0
    samples = marks.samples()
    for i, towards in enumerate(_DIRECTIONS[:4] if len(scene.faces) > _MANY else _DIRECTIONS):
        view = raster.aim(towards, middle[None], (SIZE[0] // 4, SIZE[1] // 4), reach)
        if marks.at_point:
            depth = raster.look(scene.vertices, scene.faces, view)[1]
            score = float(_clear(samples, depth, view, 0.2 * reach if len(marks.points) else 0.0).mean())
        else:
            face = raster.look(scene.vertices, scene.faces, view)[0]
            score = float(np.isin(face, marks.faces[0]).mean()) * marks.askew(view.eye)
        if score > most * (1.0 if i == 0 else 1.3):
            best, most = towards, score
    if most > 0.004:
        return best, np.inf
    depth = raster.aim(best, middle[None], SIZE, reach).project(samples)[:, 2]
    return best, float(np.median(depth))


def _clear(points: np.ndarray, depth: np.ndarray, view: raster.Camera, deep: float = 0.0) -> np.ndarray:
    """Tell which points are in the picture, and no face hides them by more than `deep` mm."""
    at = view.project(points)
    column, row = at[:, 0].astype(int), at[:, 1].astype(int)
    height, width = depth.shape
    there = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    seen = depth[np.where(there, row, 0), np.where(there, column, 0)]
    return there & (seen <= at[:, 2] + deep + 1.5 / view.scale)


class _View:
    """One of the two views: its pixels, and the marks drawn over them."""

    def __init__(
        self,
        scene: Scene,
        marks: Marks,
        towards: Colour,
        near: tuple[np.ndarray, float] | None,
        colour: Colour,
        frame: tuple[np.ndarray, float] | None = None,
        cut: float = np.inf,
    ) -> None:
        self.marks, self.frame, self.near, self.cut = marks, frame, near, cut
        points, reach = (near[0][None], near[1]) if near else (scene.vertices, 0.0)
        self.view = raster.aim(towards, points, SIZE, reach)
        # Marked faces come last: they hide other faces in their place.
        kind = np.zeros(len(scene.faces), int)
        for which, faces in enumerate((marks.others, marks.faces[1], marks.faces[0]), 1):
            kind[faces] = which
        order = np.argsort(kind, kind="stable")
        palette = np.array([PART, np.add(colour, PART) / 2, SECOND, colour])
        behind = palette * 0.9
        behind[0] = CUT if np.isfinite(cut) else INSIDE
        surface = Surface(scene.vertices, scene.faces[order], palette[kind[order]], inside=behind[kind[order]])
        pixels, depth, _ = raster.compose([raster.render(surface, self.view, cut)], self.view, wires=near is not None)
        if near is None:  # marks show through the faces before them
            hidden = Surface(scene.vertices, scene.faces[kind > 0], colour, inside=colour)
            one = raster.render(hidden, self.view)
            under = (one.face >= 0) & (one.depth < depth[one.window] - 0.5 / self.view.scale)
            seen = pixels[one.window]
            seen[under, :3] = 0.55 * seen[under, :3] + 0.45 * 255 * np.array(colour)
        self.pixels = Image.fromarray(pixels).convert("RGB").reduce(raster.SHARPER)
        self.depth = depth[:: raster.SHARPER, :: raster.SHARPER]
        self.sides = np.ptp(scene.vertices, axis=0)
        self.colour = xml_attribute(printing.colour_hex(colour))

    def svg(self, left: float, top: float) -> list[str]:
        """Draw the view with its marks, its upper left corner at (`left`, `top`)."""
        width, height = SIZE
        data = base64.b64encode(raster.encode_png(self.pixels)).decode()
        return [
            f'<svg x="{coord(left)}" y="{coord(top)}" width="{width}" height="{height}">',
            f'<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/>',
            *self._segments(),
            *self._points(),
            *self._where(),
            *self._scale(),
            *self._axes(),
            f'<rect class="frame" x=".5" y=".5" width="{width - 1}" height="{height - 1}"/>',
            "</svg>",
        ]

    def _segments(self) -> list[str]:
        clear = _clear(self.marks.segments.mean(axis=1), self.depth, self.view)
        drawn = []
        for lines, kind in ((self.marks.segments[~clear], "mark hidden"), (self.marks.segments[clear], "mark")):
            ends = self.view.project(lines)[:, :2].reshape(-1, 4).tolist()
            path = "".join(f"M{coord(x0)} {coord(y0)}L{coord(x1)} {coord(y1)}" for x0, y0, x1, y1 in ends)
            if path:
                drawn.append(f'<path class="halo" d="{path}"/>')
                drawn.append(f'<path class="{kind}" stroke={self.colour} d="{path}"/>')
        return drawn

    def _points(self) -> list[str]:
        at = self.view.project(self.marks.points)[:, :2].tolist()
        return [f'<circle class="point" r="5" fill={self.colour} cx="{coord(x)}" cy="{coord(y)}"/>' for x, y in at]

    def _where(self) -> list[str]:
        """Draw, in the whole view, a circle round the part in the near view."""
        if self.frame is None:
            return []
        middle, reach = self.frame
        x, y, _ = self.view.project(middle)[0].tolist()
        ring = f'cx="{coord(x)}" cy="{coord(y)}" r="{coord(max(reach * self.view.scale, 16.0))}"'
        return [f'<circle class="ring halo" {ring}/>', f'<circle class="ring" {ring}/>']

    def _scale(self) -> list[str]:
        """Draw a bar of a round length."""
        length = round_step(0.1 * SIZE[0] / self.view.scale, 1)
        end, y = SIZE[0] - 16.0, SIZE[1] - 16.0
        start = coord(end - length * self.view.scale)
        bar = f"M{start} {y - 4}v8M{start} {y}H{end}M{end} {y - 4}v8"
        label = text(end - length * self.view.scale / 2, y - 10, f"{length:g} mm", "middle")
        return ['<g class="scale">', f'<path class="halo" d="{bar}"/>', f'<path class="bar" d="{bar}"/>', label, "</g>"]

    def _axes(self) -> list[str]:
        """Draw the three axes, which show a view from below."""
        drawn = ['<g class="scale">']
        left, top = 40.0, SIZE[1] - 40.0
        for name, right, up in zip("xyz", self.view.right.tolist(), self.view.up.tolist(), strict=True):
            drawn.append(f'<path class="bar" d="M{left} {top}l{coord(24 * right)} {coord(-24 * up)}"/>')
            drawn.append(text(left + 32 * right, top - 32 * up + 4, name, "middle"))
        return [*drawn, "</g>"]


_STYLE = (
    "text{font-family:Helvetica,Arial,sans-serif;fill:#111}.title{font-weight:bold;font-size:15px}path,.ring,.frame{fill:none}.frame{stroke:#888}"
    ".scale text{paint-order:stroke;stroke:#fff;stroke-width:4px;stroke-opacity:.85}.hidden{stroke-dasharray:2 6}"
    ".mark{stroke-width:3;stroke-linecap:round}.halo{stroke:#fff;stroke-width:6;stroke-linecap:round;stroke-opacity:.85}"
    ".ring{stroke:#111;stroke-width:2}.ring.halo{stroke:#fff;stroke-width:5}"
    ".bar{stroke:#111;stroke-width:1.5}circle.point{stroke:#fff;stroke-width:1.5}"
)


def _page(title: str, finding: Finding, views: Sequence[_View], place: Location | None) -> str:
    """Draw title and message, the views side by side, and below them their captions."""
    lines = [*_wrap(finding.message), *_wrap(f"Fix: {rules()[finding.code].fix}")]
    top = 2 * _MARGIN + 20 + 17 * len(lines)
    width = _MARGIN + len(views) * (SIZE[0] + _MARGIN)
    height = top + SIZE[1] + 46
    title = printable(title)
    shown = title if len(title) <= _TITLE else title[: _TITLE - 1] + "…"
    marks = [f'<text class="title" x="{_MARGIN}" y="{_MARGIN + 12}">{xml_text(shown)}</text>']
    marks += [text(_MARGIN, _MARGIN + 36 + 17 * i, line) for i, line in enumerate(lines)]
    for i, view in enumerate(views):
        left = _MARGIN + i * (SIZE[0] + _MARGIN)
        marks += [*view.svg(left, top), text(left, top + SIZE[1] + 20, _caption(view, finding, place))]
    size = f'width="{coord(width)}" height="{coord(height)}"'
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" {size} '
        f'viewBox="0 0 {coord(width)} {coord(height)}">'
        f"<title>{xml_text(title)}</title><style>{_STYLE}</style>"
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


def _wrap(content: str) -> list[str]:
    return textwrap.wrap(printable(content), _LINE, break_on_hyphens=False)


def marks_of(code: str, mesh: Mesh, places: Sequence[Location]) -> Marks:
    """Return the marks of a finding's places on the mesh to which they belong."""
    places = places[:_MOST]
    segments, points, boxes = [], [], []
    regions = [np.asarray(place.region if place.region is not None else _NONE, np.int64) for place in places]
    for place, region in zip(places, regions, strict=True):
        corners = mesh.vertices[mesh.faces[region]]
        centre = np.array(place.xyz if place.xyz is not None else corners.reshape(-1, 3).mean(axis=0))
        lines = _lines(code, corners, centre)
        segments += lines
        if code in _POINTS or (not len(region) and not lines):
            points.append(centre)
        spread = np.concatenate(lines) if lines else corners.reshape(-1, 3)
        if not len(spread) or code in _POINTS:
            spread = centre[None]
        boxes.append((spread.min(axis=0), spread.max(axis=0)))
    first = regions[0]
    pair = len(places[0].faces) == 2 and len(first) == 2
    fill = code not in _EDGES
    return Marks(
        ((first[:1] if pair else first) if fill else _NONE, first[1:] if pair and fill else _NONE),
        np.unique(np.concatenate([_NONE, *regions[1:]])) if fill else _NONE,
        np.array(segments).reshape(-1, 2, 3),
        np.array(points).reshape(-1, 3),
        tuple(boxes),
        np.array(places[0].xyz) if places[0].xyz is not None else (boxes[0][0] + boxes[0][1]) / 2,
        pair or not fill or bool(points) or code in _LINES,
        _across(mesh, first) if code == "D001" and len(first) else None,
    )


def _across(mesh: Mesh, region: np.ndarray) -> np.ndarray:
    """Return the normal of a region's largest face."""
    corners = mesh.vertices[mesh.faces[region]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    return normals[int(lengths.argmax())] / max(float(lengths.max()), 1e-300)


def _lines(code: str, corners: np.ndarray, centre: np.ndarray) -> list[np.ndarray]:
    """Return the lines (2, 3) that a place is drawn by.

    The side of a face that has its middle there, the line of two faces that cross, the sides of a face that has no
    area.
    """
    if code in _EDGES and len(corners):
        sides = np.stack([corners[0], np.roll(corners[0], -1, axis=0)], axis=1)
        distance = np.linalg.norm(sides.mean(axis=1) - centre, axis=1)
        return [sides[int(distance.argmin())]]
    if code == "G001" and len(corners) == 2:
        line = common_line(corners[0], corners[1])
        return [] if line is None else [line]
    if code in _LINES and len(corners):
        return list(np.stack([corners[0], np.roll(corners[0], -1, axis=0)], axis=1))
    return []


def common_line(a: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """Return the line (2, 3) on which two triangles (3, 3) cross, to rounding; None if in one plane or apart."""
    along = np.cross(np.cross(a[1] - a[0], a[2] - a[0]), np.cross(b[1] - b[0], b[2] - b[0]))
    if not along.any():
        return None
    spans = []
    for one, other in ((a, b), (b, a)):
        height = (one - other[0]) @ np.cross(other[1] - other[0], other[2] - other[0])
        ends = [one[k] for k in range(3) if height[k] == 0]
        for k in range(3):
            low, high = height[k - 1], height[k]
            if low * high < 0:
                ends.append(one[k - 1] + (one[k] - one[k - 1]) * (low / (low - high)))
        if len(ends) < 2:
            return None
        spans.append(sorted(ends, key=lambda point: float(point @ along)))
    start = max((span[0] for span in spans), key=lambda point: float(point @ along))
    end = min((span[-1] for span in spans), key=lambda point: float(point @ along))
    return np.stack([start, end]) if float((end - start) @ along) > 0 else None
