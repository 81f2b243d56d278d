"""Custom designs: overlaps without moulds, moulds by complement of the cast layers, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from unitcad.pipeline.build import Built, build
from unitcad.validation import load

SPEC = """
name = "custom"
design = "drawn.py:unit"
diameter_mm = 14.0
{circuit}
{layers}
[output]
formats = ["stl"]
tolerance_mm = 0.05
"""
LAYER = '[[layers]]\nmaterial = "ecoflex-00-30"\nwall_mm = 1.25\ncap_mm = 1.25\n'
HEAD = """
from unitcad.shape import Extrude, Profile, Revolve, box, cut, cylinder, moved, polygon, ring, rounded_rectangle, union
"""


def written(folder: Path, code: str, layers: int = 1, circuit: str = "") -> Path:
    """Write a custom design and its spec."""
    (folder / "drawn.py").write_text(HEAD + code)
    (folder / "spec.toml").write_text(SPEC.format(layers=LAYER * layers, circuit=circuit))
    return folder / "spec.toml"


def built(folder: Path, code: str, *only: str, **more: Any) -> Built:
    """Build a custom design."""
    return build(load(written(folder, code, **more)), folder / "out", only=only or ("unit",))


def test_overlaps_inside_the_unit_are_errors_without_moulds_too(tmp_path: Path) -> None:
    """The circuit's tail, 3 x 0.11 mm, runs through 1.25 mm of a ring as high as motor and circuit."""
    code = "def unit(spec):\n    return ring(5.75, 7.0, 0, 2.11)\n"
    done = built(tmp_path, code, circuit="[fpcb]\nthickness_mm = 0.11\n")
    assert not done.ok
    (law,) = [law for law in done.manifest["laws"] if not law["ok"]]
    assert (law["code"], law["where"]) == ("C200", "unit: layer1 and fpcb")
    assert abs(law["value"] - 0.11 * 3 * 1.25) < 0.02
    whole = built(tmp_path, code.replace("2.11", "2.0"), circuit="[fpcb]\nthickness_mm = 0.11\n")
    assert whole.ok
    assert [law["code"] for law in whole.manifest["laws"]] == ["C200"]
