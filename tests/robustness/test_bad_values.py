"""Thousands of forbidden values: each is refused with its field, in one line, with advice that is then accepted."""

import json
import sys
from pathlib import Path

import pytest

from tests.robustness.bad_values import bad_values, sample, toml, with_value
from unitcad.cli import main
from unitcad.errors import Refusal, UnknownKey
from unitcad.spec import to_data
from unitcad.validation import from_data, load

SEED = 13


def named(path, field):
    """Whether a refusal's field is the path, a table that it lies in, or something in what was put there."""
    return f"{path}.".startswith(f"{field}.") or f"{field}.".startswith(f"{path}.")


def _refused(path, value, base):
    with pytest.raises(Refusal) as refused:
        from_data(with_value(base, path, value))
    refusal = refused.value
    assert named(path, refusal.field), (path, value, str(refusal))
    assert len(str(refusal).splitlines()) == 1, (path, value)
    assert len(str(refusal)) < 1500, (path, value)
    json.dumps(refusal.as_dict(), allow_nan=False).encode("ascii")
    return refusal


def _check_advice(refusal, path, value, base):
    """What is offered passes every check of that field."""
    if refusal.nearest is None or isinstance(refusal, UnknownKey):
        return
    try:
        from_data(with_value(with_value(base, path, value), refusal.field, refusal.nearest))
    except Refusal as other:
        assert other.field != refusal.field, (str(refusal), str(other))


@pytest.mark.parametrize("count", [400, pytest.param(None, marks=pytest.mark.long)])
def test_bad_values_are_refused_with_their_field(count):
    found = sample(count, SEED) if count else bad_values()
    assert count or len(found) > 10_000
    bases = [to_data(load(name)) for name in ("encapsulating", "embedded", "no-fpcb")]
    for i, (path, value) in enumerate(found):
        base = bases[i % 3]
        _check_advice(_refused(path, value, base), path, value, base)


def _run(words, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["unitcad", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    return int(ended.value.code or 0), out, err


def check_refused(case, commands, as_json, capsys, monkeypatch):
    """Check that each command refuses a path's value in one line, and writes nothing."""
    path, value = case
    before = sorted(Path().rglob("*"))
    for command in commands:
        code, out, err = _run([*command, *(["--json"] if as_json else [])], capsys, monkeypatch)
        said = (command, path, value, out, err)
        assert code == 2, said
        assert "internal error" not in err, said
        assert "Traceback" not in out + err, said
        assert err.startswith("error: "), said
        if as_json:
            error = json.loads(out)["error"]
            told = error.get("field") or error["message"]
            assert any(named(path, word) for word in (told, told.removeprefix("sweep."))) or path in told, said
        else:
            assert path.rpartition(".")[2] in err or path.partition(".")[0] in err, said
    assert sorted(Path().rglob("*")) == before


@pytest.mark.parametrize(("count", "seed"), [(20, SEED), pytest.param(1000, SEED + 1, marks=pytest.mark.long)])
def test_commands_refuse_bad_values_in_one_line(count, seed, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    base = to_data(load("encapsulating"))
    for i, (path, value) in enumerate(sample(count, seed)):
        if value == {}:  # the writer leaves out empty tables
            continue
        try:
            Path("spec.toml").write_text(toml(with_value(base, path, value)), "utf-8")
        except UnicodeEncodeError:  # no file holds half a surrogate pair
            continue
        for k, command in enumerate(("build", "estimate")):
            check_refused((path, value), [[command, "./spec.toml"]], (i + k) % 2 == 0, capsys, monkeypatch)


@pytest.mark.parametrize(
    ("words", "field"),
    [
        (["estimate", "encapsulating", "--set", "layers.²=1"], "layers.²"),
        (["estimate", "encapsulating", "--set", f"layers.{'9' * 5000}=1"], "layers."),
        (["estimate", "encapsulating", "--set", f"diameter_mm={'9' * 5000}"], "diameter_mm"),
        (["estimate", "encapsulating", "--set", f"{'.'.join('a' * 5000)}=1"], "a.a.a"),
        (["estimate", "encapsulating", "--set", f"layers={'[' * 5000}"], "layers"),
        (["estimate", "encapsulating", "--set", "name='\udcff'"], "name"),
        (["estimate", "encapsulating", "--set", "estimate.models=[]"], "estimate.models"),
        (["estimate", "encapsulating", "--set", "casting.waste=1e308"], "casting.waste"),
        (["estimate", "encapsulating", "--set", "motor.diameter_mm=1e-12"], "motor.diameter_mm"),
        (["estimate", "encapsulating", "--set", "moulds.filament_mm=0.001"], "moulds.filament_mm"),
        (["estimate", "encapsulating", "--set", "fpcb.thickness_mm=1000"], "fpcb.thickness_mm"),
        (["build", "embedded", "--set", "motor.thickness_mm=0.1"], "motor.thickness_mm"),
        (["build", "embedded", "--set", "motor.thickness_mm=0.7"], "motor.thickness_mm"),
        (["build", "encapsulating", "--set", "moulds.engraving_depth_mm=5"], "moulds.engraving_depth_mm"),
        (["estimate", "encapsulating", "--frequency", "1:5000:5e-324"], "--frequency"),
        (["estimate", "encapsulating", "--frequency", "1:5000:nan"], "--frequency"),
        (["cache", "gc", "--limit", "inf"], "--limit"),
        (["cache", "gc", "--limit", "nan"], "--limit"),
        (["check", "none.stl", "--timeout", "nan"], "--timeout"),
        (["init", "CON"], "NAME"),
        (["init", "lpt1.mine"], "NAME"),
        (["init", "ends."], "NAME"),
        (["schema", "\udcff"], "KIND"),
        (["coupon", "\x00"], "PRINTER"),
    ],
)
def test_words_that_can_not_be_are_refused(words, field, tmp_path, capsys, monkeypatch):
    check_words_are_refused(words, field, tmp_path, capsys, monkeypatch)


def check_words_are_refused(words, field, tmp_path, capsys, monkeypatch):
    """Check that a command line is refused by its field, and that nothing is written."""
    monkeypatch.chdir(tmp_path)
    code, out, err = _run(words, capsys, monkeypatch)
    assert code == 2, (out, err)
    assert field in err
    assert "internal error" not in err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


FILES = ["name = 1979-05-27", f"diameter_mm = {'9' * 5000}", f"{'.'.join('a' * 1500)} = 1", "a = " + "[" * 5000]
"""Texts that no spec can be."""


@pytest.mark.parametrize("text", FILES)
def test_a_file_that_can_not_be_is_refused(text, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(text)
    for command in (["build", "./s.toml"], ["estimate", "./s.toml", "--json"]):
        check_file_is_refused(command, capsys, monkeypatch)


def check_file_is_refused(command, capsys, monkeypatch):
    """Check that a command refuses its file: a line for each fault, what the file lacks besides is named too."""
    code, _, err = _run(command, capsys, monkeypatch)
    assert code == 2, err
    assert all(line.startswith("error: ") for line in err.splitlines()), err
