"""A unit without circuit, or with wires in its place, by one change: in a spec, a sweep and an array."""

import pytest
from msgspec import structs

import unitcad
from unitcad.arrays import load_array
from unitcad.errors import Refusal
from unitcad.sweeps import load_sweep

WIRES = "wires={diameter_mm=0.4, count=2}"


def test_false_is_no_circuit_and_wires_take_its_place():
    bare = unitcad.load("encapsulating", set=["fpcb=false"])
    wired = unitcad.load("encapsulating", set=[WIRES])
    assert bare.fpcb is bare.wires is wired.fpcb is None
    assert wired.wires is not None
    assert (wired.wires.diameter_mm, wired.wires.count) == (0.4, 2)
    assert unitcad.load("no-fpcb", set=["fpcb.tail='both'"]).wires is None
    # False leaves the other as it is, and a table can follow false.
    assert unitcad.load("encapsulating", set=["wires=false"]) == unitcad.load("encapsulating")
    assert unitcad.load(bare, set=[WIRES]) == wired
    data = {**unitcad.validation.read("no-fpcb"), "wires": False}
    assert structs.replace(unitcad.load(data, set=[WIRES]), name=wired.name) == wired


@pytest.mark.parametrize(("given", "words"), [
    ([WIRES, 'fpcb={tail="one"}'], "wires: they take the place of a circuit"),
    (["fpcb={}"], "fpcb = {}: an empty table; takes a table, with keys such as tail, thickness_mm"),
    (["wires={}"], "wires = {}: an empty table; takes a table with diameter_mm, or false for none"),
    (["fpcb=true"], "fpcb = true: takes a table, or false for none"),
    (["parameters={a=1}"], "parameters: only a custom design takes it"),
])  # fmt: skip
def test_a_refusal_names_what_it_takes_and_no_value_that_nobody_wrote(given, words):
    with pytest.raises(Refusal) as refused:
        unitcad.load("encapsulating", set=given)
    assert str(refused.value).startswith(words)
    assert "..." not in str(refused.value)
    assert "'a table'" not in str(refused.value)


def test_a_sweep_varies_circuit_and_wires(tmp_path):
    file = tmp_path / "leads.toml"
    file.write_text(
        'base = "encapsulating"\n[sweep]\nmode = "zip"\nfpcb = [{tail = "one"}, false, false]\n'
        "wires = [false, {diameter_mm = 0.4}, false]\n"
    )
    sweep = load_sweep(file)
    assert [(bool(spec.fpcb), bool(spec.wires)) for spec in map(sweep.spec, range(3))] == [
        (True, False), (False, True), (False, False),
    ]  # fmt: skip
    assert sweep.spec(1).name == "encapsulating-no-fpcb-wires-diameter0.4"
    file.write_text('base = "encapsulating"\nset = {wires = {diameter_mm = 0.4}}\n[sweep]\ndiameter_mm = [14, 15]\n')
    assert load_sweep(file).spec(1).fpcb is None


def test_an_arrays_units_take_the_same_change():
    for change in ("unit.fpcb=false", f"unit.{WIRES}"):
        unit = load_array("forearm-pockets", [change], lay_tails=False).unit
        assert unit.fpcb is None
        assert bool(unit.wires) == ("wires" in change)
    like = {"like": "encapsulating", "wires": {"diameter_mm": 0.4}}
    assert load_array("forearm-pockets", {"unit": like}, lay_tails=False).unit.fpcb is None
