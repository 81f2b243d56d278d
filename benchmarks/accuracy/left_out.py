"""What a build leaves out per template and request, and the time that it saves."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Cell, Result, Say, Table
from unitcad.accuracy.timing import interleaved
from unitcad.cache import MemoryStore
from unitcad.pipeline import plan as bodies
from unitcad.pipeline.make import Progress, Subject
from unitcad.pipeline.manifest import Manifest
from unitcad.pipeline.plan import OUTPUTS
from unitcad.validation import default_template, load, templates

_ALL = ("step", "stl", "3mf", "svg", "glb")
REQUESTS: dict[str, tuple[Sequence[str], Sequence[str], bool]] = {
    "everything": (OUTPUTS, _ALL, True),
    "default formats": (OUTPUTS, ("step", "stl", "3mf"), True),
    "STL only": (OUTPUTS, ("stl",), True),
    "STL, no checks": (("unit", "moulds"), ("stl",), False),
    "unit only": (("unit",), ("stl",), True),
    "estimate only": (("estimate",), ("stl",), True),
}
"""Outputs, formats, checks. Without shaded pictures, which another process draws."""


def run(quick: bool, say: Say) -> Result:
    """Build every template and request, from an empty store each time."""
    chosen = (default_template(),) if quick else tuple(templates())
    rows: list[tuple[Cell, ...]] = []
    for name in chosen:
        say(name)
        times = interleaved({request: partial(_manifest, name, request) for request in REQUESTS}, 1 if quick else 3)
        whole = times["everything"].median
        for request, time in times.items():
            left = "; ".join(f"{entry['what']} ({entry['why']})" for entry in time.value["left_out"])
            rows.append((name, request, str(time), time.median / whole, left or "nothing"))
    return Result(
        suite="left-out",
        title="What is left out",
        text=(
            "A build computes what the outputs that were asked for need, and its manifest says what it left out and "
            "why. Here every request starts from an empty store in a warm process; the share is of the time for "
            "everything."
        ),
        tables=(Table("By template and request", ("template", "asked for", "time", "share", "left out"), tuple(rows)),),
        measured=machine("manifold3d", "cadquery-ocp"),
    )


def _manifest(template: str, request: str) -> Manifest:
    only, formats, check = REQUESTS[request]
    bodies.forget()
    wanted = Subject(load(template, [f"output.formats={list(formats)}"]))
    return wanted.make(only, check, MemoryStore(), Progress()).manifest
