"""Finite elements as rivals: what is kept and shared, and the page's table made again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from unitcad.cache import DiskStore, MemoryStore
from unitcad.errors import Missing
from unitcad.experiments.draws import Draws
from unitcad.experiments.element_rivals import BLOCK, FINENESS
from unitcad.experiments.lab_file import Lab, load_lab
from unitcad.experiments.most_telling import most_telling
from unitcad.experiments.protocol import ratios
from unitcad.experiments.rivals import available
from unitcad.experiments.study import predictions, range_of, span_text, study
from unitcad.validation import load

pytest.importorskip("skfem")


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
    assert store.counts["data built"] == 1
    other = skin.levels(variant, Draws(BLOCK, 1, skin.name))
    again = edge.levels(variant, Draws(BLOCK, 1, edge.name, kept=(3, 8)))
    assert store.counts["data built"] == 2  # those two together
    assert again == pytest.approx(first[[3, 8]], rel=0)
    assert len(edge.levels(variant, Draws(BLOCK + 1, 1, edge.name))) == BLOCK + 1
    assert store.counts["data built"] == 4  # spread over eleven all are others, in two blocks

    from unitcad.attenuation.mechanics.motor_level import level
    from unitcad.attenuation.mechanics.unknowns import Draw

    (exact,) = available(["mechanics-axial-edge"], store, 1e-15).rivals
    alone = level(variant, 60.0, "axial", "edge", Draw(1, 3, BLOCK), FINENESS)
    assert exact.levels(variant, Draws(BLOCK, 1))[3] == alone
    # On a rigid plate the skin stands still, and so does a motor that lies on it: both read as the least amplitude.
    assert store.counts["data built"] == 4
    assert np.all(other <= 1.0)
    assert np.count_nonzero(other == 1.0) == np.count_nonzero(first == 1.0) > 0


def test_what_was_interrupted_goes_on_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    from unitcad.attenuation.mechanics import motor_level

    calls: list[int] = []

    def motion(variant: Any, drive: str, setting: Any, fineness: float) -> motor_level.Motion:
        calls.append(len(calls))
        if len(calls) == BLOCK + 5:
            raise KeyboardInterrupt
        moved = (complex(len(calls)), 0j, 0j)
        return motor_level.Motion(1.0 + 0j, 0j, moved, moved, 1)

    monkeypatch.setattr(motor_level, "motion", motion)
    (variant,) = _part("encapsulating E10/D10", frequencies_hz=(60,), bodies=("rigid-plate",)).variants.values()
    store = MemoryStore()
    (rival,) = available(["mechanics-flat-edge"], store).rivals
    with pytest.raises(KeyboardInterrupt):
        rival.levels(variant, Draws(2 * BLOCK, 1, rival.name))
    assert len(calls) == BLOCK + 5
    found = rival.levels(variant, Draws(2 * BLOCK, 1, rival.name))
    assert found[:BLOCK] == pytest.approx(1.0 + np.arange(BLOCK))
    assert len(calls) == 2 * BLOCK + 5


def test_what_moves_less_than_the_instrument_shows_is_called_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the plate the unit's edge moves by 1 um in 30 % of the draws, by 0.01 um in the others."""
    from unitcad.attenuation.mechanics import motor_level

    moves = iter(range(10_000))

    def motion(variant: Any, drive: str, setting: Any, fineness: float) -> motor_level.Motion:
        small = next(moves) % 10 >= 3 and variant.tissue[0].density > 2000
        moved = (complex(1e-8 if small else 1e-6), 0j, 0j)
        return motor_level.Motion(1e-5 + 0j, 0j, moved, moved, 1)

    monkeypatch.setattr(motor_level, "motion", motion)
    lab = _part("encapsulating E10/D10", frequencies_hz=(60, 200), bodies=("rigid-plate", "gel-50kpa"))
    lab = replace(lab, settings=structs.replace(lab.settings, held_to_levels=False))
    rivals = available(["crossings", "mechanics-flat-edge"], MemoryStore()).rivals
    predicted = predictions(lab, rivals)
    unread = {}
    for ratio in ratios(predicted.conditions, ["frequency", "body"]):
        span = range_of(ratio, predicted, "mechanics-flat-edge")
        unread[str(ratio)] = span["unread"]
        assert (span_text(span) == "below what can be read") == ("rigid-plate" in str(ratio))
        assert span_text(range_of(ratio, predicted, "crossings")) == "1"
    assert sorted(unread.values()) == pytest.approx([0.0, 0.7, 0.7, 0.7])


def test_without_the_library_the_elements_are_left_out_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("unitcad.experiments.element_rivals.installed", lambda: False)
    found = available(["crossings", "mechanics-flat-edge"])
    assert [rival.name for rival in found.rivals] == ["crossings"]
    assert "the extra fem" in found.left_out["mechanics-flat-edge"]


@pytest.mark.parametrize("rivals", [["mechanics-flat-skin", "bush"], ["mechanics-flat-skin", "mechanics-axial-skin"]])
def test_without_the_library_too_few_rivals_name_it(rivals: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("unitcad.experiments.element_rivals.installed", lambda: False)
    with pytest.raises(Missing, match=r"mechanics-flat-skin needs scikit-fem, of the extra fem"):
        study(load_lab("paper", {"rivals": rivals}))
    specs = {"open": load("embedded")}
    with pytest.raises(Missing, match="mechanics-flat-skin needs scikit-fem"):
        most_telling((rivals[0], rivals[1]), specs)
