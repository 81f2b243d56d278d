"""An error that lists names from a file names the first ones and counts the others."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from unitcad.text import some

MANY = 3000


def table(name: str) -> str:
    return f"time (s),{','.join(name.format(i) for i in range(MANY))}\n" + f"0.5{',1' * MANY}\n" * 20


CAMPAIGN = """
name = "x"
sensor = { quantity = "displacement", unit = "um" }
unit = [{ name = "u", spec = "encapsulating", reference = ["a.csv"], edge = ["b.csv"] }]
"""
LISTS = "".join(f'"materials.a.k{i}" = {[1.0] * (i + 2)}\n' for i in range(100))
SWEEP = f'base = "encapsulating"\nname = "s"\n[sweep]\nmode = "zip"\n{LISTS}'
FILES = {
    "a.csv": table("channel {} (V)"),
    "b.csv": table("channel {} (V)").replace("0.5,1", "0.5,2"),
    "force.csv": table("Force (N)"),
    "long.csv": "time (s),{} (N)\n0.5,1.5\n1.5,2.5\n".format("x" * 70_000),
    "c.toml": CAMPAIGN,
    "s.toml": SWEEP,
    "keys.toml": "".join(f"key{i} = 1\n" for i in range(MANY)),
}


@pytest.mark.parametrize(
    "words",
    [
        ("material", "a.csv", "--like", "ecoflex-00-30"),
        ("material", "force.csv", "--like", "ecoflex-00-30"),
        ("material", "long.csv", "--like", "ecoflex-00-30"),
        ("material", "a.csv", "--like", "ecoflex-00-30", "--column", "strain=foo:%"),
        ("measure", "c.toml"),
        ("batch", "s.toml", "--dry-run"),
        ("build", "keys.toml"),
    ],
    ids=" ".join,
)
def test_no_error_line_is_long(words: tuple[str, ...], tmp_path: Path) -> None:
    for name in set(FILES) & set(words) | ({"a.csv", "b.csv"} if "measure" in words else set()):
        (tmp_path / name).write_text(FILES[name])
    done = subprocess.run([sys.executable, "-m", "unitcad", *words], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert max(map(len, done.stderr.splitlines())) < 500
    assert "more" in done.stderr or "..." in done.stderr


def test_a_list_is_cut_with_a_count() -> None:
    assert some("abc") == "a, b, c"
    assert some(range(11)) == "0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10"  # not "and 1 more"
    assert some(range(20_000), 3) == "0, 1, 2 and 19997 more"
    assert some(["x" * 70_000]) == "x" * 60 + "..."
