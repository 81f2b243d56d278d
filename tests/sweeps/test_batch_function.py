"""`unitcad.sweeps.batch` as Python calls it: a short result, and each wrong argument refused in one sentence."""

import inspect

import pytest

from tests.test_public import check_shown
from unitcad.errors import UnitcadError
from unitcad.sweeps import batch


def test_its_result_is_short_and_holds_no_script(tmp_path):
    sweep = tmp_path / "few.toml"
    sweep.write_text('base = "encapsulating"\n[sweep]\ndiameter_mm = [14.0, 15.0]\n')
    check_shown(batch(sweep, tmp_path / "few", only=["estimate"], set={"layers.0.wall_mm": 1.3}))
    assert list(inspect.signature(batch).parameters)[:2] == ["sweep", "out"]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: batch("publishd"), "^sweep = 'publishd': unknown name"),
        (lambda: batch(None), "^sweep: takes a path, not NoneType$"),
        (lambda: batch("published", jobs="2"), "^jobs = '2': must be a whole number"),
        (lambda: batch("published", limit=0), "^limit = 0: must be a whole number from 1 "),
        (lambda: batch("published", jobs=0, timeout=3), "^timeout = 3: only a worker process"),
    ],
)
def test_arguments_of_another_type_are_refused_in_one_sentence(call, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UnitcadError, match=words):
        call()
    assert list(tmp_path.iterdir()) == []
