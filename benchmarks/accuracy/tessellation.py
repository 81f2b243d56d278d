"""Meshes against the B-rep: volume error and distance over time and triangles, by four methods."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.measures import mesh_volume
from benchmarks.accuracy.result import Plot, Promise, Result, Say, Summary, Table, fastest, shown, stars
from unitcad.accuracy.measurements import TOLERANCES, Mesh, Timing, interleaved
from unitcad.accuracy.occt_distance import distance
from unitcad.api.variant import Variant
from unitcad.kernels import bounds, mesh
from unitcad.shape import Shape
from unitcad.spec.raw import OutputTable
from unitcad.validation import default_template, load

ANGLE = 0.1
"""The angle of OCCT's tessellation, radians: the default of `tessellate` in both libraries."""
DEFAULT = OutputTable().tolerance_mm
"""unitcad's tolerance where a spec names none, mm."""
REVOLVED = "motor"
"""A body that is revolved alone; the others have extruded parts: layers a slot, moulds walls and bores."""
BODIES = (REVOLVED, "layer2", "base", "cup2")
_SAMPLES = 400


@dataclass(frozen=True)
class _Row:
    method: str
    tolerance: float
    triangles: int
    volume_error: float
    distance: float
    time: Timing


def run(quick: bool, say: Say) -> Result:
    """Mesh bodies of the default template by every method and tolerance."""
    tolerances = (0.1, DEFAULT, 0.003) if quick else TOLERANCES
    variant = Variant.of(default_template())
    parts = {body.name: body.shape for body in (*variant.unit, *variant.plan.tools)}
    tables, plots, promises, by_body = [], [], [], {}
    for name in BODIES[:2] if quick else BODIES:
        say(name)
        shape, radius = parts[name], variant.dimensions.outer_radius
        rows = by_body[name] = _rows(shape, radius, tolerances, repeats=2 if quick else 5)
        tables.append(_table(name, rows))
        plots += _plots(name, rows)
        for row in (row for row in rows if row.method == _TRUE):
            bound = bounds.deviation(shape, mesh.segment_count(radius, row.tolerance)) + 1e-6
            what = f"{name} at {row.tolerance:g}:"
            over = f"{what} distance over the bound that its segments imply (1: attained, by construction)"
            promises.append(Promise(over, row.distance / bound, 1.0))
            over = f"{what} distance over 1.5 times the tolerance"
            promises.append(Promise(over, row.distance / row.tolerance / 1.5, 1.0))
            if name == REVOLVED:
                promises.append(
                    Promise(f"{what} volume error of a body that is revolved alone", row.volume_error, 1e-12)
                )
    return Result(
        suite="tessellation",
        title="Tessellation: error against time and triangles",
        text=(
            "manifold3d draws a circle as a polygon, either through the circle's points (plain) or with the circle's "
            f"area (area-true, unitcad's way). The {REVOLVED} is only revolved, so its area-true volume is exact "
            "to rounding at any tolerance. The other bodies have extruded parts too, such as the slot of a tail. "
            "Where these meet a revolved face, a little volume is off. build123d and CadQuery each "
            f"tessellate their own solid by their own `tessellate`, at its default angle of {ANGLE} rad. Both call "
            f"OCCT's mesher{_same_triangles(by_body)}. Distance is one-sided: the farthest that any of {_SAMPLES} "
            "sampled vertices, edge middles and face centres of the mesh is from the B-rep's surface. "
            f"{_default(by_body, tolerances)}"
        ),
        tables=tuple(tables),
        plots=(overall(by_body), *plots),
        promises=tuple(promises),
        measured=machine("manifold3d", "build123d", "cadquery", "cadquery-ocp"),
        summary=summary(by_body),
    )


def overall(by_body: dict[str, list[_Row]]) -> Plot:
    """Plot the farthest distance of all bodies against the time for all of them."""
    points = _all_bodies(by_body, lambda row: row.distance)
    methods = dict.fromkeys(method for method, _ in points)
    return Plot(
        f"Solids: distance from the exact surface, worst of {len(by_body)} bodies, against time",
        "seconds for all of them, from the tree",
        "distance, mm",
        {name: tuple(point for (method, _), point in points.items() if method == name) for name in methods},
        frontier=True,
    )


def summary(by_body: dict[str, list[_Row]]) -> Summary:
    """Return the fastest method for some errors, and which of unitcad's meshes is closest to its limit."""
    bodies = f"meshes of {len(by_body)} bodies"
    picks = []
    for what, error, levels, unit in (
        ("distance from the exact surface", lambda row: row.distance, (0.1, 0.01, 0.002), " mm"),
        ("volume", lambda row: row.volume_error, (1e-3, 1e-5), ""),
    ):
        points = _all_bodies(by_body, error)
        named = [(f"{m} at {t:g} mm: {shown(1e3 * c)} ms", c, e) for (m, t), (c, e) in points.items()]
        picks += [
            (f"{bodies}: {what}", f"{level:g}{unit}", best) for level in levels if (best := fastest(named, level))
        ]
    name, worst = max(
        ((name, row) for name, rows in by_body.items() for row in rows if row.method == _TRUE),
        key=lambda one: one[1].distance / one[1].tolerance,
    )
    share = worst.distance / worst.tolerance / 1.5
    return Summary(
        tuple(picks), f"{name} at {worst.tolerance:g} mm: {shown(worst.distance)} mm, {share:.2f} of its limit", 0
    )


def _all_bodies(
    by_body: dict[str, list[_Row]], error: Callable[[_Row], float]
) -> dict[tuple[str, float], tuple[float, float]]:
    """Return (seconds for all bodies, largest error) of each method and tolerance."""
    together: dict[tuple[str, float], list[_Row]] = {}
    for rows in by_body.values():
        for row in rows:
            together.setdefault((row.method, row.tolerance), []).append(row)
    return {key: (sum(r.time.median for r in rows), max(map(error, rows))) for key, rows in together.items()}


def _table(name: str, rows: list[_Row]) -> Table:
    marks = [
        stars([(cost(row), error(row)) for row in rows])
        for cost in (lambda row: row.time.median, lambda row: float(row.triangles))
        for error in (lambda row: row.volume_error, lambda row: row.distance)
    ]
    return Table(
        f"{name} of the {default_template()} template",
        (
            "method",
            "tolerance, mm",
            "triangles",
            "volume error",
            "distance, mm",
            "time from the tree",
            "time: volume",
            "time: distance",
            "triangles: volume",
            "triangles: distance",
        ),
        tuple(
            (r.method, r.tolerance, r.triangles, r.volume_error, r.distance, str(r.time), *on)
            for r, *on in zip(rows, *marks, strict=True)
        ),
        "Stars, a column for each frontier: no other row is lower in both.",
    )


def _plots(name: str, rows: list[_Row]) -> list[Plot]:
    def series(x: Callable[[_Row], float], y: Callable[[_Row], float]) -> dict[str, tuple[tuple[float, float], ...]]:
        methods = dict.fromkeys(row.method for row in rows)
        return {name: tuple((x(row), y(row)) for row in rows if row.method == name) for name in methods}

    return [
        Plot(
            f"{name}: volume error against time",
            "seconds from the tree",
            "volume error, relative",
            # An error of zero has no logarithm: rounding stands for it.
            series(lambda row: row.time.median, lambda row: max(row.volume_error, 1e-17)),
            frontier=True,
        ),
        Plot(
            f"{name}: distance against triangles",
            "triangles",
            "distance, mm",
            series(lambda row: float(row.triangles), lambda row: max(row.distance, 1e-17)),
            frontier=True,
        ),
    ]


def _same_triangles(by_body: dict[str, list[_Row]]) -> str:
    """Say at which tolerances OCCT's meshes of a body have the same number of triangles."""
    groups = []
    for name, rows in by_body.items():
        counts: dict[int, list[float]] = {}
        for row in rows:
            if row.method == "CadQuery":
                counts.setdefault(row.triangles, []).append(row.tolerance)
        alike = [", ".join(f"{t:g}" for t in sorted(some, reverse=True)) for some in counts.values() if len(some) > 1]
        if alike:
            groups.append(f"{name} at {' and at '.join(alike)} mm")
    if not groups:
        return ""
    return f", and on bodies this small that angle decides: as many triangles for {'; '.join(groups)}"


def _default(by_body: dict[str, list[_Row]], tolerances: tuple[float, ...]) -> str:
    """Say what unitcad's default costs and gives, against the next finer tolerance."""
    costs = []
    finer = max(t for t in tolerances if t < DEFAULT)
    for name, rows in by_body.items():
        here, there = (next(r for r in rows if r.method == _TRUE and r.tolerance == t) for t in (DEFAULT, finer))
        costs.append(
            f"{name} {shown(here.volume_error)} of volume, {shown(here.distance)} mm, {here.triangles} triangles, "
            f"{here.time} (at {finer:g} mm: {shown(there.volume_error)}, {shown(there.distance)} mm, "
            f"{there.triangles}, {there.time})"
        )
    play = load(default_template()).moulds.plinth_clearance_mm
    return (
        f"The default of {DEFAULT:g} mm is 1/{play / DEFAULT:.0f} of the play between printed faces ({play:g} mm): "
        f"{'; '.join(costs)}."
    )


_TRUE, _PLAIN = "manifold3d, area-true", "manifold3d, plain"


def _rows(shape: Shape, radius: float, tolerances: tuple[float, ...], repeats: int) -> list[_Row]:
    from benchmarks.accuracy.brep_measures import measure
    from unitcad.kernels import occt

    (brep,) = occt.solids([shape])
    true_volume = measure(brep).volume
    rows = []
    for tolerance in tolerances:
        for method, time in interleaved(_methods(shape, radius, tolerance), repeats).items():
            vertices, faces = time.value
            error = abs(mesh_volume(vertices, faces)[0] / true_volume - 1)
            rows.append(_Row(method, tolerance, len(faces), error, distance(vertices, faces, brep, _SAMPLES), time))
    return sorted(rows, key=lambda row: row.method)


def _methods(shape: Shape, radius: float, tolerance: float) -> dict[str, Callable[[], Mesh]]:
    from benchmarks.accuracy import build123d_kernel, cadquery_kernel

    def by_manifold(segments: int, swell: float | None = None) -> Mesh:
        mesh.forget()
        return mesh.arrays(mesh.realise(shape, segments, swell))

    def by_build123d() -> Mesh:
        points, faces = build123d_kernel.solid(shape).tessellate(tolerance, ANGLE)
        return np.array([tuple(point) for point in points]), np.array(faces)

    def by_cadquery() -> Mesh:
        points, faces = cadquery_kernel.solid(shape).tessellate(tolerance, ANGLE)
        return np.array([point.toTuple() for point in points]), np.array(faces)

    return {
        _TRUE: lambda: by_manifold(mesh.segment_count(radius, tolerance)),
        _PLAIN: lambda: by_manifold(_inscribed_count(radius, tolerance), swell=1.0),
        "build123d": by_build123d,
        "CadQuery": by_cadquery,
    }


def _inscribed_count(radius: float, tolerance: float) -> int:
    """Return the sides of an inscribed polygon within `tolerance`, a multiple of 8 like the area-true one's."""
    n = mesh.COARSEST
    while n < mesh.FINEST and radius * (1 - np.cos(np.pi / n)) > tolerance:
        n += 8
    return n
