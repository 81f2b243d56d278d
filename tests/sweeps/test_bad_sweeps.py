"""Forbidden values in a sweep file, in its base and along its axes: each is refused with its field, in one line."""

import json

import pytest

from tests.robustness.bad_values import bad_values, sample, toml, with_value
from tests.robustness.test_bad_values import (
    FILES,
    SEED,
    check_file_is_refused,
    check_refused,
    check_words_are_refused,
    named,
)
from tests.robustness.test_long_lists import check_error_is_short
from unitcad.errors import Refusal, UnitcadError
from unitcad.spec import to_data
from unitcad.sweeps.sweep import Range, SweepFile, from_file
from unitcad.validation import load


def test_bad_values_of_a_sweep_file_are_refused_with_their_field(tmp_path):
    good = {"base": "encapsulating", "name": "s", "sweep": {"diameter_mm": {"start": 14.0, "stop": 15.0, "num": 2}}}
    from_file(good, tmp_path, "s")
    cases = [(path, value) for path, value in bad_values(SweepFile)]
    cases += [(f"sweep.diameter_mm.{path}", value) for path, value in bad_values(Range)]
    for path, value in cases:
        if path in ("sweep.mode", "sweep.cases") and value in ([], "product"):
            continue
        with pytest.raises(UnitcadError) as refused:
            sweep = from_file(with_value(good, path, value), tmp_path, "s")
            sweep.spec(0)
        assert len(str(refused.value).splitlines()) == 1
        assert isinstance(refused.value, Refusal)
        assert named(path, refused.value.field) or named(path, f"sweep.{refused.value.field}"), (path, value)
        json.dumps(refused.value.as_dict(), allow_nan=False)


@pytest.mark.parametrize(("count", "seed"), [(20, SEED), pytest.param(1000, SEED + 1, marks=pytest.mark.long)])
def test_a_batch_refuses_bad_values_of_its_base_and_of_an_axis(count, seed, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    base = to_data(load("encapsulating"))
    for i, (path, value) in enumerate(sample(count, seed)):
        if value == {}:  # the writer leaves out empty tables
            continue
        try:
            (tmp_path / "spec.toml").write_text(toml(with_value(base, path, value)), "utf-8")
        except UnicodeEncodeError:  # no file holds half a surrogate pair
            continue
        swept = "casting.room_c" if path.startswith("estimate") else "estimate.frequency_hz"
        (tmp_path / "sweep.toml").write_text(f'base = "./spec.toml"\n[sweep]\n"{swept}" = [20.0, 25.0]\n', "utf-8")
        (tmp_path / "axis.toml").write_text(toml({"base": "encapsulating", "sweep": {path: [value]}}), "utf-8")
        commands = [["batch", file, "--dry-run"] for file in ("./sweep.toml", "./axis.toml")]
        check_refused((path, value), commands, i % 2 == 0, capsys, monkeypatch)


@pytest.mark.parametrize(
    ("words", "field"),
    [
        (["--cache-limit", "inf", "--dry-run"], "--cache-limit"),
        (["--timeout", "inf", "--dry-run"], "--timeout"),
        (["--cache-limit", "nan", "--dry-run"], "--cache-limit"),
        (["--timeout", "nan", "--dry-run"], "--timeout"),
        (["-j", "1000000"], "--jobs"),
    ],
)
def test_words_that_can_not_be_are_refused(words, field, tmp_path, capsys, monkeypatch):
    check_words_are_refused(["batch", "published", *words], field, tmp_path, capsys, monkeypatch)


@pytest.mark.parametrize("text", [*FILES[::3], *(pytest.param(text, marks=pytest.mark.long) for text in FILES[1:3])])
def test_a_base_that_can_not_be_is_refused(text, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(text)
    (tmp_path / "sweep.toml").write_text('base = "./s.toml"\n[sweep]\ndiameter_mm = [14.0, 15.0]\n')
    check_file_is_refused(["batch", "sweep.toml", "--dry-run"], capsys, monkeypatch)


def test_many_axes_of_unlike_lengths_give_no_long_line(tmp_path):
    lists = "".join(f'"materials.a.k{i}" = {[1.0] * (i + 2)}\n' for i in range(30))
    sweep = f'base = "encapsulating"\nname = "s"\n[sweep]\nmode = "zip"\n{lists}'
    check_error_is_short(("batch", "s.toml", "--dry-run"), {"s.toml": sweep}, tmp_path)
