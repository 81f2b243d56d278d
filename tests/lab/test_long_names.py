"""An error about a recording of many channels names the first ones and counts the others."""

import pytest

from tests.robustness.test_long_lists import MANY, check_error_is_short


def table(name):
    return f"time (s),{','.join(name.format(i) for i in range(MANY))}\n" + f"0.5{',1' * MANY}\n" * 20


CAMPAIGN = """
name = "x"
sensor = { quantity = "displacement", unit = "um" }
unit = [{ name = "u", reference = ["a.csv"], edge = ["b.csv"] }]
"""
FILES = {
    "a.csv": table("channel {} (V)"),
    "b.csv": table("channel {} (V)").replace("0.5,1", "0.5,2"),
    "force.csv": table("Force (N)"),
    "long.csv": "time (s),{} (N)\n0.5,1.5\n1.5,2.5\n".format("x" * 70_000),
    "c.toml": CAMPAIGN,
}


@pytest.mark.parametrize(
    "words",
    [
        ("material", "a.csv", "--like", "ecoflex-00-30"),
        ("material", "force.csv", "--like", "ecoflex-00-30"),
        ("material", "long.csv", "--like", "ecoflex-00-30"),
        ("material", "a.csv", "--like", "ecoflex-00-30", "--column", "strain=foo:%"),
        ("measure", "c.toml"),
    ],
    ids=" ".join,
)
def test_no_error_line_is_long(words, tmp_path):
    check_error_is_short(words, FILES, tmp_path)
