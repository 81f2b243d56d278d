"""Shards of a sweep: each a process of a job array; together the same files as one batch."""

import signal
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import pytest
from batching import bytes_of, calls, environment, made, ring_sweep, rows, started, summary_of, unitcad
from process_trees import until

from unitcad.errors import UnitcadError, WrongArgument
from unitcad.sweeps import load_sweep
from unitcad.sweeps.journal import Journal
from unitcad.sweeps.run import BatchOptions, batch_head
from unitcad.sweeps.shard import Shard, shard_of


def results(out):
    """The bytes of the variants and of the tables; journals and locks are the run's own."""
    return {
        path: sha
        for path, sha in bytes_of(out).items()
        if not path.startswith(("journal", "batch-", "timings", "merge"))
    }


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 1000])
def test_shards_are_the_whole_sweep_in_order(count):
    for of in (1, 3, 16):
        parts = [Shard(number, of).indices(count) for number in range(1, of + 1)]
        assert [index for part in parts for index in part] == list(range(count))
        assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize(
    ("text", "nearest"), [("17/16", "16/16"), ("0/4", "1/4"), ("3", "1/2"), ("-1/4", "1/2"), ("1/0", "1/1")]
)
def test_a_shard_that_is_none(text, nearest):
    with pytest.raises(WrongArgument) as refused:
        shard_of(text)
    assert (refused.value.field, refused.value.value, refused.value.nearest) == ("shard", text, nearest)


def test_shards_in_any_order_are_the_batch_without_shards(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=5), tmp_path / "rings"
    for number, finished in ((3, 4), (1, 7), (2, 10)):
        summary = made(sweep, out, shard=Shard(number, 3))
        assert summary.ok == summary.variants == len(Shard(number, 3).indices(10))
        assert len(rows(out)) == finished  # the tables have the variants of all shards so far
    made(sweep, tmp_path / "plain")
    assert results(out) == results(tmp_path / "plain")
    again = made(sweep, out)
    assert (again.resumed, again.ok) == (10, 10)
    assert results(out) == results(tmp_path / "plain")
    assert made(sweep, out, shard=Shard(2, 3)).resumed == 3


def test_a_batch_makes_the_variants_that_no_shard_has_made(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "fails", materials=2), tmp_path / "rings"
    first = made(sweep, out, shard=Shard(1, 2), keep_going=True)
    assert (first.ok, first.failed) == (2, 2)
    (tmp_path / "s/ring.py").write_text(
        (tmp_path / "s/ring.py").read_text().replace('ValueError("never")', "Exception")
    )
    whole = made(ring_sweep(tmp_path / "s", "fails", materials=2), out, keep_going=True)
    assert (whole.resumed, whole.ok, whole.failed) == (2, 6, 2)
    assert made(sweep, out, shard=Shard(2, 2)).resumed == 4


def test_two_shards_at_once(tmp_path):
    """Processes of their own on one cache: a part that is made twice was in work in both."""
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0, 4.0], materials=2), tmp_path / "rings"
    words = (sweep, "-o", out.parent, "-j", 0, "--shard")
    with ThreadPoolExecutor(2) as pool:
        done = list(pool.map(lambda n: summary_of(*words, f"{n}/2", env=environment()), (1, 2)))
    assert sum(each["ok"] for each in done) == 6
    assert max(Counter(calls(tmp_path / "s")).values()) <= 2
    assert len(list(out.glob("ring-*"))) == len(rows(out)) == 6


def test_a_killed_shard_resumes(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s", "slow", [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]), tmp_path / "rings"
    child, journal = started("batch", sweep, "-o", out.parent, "--shard", "1/2", "-j", 0), out / "journal-1-of-2.jsonl"
    until(lambda: journal.exists() and journal.read_bytes().count(b"\n") > 1)  # its head, one done
    child.send_signal(signal.SIGKILL)
    child.communicate(timeout=30)
    again = summary_of(sweep, "-o", out.parent, "--shard", "1/2", "-j", 0)
    assert again["ok"] == 4
    assert again["taken_up"] >= 1
    assert made(sweep, out).resumed == 4


def test_a_batch_and_a_shard_keep_each_other_out_but_not_two_shards(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s"), tmp_path / "rings"
    head = batch_head(load_sweep(sweep), ("unit",), BatchOptions(("unit",)))
    with Journal(out, head, Shard(1, 2)):
        with Journal(out, head, Shard(2, 2)), Journal(out, head, merge=True):
            pass
        for held in (Shard(1, 2), None):
            with pytest.raises(UnitcadError, match="another batch is running"):
                Journal(out, head, held)
    with Journal(out, head), pytest.raises(UnitcadError, match="another batch is running"):
        Journal(out, head, Shard(1, 2))


def test_shards_of_another_batch_are_refused(tmp_path):
    out = tmp_path / "rings"
    made(ring_sweep(tmp_path / "s"), out, shard=Shard(1, 2))
    with pytest.raises(UnitcadError, match="has another batch"):
        made(ring_sweep(tmp_path / "t", heights=[2.0, 6.0]), out, shard=Shard(2, 2))


def test_estimates_and_pages_take_shards(tmp_path):
    words = ("batch", "published", "-o", tmp_path, "--only", "estimate")
    for number in (1, 2):
        assert unitcad(*words, "--shard", f"{number}/2").returncode == 0
    assert unitcad("report", tmp_path / "published").returncode == 0
    unitcad(*words[:3], tmp_path / "plain", *words[4:])
    for table in ("variants.csv", "batch.json"):
        assert (tmp_path / "published" / table).read_bytes() == (tmp_path / "plain" / "published" / table).read_bytes()
