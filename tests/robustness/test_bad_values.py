"""Thousands of forbidden values: each is refused with its field, in one line, with advice that is then accepted."""

import json
import sys

import pytest
from bad_values import bad_values, sample, toml, with_value

from unitcad.cli import main
from unitcad.errors import Refusal, UnitcadError, UnknownKey
from unitcad.spec import to_data
from unitcad.sweeps.sweep import from_file
from unitcad.validation import from_data, load

SEED = 13


def _named(path, field):
    """Whether a refusal's field is the path, a table that it lies in, or something in what was put there."""
    return f"{path}.".startswith(f"{field}.") or f"{field}.".startswith(f"{path}.")


def _refused(path, value, base):
    with pytest.raises(Refusal) as refused:
        from_data(with_value(base, path, value))
    refusal = refused.value
    assert _named(path, refusal.field), (path, value, str(refusal))
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


@pytest.mark.parametrize("count", [1000, pytest.param(None, marks=pytest.mark.long)])
def test_bad_values_are_refused_with_their_field(count):
    found = sample("spec", count, SEED) if count else bad_values("spec")
    assert count or len(found) > 10_000
    bases = [to_data(load(name)) for name in ("encapsulating", "embedded", "no-fpcb")]
    for i, (path, value) in enumerate(found):
        base = bases[i % 3]
        _check_advice(_refused(path, value, base), path, value, base)


def test_bad_values_of_a_sweep_file_are_refused_with_their_field(tmp_path):
    good = {"base": "encapsulating", "name": "s", "sweep": {"diameter_mm": {"start": 14.0, "stop": 15.0, "num": 2}}}
    from_file(good, tmp_path, "s")
    cases = [(path, value) for path, value in bad_values("sweep")]
    cases += [(f"sweep.diameter_mm.{path}", value) for path, value in bad_values("range")]
    for path, value in cases:
        if path in ("sweep.mode", "sweep.cases") and value in ([], "product"):
            continue
        with pytest.raises(UnitcadError) as refused:
            sweep = from_file(with_value(good, path, value), tmp_path, "s")
            sweep.spec(0)
        assert len(str(refused.value).splitlines()) == 1
        assert isinstance(refused.value, Refusal)
        assert _named(path, refused.value.field) or _named(path, f"sweep.{refused.value.field}"), (path, value)
        json.dumps(refused.value.as_dict(), allow_nan=False)


def _run(words, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["unitcad", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    return int(ended.value.code or 0), out, err


@pytest.mark.parametrize(("count", "seed"), [(20, SEED), pytest.param(1000, SEED + 1, marks=pytest.mark.long)])
def test_commands_refuse_bad_values_in_one_line(count, seed, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    base = to_data(load("encapsulating"))
    for i, (path, value) in enumerate(sample("spec", count, seed)):
        if value == {}:  # the writer leaves out empty tables
            continue
        try:
            (tmp_path / "spec.toml").write_text(toml(with_value(base, path, value)), "utf-8")
        except UnicodeEncodeError:  # no file holds half a surrogate pair
            continue
        swept = "casting.room_c" if path.startswith("estimate") else "estimate.frequency_hz"
        (tmp_path / "sweep.toml").write_text(f'base = "./spec.toml"\n[sweep]\n"{swept}" = [20.0, 25.0]\n', "utf-8")
        axis = toml({"base": "encapsulating", "sweep": {path: [value]}})
        (tmp_path / "axis.toml").write_text(axis, "utf-8")
        before = sorted(tmp_path.rglob("*"))
        for command in (
            ["build", "./spec.toml"],
            ["estimate", "./spec.toml"],
            ["batch", "./sweep.toml", "--dry-run"],
            ["batch", "./axis.toml", "--dry-run"],
        ):
            as_json = (i + len(command)) % 2 == 0
            code, out, err = _run([*command, *(["--json"] if as_json else [])], capsys, monkeypatch)
            said = (command, path, value, out, err)
            assert code == 2, said
            assert "internal error" not in err, said
            assert "Traceback" not in out + err, said
            assert err.startswith("error: "), said
            if as_json:
                error = json.loads(out)["error"]
                named = error.get("field") or error["message"]
                assert any(_named(path, word) for word in (named, named.removeprefix("sweep."))) or path in named, said
            else:
                assert path.rpartition(".")[2] in err or path.partition(".")[0] in err, said
        assert sorted(tmp_path.rglob("*")) == before


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
        (["batch", "published", "--cache-limit", "inf", "--dry-run"], "--cache-limit"),
        (["batch", "published", "--timeout", "inf", "--dry-run"], "--timeout"),
        (["batch", "published", "--cache-limit", "nan", "--dry-run"], "--cache-limit"),
        (["batch", "published", "--timeout", "nan", "--dry-run"], "--timeout"),
        (["check", "none.stl", "--timeout", "nan"], "--timeout"),
        (["material", "none.csv", "--gauge-mm", "nan"], "--gauge-mm"),
        (["material", "none.csv", "--cell-n", "nan"], "--cell-n"),
        (["batch", "published", "-j", "1000000"], "--jobs"),
        (["init", "CON"], "NAME"),
        (["init", "lpt1.mine"], "NAME"),
        (["init", "ends."], "NAME"),
        (["schema", "\udcff"], "schema"),
        (["coupon", "\x00"], "PRINTER"),
    ],
)
def test_words_that_can_not_be_are_refused(words, field, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = _run(words, capsys, monkeypatch)
    assert code == 2, (out, err)
    assert field in err
    assert "internal error" not in err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "text", ["name = 1979-05-27", f"diameter_mm = {'9' * 5000}", f"{'.'.join('a' * 5000)} = 1", "a = " + "[" * 5000]
)
def test_a_file_that_can_not_be_is_refused(text, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(text)
    (tmp_path / "sweep.toml").write_text('base = "./s.toml"\n[sweep]\ndiameter_mm = [14.0, 15.0]\n')
    for command in (["build", "./s.toml"], ["estimate", "./s.toml", "--json"], ["batch", "sweep.toml", "--dry-run"]):
        code, _, err = _run(command, capsys, monkeypatch)
        assert code == 2, err
        # A line for each fault: what the file lacks besides is named too.
        assert all(line.startswith("error: ") for line in err.splitlines()), err


def test_every_frequency_step_that_is_offered_is_accepted():
    from unitcad.cli.estimate_command import frequencies

    for text in ("1:5000:5e-324", "1:5000:0.001", "100:100.5:1e-9", "99.7:4999.3:1", "0.5:10:1", "10:5:1"):
        with pytest.raises(Refusal) as refused:
            frequencies(text)
        assert 1 <= len(frequencies(str(refused.value.nearest))) <= 1000
