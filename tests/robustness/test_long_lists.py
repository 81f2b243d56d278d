"""An error that lists names from a file names the first ones and counts the others."""

from tests.in_process import unitcad
from unitcad.text import some

MANY = 300


def check_error_is_short(words, files, folder):
    """Check that a command which fails on long lists of names in its files has no long line."""
    for name, text in files.items():
        (folder / name).write_text(text)
    done = unitcad(*words, cwd=folder)
    assert done.returncode == 2
    assert max(map(len, done.stderr.splitlines())) < 500
    assert "more" in done.stderr or "..." in done.stderr


def test_keys_that_are_unknown_give_no_long_line(tmp_path):
    keys = "".join(f"key{i} = 1\n" for i in range(MANY))
    check_error_is_short(("build", "keys.toml"), {"keys.toml": keys}, tmp_path)


def test_a_list_is_cut_with_a_count():
    assert some("abc") == "a, b, c"
    assert some(range(11)) == "0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10"  # not "and 1 more"
    assert some(range(20_000), 3) == "0, 1, 2 and 19997 more"
    assert some(["x" * 70_000]) == "x" * 60 + "..."
