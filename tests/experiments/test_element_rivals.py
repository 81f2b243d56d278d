"""Finite elements as rivals: what is kept and shared, and the page's table made again."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from unitcad.cache import DiskStore, MemoryStore
from unitcad.experiments.draws import Draws
from unitcad.experiments.element_rivals import BLOCK, FINENESS
from unitcad.experiments.lab_file import Lab, load_lab
from unitcad.experiments.rivals import available

pytest.importorskip("skfem")
DOCS = Path(__file__).parent.parent.parent / "docs"


def _part(unit: str, *, frequencies_hz: tuple[float, ...], bodies: tuple[str, ...]) -> Lab:
    """Of the shipped lab one unit's conditions alone."""
    lab = load_lab("paper")
    kept = {
        c: variant
        for c, variant in lab.variants.items()
        if c.unit == unit and c.frequency_hz in frequencies_hz and c.body in bodies
    }
    return replace(lab, variants=kept)


def test_solutions_are_kept_and_shared_by_both_readings(tmp_path: Path) -> None:
    (variant,) = _part("encapsulating E10/D10", frequencies_hz=(60,), bodies=("rigid-plate",)).variants.values()
    store = DiskStore(tmp_path / "cache")
    edge, skin = available(["mechanics-axial-edge", "mechanics-axial-skin"], store).rivals
    first = edge.levels(variant, Draws(BLOCK, 1, edge.name))
    assert store.counts["built"] == 1
    other = skin.levels(variant, Draws(BLOCK, 1, skin.name))
    again = edge.levels(variant, Draws(BLOCK + 1, 1, edge.name))
    assert store.counts["built"] == 2  # the second block of ten draws, for the eleventh
    assert again[:BLOCK] == pytest.approx(first, rel=0)
    assert len(again) == BLOCK + 1
    assert np.all(other < 1e-3 * first)  # the skin under the unit is a rigid plate

    from unitcad.attenuation.mechanics.motor_level import level
    from unitcad.attenuation.mechanics.unknowns import Draw

    assert first[3] == level(variant, 60.0, "axial", "edge", Draw(1, 3), FINENESS)


def test_what_was_interrupted_goes_on_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    from unitcad.attenuation.mechanics import motor_level

    calls: list[int] = []

    def level(variant: Any, hertz: float, drive: str, reading: str, draw: Any, fineness: float) -> float:
        calls.append(draw.index)
        if len(calls) == 2 * BLOCK + 5:
            raise KeyboardInterrupt
        return 1.0 + draw.index

    monkeypatch.setattr(motor_level, "level", level)
    (variant,) = _part("encapsulating E10/D10", frequencies_hz=(60,), bodies=("rigid-plate",)).variants.values()
    store = MemoryStore()
    (rival,) = available(["mechanics-flat-edge"], store).rivals
    with pytest.raises(KeyboardInterrupt):
        rival.levels(variant, Draws(2 * BLOCK, 1, rival.name))
    calls.clear()
    assert rival.levels(variant, Draws(2 * BLOCK, 1, rival.name)) == pytest.approx(1.0 + np.arange(2 * BLOCK))
    assert min(calls) == BLOCK


def test_without_the_library_the_elements_are_left_out_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("unitcad.experiments.element_rivals.installed", lambda: False)
    found = available(["crossings", "mechanics-flat-edge"])
    assert [rival.name for rival in found.rivals] == ["crossings"]
    assert "unitcad[fem]" in found.left_out["mechanics-flat-edge"]


def _make_experiments() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_experiments", DOCS / "make_experiments.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_row_of_the_page_is_what_is_found_again() -> None:
    make = _make_experiments()
    lab = _part("encapsulating D10/E10", frequencies_hz=(200,), bodies=("rigid-plate", "gel-50kpa"))
    row = make.row("stiff inside: on a plate over gel", make.predicted(lab))
    assert row in (DOCS / "experiments.md").read_text("utf-8").splitlines()
