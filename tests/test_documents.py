"""TOML and JSON: the line of every key, the bounds of what comes in, and the one module that parses."""

import ast
import json
import math
import re
import struct
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

import unitcad
from unitcad.casting.procedure import procedure
from unitcad.casting.procedure_text import to_json
from unitcad.documents import (
    DEEPEST,
    LONGEST_KEY,
    LONGEST_TEXT,
    MOST,
    expect_bounded,
    line_of,
    parse_json,
    parse_toml,
    parse_value,
)
from unitcad.errors import Refusal, UnitcadError
from unitcad.json_text import json_bytes, parse_message
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import load

TEXT = '''\
# c "quote
a.b."c d" = 1
'x y' = """
b = 2
[not]
"""  # x
list = [ # ]
 1, "]", [2,
 3]
]
t = {u = 1, "v" = [1]}
[q.r]   # [z]
k = 1
[[l]]
k = 1
[l.sub]
m = 2
[[l.ar]]
x = 1
[[l.ar]]
x = 2
[[l]]
k = \'\'\'a
k = 5\'\'\'
m = 3
[l.sub]
n = 1
[ "d.e" . f ]
g = "a # b"
h = 5'''
LINES = {
    "a": 2, "a.b.c d": 2, "x y": 3, "list.2.0": 7, "t.u": 11, "q": 12, "q.r": 12, "q.r.k": 13,
    "l": 14, "l.0": 14, "l.0.k": 15, "l.0.sub": 16, "l.0.sub.m": 17, "l.0.ar": 18, "l.0.ar.0.x": 19, "l.0.ar.1.x": 21,
    "l.1": 22, "l.1.k": 23, "l.1.m": 25, "l.1.sub.n": 27, "d.e.f": 28, "d.e.f.g": 29, "d.e.f.h": 30,
    "q.r.missing": 12, "l.1.sub.missing": 26, "missing": None, "a.missing": 2,
}  # fmt: skip


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("path", LINES)
def test_each_key_is_on_its_line(path, end):
    assert line_of(TEXT.replace("\n", end), path) == LINES[path]


@pytest.mark.parametrize(
    "text",
    [
        "".join(f"[t{i}]\n" for i in range(MOST + 1)),
        "".join(f"k{i} = 1\n" for i in range(MOST + 1)),
        f"list = [{'1,' * (MOST + 1)}]",
        f"t = {{{', '.join(f'k{i} = 1' for i in range(MOST))}}}",
        "".join(f'key{i} = "{"y" * 80}"\n' for i in range(105_000)),
    ],
    ids=["tables", "keys", "list", "inline", "10 MB"],
)
def test_a_text_with_too_many_entries_is_refused_before_it_is_parsed(text, monkeypatch):
    monkeypatch.setattr("tomllib.loads", None)
    with pytest.raises(UnitcadError, match=r"^big: has more than 20,000 keys, tables and list entries$"):
        parse_toml(text, "big")


def test_marks_inside_texts_and_comments_do_not_count():
    long = "=,[" * MOST
    assert parse_toml(f"# {long}\na = \"{long}\"\nb = '''\n{long}'''", "x") == {"a": long, "b": long}


@pytest.mark.parametrize("form", ["{} = 1", "[{}]", "[[{}]]", "x = {{ {} = 1 }}"])
@pytest.mark.parametrize("parts", [500, 5000])
def test_a_dotted_key_of_many_parts_is_refused_on_its_line(form, parts, tmp_path):
    file = tmp_path / "deep.toml"
    file.write_text(f'name = "deep"\n\n{form.format(".".join("a" * parts))}\n')
    with pytest.raises(Refusal, match=r"nests more than 20 tables deep") as refused:
        load(file)
    assert (refused.value.file, refused.value.line) == (str(file), 3)


DEEP = ".".join("a" * 500)
TOO_MUCH = {
    "dotted": (f"x = 1\n{DEEP} = 1", "a.a.a = '...': nests more than 20 tables deep"),
    "quoted": (f'"b.c" . {".".join(["a", chr(34) + "d" + chr(34)] * 12)} = 1', "b.c.a.d = '...': nests more than"),
    "inline": ("x = { " + DEEP + " = 1 }", "a.a.a = '...': nests more than 20 tables deep"),
    "header": (f"[[{DEEP}]]", "a.a.a = '...': nests more than 20 tables deep"),
    "lists": ("x = " + "[" * 22 + "]" * 22, "x.0.0 = '...': nests more than 20 tables deep"),
    "deep lists": ("x = " + "[" * 9999, "big: nests too deeply"),
    "inline tables": ("x = " + "{a = " * 22 + "1" + "}" * 22, "x.a.a = '...': nests more than 20 tables deep"),
    "many headers": ("".join(f"[k{i}.{'.'.join('a' * 15)}]\n" for i in range(9999)), "big: has more than 20,000 keys"),
    "words": ("a " * 200_000, "big: has more than 20,000 keys, tables and list entries"),
    "lines": ("\n" * 2_000_000, "big: has more than 1,000,000 lines"),
    "escapes": ('x = "' + "\\n" * 2_000_000 + '"', "big: has more than 1,000,000 escapes"),
    "key": ("k" * 2000 + " = 1", "big:1: a key or number of more than 1000 characters"),
    "quoted key": (f'x = 1\n"{"k" * 2000}" = 1', "a key has at most 1000 characters"),
    "text": (f"x = '{'y' * (LONGEST_TEXT + 1)}'", "x: a text has at most 8,000,000 characters, not 8,000,001"),
    "digits": ("x = 1" + "0" * 5000, "big:1: a key or number of more than 1000 characters"),
    "float": ("x = 0." + "1" * 4_000_000, "big:1: a key or number of more than 1000 characters"),
    "integer": ("x = 9223372036854775808", "x = 9223372036854775808: is too large for a number here"),
    "hexadecimal": ("y = 1\nx = 0x" + "f" * 900, "x = a number of about 1084 digits: is too large for a number here"),
    "unclosed": ('x = """' + '\\"' * 100_000, "big:1:"),
    "unclosed line": ('x = "' + '\\"' * 100_000, "big:1:"),
    "digits before a fault": ('x = "' + "1" * 200_000 + 'y" z', "big:1:"),
}


@pytest.mark.parametrize("case", TOO_MUCH)
def test_a_toml_text_out_of_bounds_is_refused(case):
    text, said = TOO_MUCH[case]
    with pytest.raises(UnitcadError) as refused:
        parse_toml(text, "big")
    assert said in str(refused.value)
    assert len(str(refused.value)) < 200
    if isinstance(refused.value, Refusal) and case != "quoted key":  # which is no path of a line
        assert refused.value.located.startswith(f"big:{1 + text.count(chr(10))}: ")


@pytest.mark.parametrize(("text", "said"), [
    ("[" * 22 + "]" * 22, "nests more than 20 tables deep"),
    ('{"a":' * 500 + "1" + "}" * 500, "nests more than 20 tables deep"),
    ("[" * 200_000, "nests too deeply"),
    ("[{}]" * 200_000, "has more than 250,000 tables and lists"),
    ("1" * 30, "is too large for a number here"), ("1" * 9999, "not JSON"), ("1e999", "not JSON"), ("NaN", "not JSON"),
    (f'{{"{"k" * 2000}": 1}}', "a key has at most 1000 characters"),
    (f'"{"k" * (LONGEST_TEXT + 1)}"', "a text has at most 8,000,000 characters"),
    ('{"a": 1} {}', "not JSON"), ("", "not JSON"), ("\ufeff{}", "not JSON"), ("\0", "not JSON"),
    (b'"\xff"', "not UTF-8 (byte 1)"),
])  # fmt: skip
def test_json_out_of_bounds_is_refused(text, said):
    with pytest.raises(UnitcadError, match=r"^big: ") as refused:
        parse_json(text, "big")
    assert said in str(refused.value)
    assert len(str(refused.value)) < 200


def test_data_at_its_bounds_is_taken():
    nested = 1
    for _ in range(DEEPEST):
        nested = {"a": [nested]} if isinstance(nested, int) else {"a": nested}
    deepest = "[" * (DEEPEST + 1) + "]" * (DEEPEST + 1)
    assert parse_json(deepest, "x") == json.loads(deepest)
    key, text = "k" * LONGEST_KEY, "y" * LONGEST_TEXT
    taken = {key: text, "numbers": [2**63 - 1, -(2**63 - 1), 1.5, 1e300], "none": None}
    assert parse_json(json.dumps(taken), "x") == taken
    del taken["none"]
    assert parse_toml(f"{key} = '{text}'\nnumbers = {taken['numbers']}", "x") == taken
    long = ", ".join(["1.5"] * (MOST - 2))
    assert len(parse_toml(f"x = [{long}]", "x")["x"]) == MOST - 2


def _cyclic():
    data = {"name": "round", "layers": []}
    data["layers"].append(data)
    return data


def _laughs():
    data = ["ha"] * 10
    for _ in range(15):
        data = [data] * 10
    return {"name": "laughs", "layers": data}


@pytest.mark.parametrize("made", [_cyclic, _laughs])
@pytest.mark.parametrize("call", [
    unitcad.load, unitcad.build, unitcad.estimate, lambda data: unitcad.load("embedded", set={"layers": data}),
    lambda data: unitcad.load({"design": "embedded", "layers": (data,)}), expect_bounded,
])  # fmt: skip
def test_data_of_a_caller_that_is_no_small_tree_is_refused(made, call):
    with pytest.raises(Refusal, match=r"nests more than 20 tables deep|has more than 20,000 keys"):
        call(made())


def test_a_value_is_one_value():
    assert parse_value("[2, 3]") == [2, 3]
    for text in ("1\nother = 2", "x", ""):
        with pytest.raises(UnitcadError):
            parse_value(text)


def test_a_message_is_of_its_kind():
    class Ask(msgspec.Struct, forbid_unknown_fields=True):
        count: int

    assert parse_message(b'{"count": 3}', Ask).count == 3
    for text in ('{"count": "3"}', '{"counts": 3}', "[]", "3", '{"count": 3', '{"count": 9223372036854775808}'):
        with pytest.raises(UnitcadError, match=r"^the message: "):
            parse_message(text, Ask)


PARSERS = {
    "json": {"load", "loads", "JSONDecoder"},
    "msgspec": {"json.decode", "json.Decoder", "msgpack.decode", "msgpack.Decoder", "toml", "yaml"},
    "tomlkit": {"parse", "load", "loads", "value", "TOMLFile"},
    "ast": {"literal_eval"},
    **{key: {""} for key in ("tomllib", "tomli", "toml", "yaml", "orjson", "configparser", "plistlib", "marshal")},
}
"""Names by which a file could parse a document; "": any of the module."""
LAST = {name.rpartition(".")[2] for names in PARSERS.values() for name in names}


def _parses(tree):
    """The names in a file's tree by which it parses TOML, JSON or the like."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            for alias in node.names:
                name = alias.name if isinstance(node, ast.Import) else f"{node.module}.{alias.name}"
                module, _, rest = name.partition(".")
                if "" in PARSERS.get(module, ()) or (rest and rest in PARSERS.get(module, ())):
                    yield name
        elif isinstance(node, ast.Attribute) and node.attr in LAST:
            module, _, rest = ast.unparse(node).partition(".")
            if rest in PARSERS.get(module, ()):
                yield f"{module}.{rest}"


def test_one_module_parses_what_comes_in():
    package = Path(unitcad.__file__).parent
    found = {
        file.relative_to(package).as_posix(): sorted(set(_parses(ast.parse(text))))
        for file in package.rglob("*.py")
        if re.search(
            "json|msgspec|toml|yaml|literal_eval|configparser|plistlib|marshal", text := file.read_text("utf-8")
        )
    }
    found = {file: names for file, names in found.items() if names}
    assert {"tomllib", "json.loads", "tomlkit.parse"} <= set(found.pop("documents.py"))
    assert found.pop("json_text.py") == ["msgspec.json.Decoder"]  # of text that it wrote
    assert found == {}
    for text in (
        "from json import loads",
        "import tomllib as t",
        "from msgspec.json import decode",
        "msgspec.json.decode(x)",
    ):
        assert list(_parses(ast.parse(text))), text


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
