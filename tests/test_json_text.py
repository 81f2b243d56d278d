"""JSON of results: a number that is not finite is refused, wherever it stands; None is written as null."""

import json
import math
import struct
from dataclasses import replace

import pytest

from unitcad.casting.procedure import procedure
from unitcad.casting.procedure_text import to_json
from unitcad.json_text import json_bytes
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation.load import load

DATA = {"none": None, "list": [1, {"deep": [None, 0.5]}], "map": {"a": {"b": 1e-300, "c": None}}}


def test_what_is_written_is_what_json_reads_back():
    assert json.loads(json_bytes(DATA)) == DATA


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [{"x": 0}, {"x": [0]}, {"x": {"y": [None, 0]}}, {"x": [{"y": (0,)}]}])
def test_a_number_that_is_not_finite_is_refused(number, place):
    def filled(value):
        if isinstance(value, dict):
            return {key: filled(each) for key, each in value.items()}
        if isinstance(value, (list, tuple)):
            return type(value)(filled(each) for each in value)
        return number if value == 0 else value

    with pytest.raises(ValueError, match="not finite"):
        json_bytes({**DATA, **filled(place)})


@pytest.fixture(scope="module")
def made():
    return procedure(MouldSet(load("encapsulating")), [300.0, 500.0], 30000.0)


def test_a_procedure_is_written_as_its_records(made):
    data = json.loads(to_json(made))
    assert data["earliest_finish_min"] == float(f"{made.earliest_finish_min:.9g}")
    assert [pour["part_a_g"] for pour in data["pours"]] == [float(f"{pour.part_a_g:.9g}") for pour in made.pours]


@pytest.mark.parametrize(
    "text", ["0.12345678", "-1.2345678", "1.234567e9", "12345678.9", "123456.7891", "2.0000000049"]
)
def test_numbers_of_a_procedure_have_nine_digits(made, text):
    data = json.loads(to_json(replace(made, bench_min=float(text))))
    assert repr(data["bench_min"]) == repr(float(f"{float(text):.9g}"))


def test_what_only_looks_infinite_is_written():
    # The bytes by which MessagePack begins an infinite double, within the low bits of another number.
    number = struct.unpack(">d", bytes([0x3F, 0xF0, 0xCB, 0x7F, 0xF0, 0, 0, 1]))[0]
    assert json.loads(json_bytes({"x": [None, number]})) == {"x": [None, number]}
