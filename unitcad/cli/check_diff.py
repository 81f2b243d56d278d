"""`unitcad check --diff OLD NEW`: how two versions of a file, or of a folder of files, differ. Lengths in mm."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import trimesh
from PIL import Image, ImageDraw
from scipy.spatial import KDTree

from unitcad import files
from unitcad.errors import Refusal, unknown_name
from unitcad.export import raster
from unitcad.export.finding_pictures import INSIDE, PART, SIZE, folder_name
from unitcad.geometry.arrays import Floats
from unitcad.meshcheck import FileReport, Finding, Options, baseline, file_checks
from unitcad.meshcheck.findings import MOST, Facts, counted, with_places
from unitcad.text import number

FORMATS = ("text", "json", "markdown")
SAMPLES = 100
"""Sampled points along the diagonal of a file's box."""
CHANGED = (0.86, 0.10, 0.12)
_CANDIDATES = 12  # small triangles near a point, of which the nearest one is looked for
_TOWARDS = ((1.0, -1.4, 0.9), (-1.2, 1.3, -0.9))
_ROWS = {"volume_mm3": "volume, mm3", "shells": "shells", "triangles": "triangles"}


@dataclass(frozen=True)
class Difference:
    """Two versions of one file.

    `old` and `new` are None if only the other version exists. The findings of `new` that `old` has, too, are known;
    `gone` are those that only `old` has. `distance_mm` is the largest distance from a point of one surface to the other
    surface, the Hausdorff distance. It is sampled, and off by less than `spacing_mm`.
    """

    name: str
    old: FileReport | None
    new: FileReport | None
    gone: tuple[Finding, ...] = ()
    distance_mm: float | None = None
    spacing_mm: float | None = None

    @property
    def added(self) -> tuple[Finding, ...]:
        """The findings that only the new version has."""
        return tuple(item for item in self.new.findings if not item.known) if self.new else ()

    def as_dict(self) -> dict[str, Any]:
        """Return it JSON-ready."""
        return {
            "name": self.name,
            "old": self.old and self.old.facts.as_dict(),
            "new": self.new and self.new.facts.as_dict(),
            "new_findings": [item.as_dict() for item in self.added],
            "gone_findings": [item.as_dict() for item in self.gone],
            "distance_mm": self.distance_mm,
            "spacing_mm": self.spacing_mm,
        }


def run(old: str, new: str, options: Options, fail_on: str, form: str, pictures: str | None) -> tuple[str, int]:
    """Compare two files or two folders; return the text and the exit code: 1 if a new finding fails.

    Raises Refusal for names that are not two files or two folders, and for a `form` that is not in FORMATS.
    """
    if form not in FORMATS:
        raise unknown_name("--output-format with --diff", form, FORMATS)
    options = replace(options, locations=MOST, draw=True)
    found = [_compare(name, one, other, options, pictures) for name, one, other in _pairs(old, new)]
    code = file_checks.worst([item.new for item in found if item.new], fail_on)
    if form == "json":
        return msgspec.json.format(
            msgspec.json.encode([item.as_dict() for item in found]), indent=2
        ).decode() + "\n", code
    lines = [line for item in found for line in (_text(item) if form == "text" else _markdown(item))]
    return "\n".join([*lines, _verdict(found, fail_on, code), ""]), code


def largest_distance(one: trimesh.Trimesh, other: trimesh.Trimesh, spacing: float) -> tuple[float, Floats, Floats]:
    """Return the largest distance from points of `one` to the surface `other`, the points (n, 3), and their distances.

    The points are the corners of the triangles of `one`, cut until no side is longer than `spacing`. Each point of a
    triangle is within spacing / sqrt(3) of a corner, and of the middle: that bounds the error of both samplings.
    """
    points = _fine(one, spacing)[0]
    vertices, faces = _fine(other, spacing)
    corners = vertices[faces]
    near = KDTree(corners.mean(axis=1)).query(points, k=min(_CANDIDATES, len(corners)))[1].reshape(len(points), -1)
    distances = np.full(len(points), np.inf)
    for column in near.T:
        closest = trimesh.triangles.closest_point(corners[column], points)
        distances = np.minimum(distances, np.linalg.norm(closest - points, axis=1))
    return float(distances.max()), points, distances


def _fine(mesh: trimesh.Trimesh, spacing: float) -> tuple[Floats, Any]:
    return trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, spacing, max_iter=30)  # type: ignore[return-value]


def _pairs(old: str, new: str) -> Iterator[tuple[str, str | None, str | None]]:
    """Yield a name and the two paths of each file; a path is None if that version does not exist."""
    kinds = [Path(path).is_dir() for path in (old, new)]
    for path in (old, new):
        if not Path(path).exists():
            raise Refusal("--diff", path, files.no_such_file(path))
    if kinds[0] != kinds[1]:
        raise Refusal("--diff", f"{old} {new}", "must be two files or two folders; one of them is a folder")
    if not kinds[0]:
        yield Path(new).name, old, new
        return
    inside = [{os.path.relpath(file, top): file for file in file_checks.expand([top])[0]} for top in (old, new)]
    for name in sorted(set(inside[0]) | set(inside[1])):
        yield Path(name).as_posix(), inside[0].get(name), inside[1].get(name)


def _compare(name: str, old: str | None, new: str | None, options: Options, pictures: str | None) -> Difference:
    one, other = (None if path is None else file_checks.check_guarded(path, options) for path in (old, new))
    if one is None or other is None:
        return Difference(name, one, other)
    gone = tuple(item for item in baseline.compare(one, other).findings if not item.known)
    compared = Difference(name, one, baseline.compare(other, one), gone)
    surfaces = [_surface(report) for report in (one, other)]
    if not all(len(surface.faces) for surface in surfaces):
        return compared
    box = np.concatenate([surface.bounds for surface in surfaces])
    spacing = float(np.linalg.norm(np.ptp(box, axis=0))) / SAMPLES
    there = largest_distance(surfaces[0], surfaces[1], spacing)
    back = largest_distance(surfaces[1], surfaces[0], spacing)
    if pictures is not None:
        folder = Path(pictures)
        folder.mkdir(parents=True, exist_ok=True)
        picture = _picture(surfaces, (there[1:], back[1:]), spacing)
        files.write(folder / f"{folder_name(name)}.png", raster.encode_png(picture))
    return replace(compared, distance_mm=max(there[0], back[0]), spacing_mm=spacing)


def _surface(report: FileReport) -> trimesh.Trimesh:
    """Return all triangles of a file that have an area, as one surface."""
    parts = [mesh.vertices[mesh.faces] for mesh in report.meshes if len(mesh.faces)]
    corners = np.concatenate(parts) if parts else np.empty((0, 3, 3))
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners = corners[np.isfinite(corners).all(axis=(1, 2)) & (np.abs(sides).max(axis=1, initial=0.0) > 0)]
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return trimesh.Trimesh(corners.reshape(-1, 3), faces, process=False)


def _picture(
    surfaces: Sequence[trimesh.Trimesh], sampled: Sequence[tuple[Floats, Floats]], spacing: float
) -> Image.Image:
    """Draw old (left) and new (right) from two sides; faces away from the other version's surface are red."""
    width, height = SIZE
    sheet = Image.new("RGB", (2 * width, 2 * height), "white")
    both = np.concatenate([surface.vertices for surface in surfaces])
    for i, (surface, (points, distances)) in enumerate(zip(surfaces, sampled, strict=True)):
        fine = trimesh.Trimesh(*_fine(surface, spacing), process=False)
        away = distances[KDTree(points).query(fine.triangles_center)[1]] > spacing  # more than the error
        colours = np.where(away[:, None], CHANGED, PART)
        drawn = raster.Surface(fine.vertices, fine.faces, colours, inside=np.where(away[:, None], CHANGED, INSIDE))
        for j, towards in enumerate(_TOWARDS):
            view = raster.aim(towards, both, SIZE)
            pixels, _, _ = raster.compose([raster.render(drawn, view)], view)
            panel = Image.fromarray(pixels).convert("RGB").reduce(raster.SHARPER)
            ImageDraw.Draw(panel).text((12, 10), "new" if i else "old", fill="black", font_size=20)
            sheet.paste(panel, (i * width, j * height))
    return sheet


def _rows(item: Difference) -> Iterator[tuple[str, str, str]]:
    """Yield each fact that differs: its name, and its old and new value."""
    before, after = (report.facts if report else Facts() for report in (item.old, item.new))
    for key, title in _ROWS.items():
        values = [getattr(facts, key) for facts in (before, after)]
        one, other = ("none" if value is None else number(value, 6) for value in values)
        if one != other:
            yield title, one, other
    if _box(before) != _box(after):
        yield "box, mm", _box(before), _box(after)


def _box(facts: Facts) -> str:
    if facts.bbox_mm is None:
        return "none"
    low, high = facts.bbox_mm
    return " x ".join(number(b - a, 5) for a, b in zip(low, high, strict=True)) + f" from z = {number(low[2], 4)}"


def _head(item: Difference) -> str:
    if item.old is None or item.new is None:
        return f"{item.name}: {'new file' if item.new else 'file is gone'}"
    if item.distance_mm is None:
        return f"{item.name}: no surface to compare"
    if item.distance_mm < 1e-6 * (item.spacing_mm or 0.0):
        return f"{item.name}: the same surface"
    return f"{item.name}: largest distance {number(item.distance_mm, 3)} mm, to {number(item.spacing_mm or 0.0, 2)} mm"


def _text(item: Difference) -> Iterator[str]:
    yield _head(item)
    for title, old, new in _rows(item):
        yield f"  {title}: {old} -> {new}"
    for sign, findings in (("new", item.added), ("gone", item.gone)):
        for finding in findings:
            yield f"  {sign}: {finding.code} {finding.severity}: {with_places(finding, 1)}"


def _markdown(item: Difference) -> Iterator[str]:
    yield f"**{_head(item)}**\n"
    rows = list(_rows(item))
    if rows:
        yield "| | old | new |\n| --- | --- | --- |"
        yield from (f"| {title} | {old} | {new} |" for title, old, new in rows)
        yield ""
    for sign, findings in (("new", item.added), ("gone", item.gone)):
        yield from (f"- {sign}: `{finding.code}` {finding.severity}: {finding.message}" for finding in findings)
    yield ""


def _verdict(found: Sequence[Difference], fail_on: str, code: int) -> str:
    added, gone = (sum(len(getattr(item, key)) for item in found) for key in ("added", "gone"))
    said = f"{counted(len(found), 'file')}: {counted(added, 'new finding')}, {gone} gone"
    return (
        f"{said}; failed, since a new finding is {'an error' if fail_on == 'error' else 'a warning or an error'}"
        if code
        else said
    )
