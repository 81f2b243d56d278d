"""The line of every key of a TOML text, and the limit of its size."""

import pytest

from unitcad.errors import Refusal, UnitcadError
from unitcad.spec.toml import MOST, line_of, parse_toml
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
    with pytest.raises(Refusal, match="nests more than 20 tables deep") as refused:
        load(file)
    assert (refused.value.file, refused.value.line) == (str(file), 3)
