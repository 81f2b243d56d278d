"""What others put into a batch's folder is not written through, and holds nothing up."""

import contextlib
import os
import signal

import pytest

from unitcad.errors import UnitcadError
from unitcad.sweeps import BatchOptions, load_sweep, run
from unitcad.sweeps.executors import SerialExecutor

pytestmark = pytest.mark.skipif(os.name != "posix", reason="links and pipes as POSIX has them")


@pytest.mark.parametrize("name", ["timings.json", "variants.csv", "batch.json", ".tmp-variants.csv", ".tmp-batch.json"])
def test_a_link_planted_in_a_batchs_folder_is_not_written_through(name, tmp_path):
    sweep, out = load_sweep("thickness"), tmp_path / "out"
    options = BatchOptions(only=("estimate",), limit=1, cache=tmp_path / "cache")
    run(sweep, out, options, SerialExecutor(), workers=1)
    target = tmp_path / "target"
    target.write_text("keep")
    (out / name).unlink(missing_ok=True)
    (out / name).symlink_to(target)
    run(sweep, out, options, SerialExecutor(), workers=1)
    assert target.read_text() == "keep"
    if not name.startswith("."):
        assert (out / name).read_text() != "keep"
        assert not (out / name).is_symlink()


@pytest.mark.parametrize("name", ["journal.jsonl", "batch.json", "batch.lock", "timings.json", "variants.csv"])
@pytest.mark.parametrize("lost", ["nothing", "journal"])
def test_a_pipe_planted_in_a_batchs_folder_holds_nothing_up(name, lost, tmp_path):
    sweep, out = load_sweep("thickness"), tmp_path / "out"
    options = BatchOptions(only=("estimate",), limit=1, cache=tmp_path / "cache")
    run(sweep, out, options, SerialExecutor(), workers=1)
    if lost == "journal":
        (out / "journal.jsonl").unlink()
    (out / name).unlink(missing_ok=True)
    os.mkfifo(out / name)
    signal.alarm(60)
    try:
        with contextlib.suppress(UnitcadError):
            run(sweep, out, options, SerialExecutor(), workers=1)
    finally:
        signal.alarm(0)
