"""Shards with a parent each, run at once, stopped, merged; tables as Parquet; folders made when asked for."""

import json
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from batching import bytes_of, calls, environment, ring_sweep, rows, summary_of, unitcad

from unitcad.cache import DiskStore, shared_store
from unitcad.errors import UnitcadError, WrongArgument
from unitcad.report import write_report
from unitcad.report.read_results import read_parquet
from unitcad.sweeps import BatchOptions, load_sweep, record_packs, result_folders, results
from unitcad.sweeps.batch_call import make, merge
from unitcad.sweeps.executors import Workers
from unitcad.sweeps.journal import BatchHead, JournalEntry
from unitcad.sweeps.result_folders import export_variants
from unitcad.sweeps.results import write_results
from unitcad.sweeps.shards import Shard, shard_folders, shard_of


def made(sweep, out, **options):
    record_packs.store_at.cache_clear()
    return make(load_sweep(sweep), out, BatchOptions(("unit",), **options), Workers(jobs=0))


def export_variant(batch, wanted, out, cache="fresh"):
    (folder,) = export_variants(batch, [wanted], out, DiskStore(out.parent / cache))
    return folder


def merged(out, shards=None, **options):
    record_packs.store_at.cache_clear()
    return merge(out, shard_folders(out) if shards is None else shards, BatchOptions(**options))


def both_shards(four):
    sweep, out = four
    for number in (1, 2):
        made(sweep, out, shard=Shard(number, 2))
    return sweep, out


def lose(paths):
    for path in paths:
        if path.is_file():
            path.unlink()
    record_packs.store_at.cache_clear()


def results_of(out, head="ring-"):
    """The bytes of the variants' folders, or of one's."""
    return {path: sha for path, sha in bytes_of(out).items() if path.startswith(head)}


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 1000])
def test_shards_are_the_whole_sweep_in_order(count):
    for of in (1, 3, 16):
        parts = [Shard(number, of).indices(count) for number in range(1, of + 1)]
        assert [index for part in parts for index in part] == list(range(count))
        assert max(map(len, parts)) - min(map(len, parts)) <= 1
    assert [Shard(n, 16).folder for n in (3, 16)] == ["shard-03-of-16", "shard-16-of-16"]


@pytest.mark.parametrize(
    ("text", "nearest"), [("17/16", "16/16"), ("0/4", "1/4"), ("3", "1/2"), ("-1/4", "1/2"), ("1/0", "1/1")]
)
def test_a_shard_that_is_none(text, nearest):
    with pytest.raises(WrongArgument) as refused:
        shard_of(text)
    assert (refused.value.field, refused.value.value, refused.value.nearest) == ("shard", text, nearest)


def test_shards_merged_are_the_batch_without_shards(tmp_path):
    # The geometry runs fastest: every shard has all of them.
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=5)
    text = sweep.read_text().splitlines()
    sweep.write_text("\n".join([*text[:-2], text[-1], text[-2]]) + "\n")
    out = tmp_path / "out"
    for number in (1, 2, 3):
        summary = made(sweep, out, shard=Shard(number, 3))
        assert summary.ok == summary.variants == len(Shard(number, 3).indices(10))
    assert len(calls(tmp_path / "s")) == 2  # each geometry once across shards
    assert [path.name for path in out.iterdir() if path.name != "store"] != []
    assert not list(out.glob("ring-*"))

    summary = merged(out, cache=tmp_path / "fresh")
    assert (summary.ok, summary.failed) == (10, 0)
    made(sweep, tmp_path / "plain", cache=tmp_path / "other")
    joined = {p: sha for p, sha in bytes_of(out).items() if not p.startswith(("store/", "shard-"))}
    assert joined == bytes_of(tmp_path / "plain")

    folder = rows(out)[7]["folder"]
    assert export_variant(out, folder[-12:], tmp_path / "one").name == folder

    # The merged folder is a batch: the same command without --shard has nothing left to do.
    again = made(sweep, out, store=str(out / "store"))
    assert (again.resumed, again.ok) == (10, 10)
    assert made(sweep, out, shard=Shard(2, 3)).resumed == 3


def test_two_shards_at_once(tmp_path):
    """Processes of their own, on one store: what is made twice was in flight in both, so at most once in each."""
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0, 4.0], materials=2), tmp_path / "out"
    words = (sweep, "-o", out, "-j", 0, "--shard")
    with ThreadPoolExecutor(2) as pool:
        done = list(pool.map(lambda n: summary_of(*words, f"{n}/2", env=environment()), (1, 2)))
    assert sum(each["ok"] for each in done) == 6
    assert max(Counter(calls(tmp_path / "s")).values()) <= 2
    assert summary_of("merge", out)["ok"] == 6
    assert len(list(out.glob("ring-*"))) == 6


def test_shards_that_do_not_fit_together(four, tmp_path):
    sweep, out = four

    def refused(folders, why):
        with pytest.raises(UnitcadError, match=why):
            merged(out, folders)

    refused([], "is required: folders of shards")
    made(sweep, out, shard=Shard(1, 2))
    refused(None, "1 of 2 shards is missing: 2/2; run it with")
    refused([out], r"is not a shard of a batch \(no shard.json\)")
    refused([tmp_path / "nowhere"], "nowhere: no such folder")
    with pytest.raises(UnitcadError, match="has shards, which unitcad batch merge joins"):
        made(sweep, out)
    first = out / "shard-1-of-2"
    refused([first, first], "is shard 1/2, as is")
    other = ring_sweep(tmp_path / "t", heights=[2.0, 5.0], materials=2)
    made(other, tmp_path / "others", shard=Shard(2, 2))
    refused([first, tmp_path / "others" / "shard-2-of-2"], "is a shard of another batch than")
    made(sweep, out, shard=Shard(2, 2))
    journal = out / "shard-2-of-2" / "journal.jsonl"
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:-1]))
    refused(None, "1 of 2 variants are not made yet, the first is variant 3")
    assert not (out / "batch.json").exists()
    assert not (out / "journal.jsonl").exists()
    with pytest.raises(UnitcadError, match="shard-2-of-2 is of another batch"):  # another shard in a shard's folder
        made(other, out, shard=Shard(1, 2))


def test_a_shard_is_refused_where_no_merge_could_take_it(four, tmp_path):
    sweep, out = four
    made(sweep, out, shard=Shard(1, 2))
    with pytest.raises(UnitcadError, match=r"has shards of 2 \(shard-1-of-2\).* go on with --shard K/2"):
        made(sweep, out, shard=Shard(3, 3))
    assert [path.name for path in shard_folders(out)] == ["shard-1-of-2"]
    made(ring_sweep(tmp_path / "t", heights=[5.0]), tmp_path / "other")
    with pytest.raises(UnitcadError, match="has another batch"):
        made(sweep, tmp_path / "other", shard=Shard(1, 2))
    assert not shard_folders(tmp_path / "other")
    made(sweep, out, shard=Shard(2, 2))
    merged(out, folders=False)
    assert made(sweep, out, shard=Shard(2, 2)).resumed == 2  # beside the batch that was merged of it


def test_shards_have_one_store(four, tmp_path):
    """Of two stores a merge made a batch that no variant could be exported from."""
    sweep, out = four
    made(sweep, out, shard=Shard(1, 2), store=str(tmp_path / "a"))
    assert made(sweep, out, shard=Shard(1, 2)).resumed == 2
    with pytest.raises(UnitcadError, match=r"shard-1-of-2 has its results in the store .*/a, so this shard"):
        made(sweep, out, shard=Shard(2, 2), store=str(tmp_path / "b"))
    assert made(sweep, out, shard=Shard(2, 2)).ok == 2  # in the first one's
    assert not (out / "store").exists()
    assert merged(out, folders=False).ok == 4
    assert export_variant(out, rows(out)[3]["folder"], tmp_path / "one").is_dir()
    # Where shards were made in several folders there may be several stores all the same.
    made(sweep, tmp_path / "else", shard=Shard(2, 2), store=str(tmp_path / "b"))
    both = [out / "shard-1-of-2", tmp_path / "else" / "shard-2-of-2"]
    with pytest.raises(UnitcadError, match=r"have their results in 2 stores, .* merge with --folders"):
        merged(tmp_path / "all", both, folders=False)
    assert not (tmp_path / "all").exists()
    assert merged(tmp_path / "all", both, cache=tmp_path / "fresh", folders=True).ok == 4
    assert len(list((tmp_path / "all").glob("ring-*"))) == 4


def test_a_batch_goes_on_in_the_store_that_it_has(tmp_path):
    """Without --store it was made again beside itself, and store.json named the old store."""
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0]), tmp_path / "out"
    made(sweep, out, store=str(tmp_path / "a"), folders=False)
    assert made(sweep, out, folders=False).resumed == 2
    assert not (out / "store").exists()
    assert made(sweep, out, store=str(tmp_path / "b"), folders=False).resumed == 0  # asked for
    assert json.loads((out / "store.json").read_text()) == {"store": str(tmp_path / "b")}


def test_a_store_in_which_nobody_may_write_is_refused_at_once(tmp_path, monkeypatch):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0])
    made(sweep, tmp_path / "out", store=str(tmp_path / "a"))
    closed = tmp_path / "a" / "packs"
    asked = shared_store.os.access
    monkeypatch.setattr(shared_store.os, "access", lambda path, mode: path != closed and asked(path, mode))
    with pytest.raises(UnitcadError, match="a/packs can't be read and written here"):
        made(sweep, tmp_path / "other", store=str(tmp_path / "a"))
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize("lost", ["packs", "content", "unitcad-store"])
def test_a_merge_of_what_the_store_has_lost_leaves_nothing_and_names_what_makes_it_again(lost, four, tmp_path):
    _, out = both_shards(four)
    kept = sorted(path for path in (out / "store" / lost).rglob("*") if path.is_file())
    # Not all content: some folders are made before it is missed.
    lose(kept[-1:] if lost == "content" else kept or [out / "store" / lost])
    before = sorted(out.iterdir())
    why = "there is no store" if lost == "unitcad-store" else "--verify makes missing contents again"
    for folders in (True, False) if lost != "content" else (True,):
        with pytest.raises(UnitcadError, match=why):
            merged(out, cache=tmp_path / "fresh", folders=folders)
        assert sorted(out.iterdir()) == before
    if lost == "content":
        lose(kept)
        merged(out, cache=tmp_path / "fresh", folders=False)
        with pytest.raises(UnitcadError, match="the same batch with --verify makes missing contents again"):
            export_variant(out, rows(out)[0]["folder"], tmp_path / "one")


def test_a_merge_takes_no_option_that_it_does_not_read(tmp_path):
    sweep, out = ring_sweep(tmp_path / "s"), tmp_path / "out"
    made(sweep, out, shard=Shard(1, 1))
    for words in (["--dry-run"], ["--limit", 3], ["-j", 2], ["--set", "a=1"], ["--store", "x"], ["--verify"]):
        done = unitcad("batch", "merge", out, *words)
        assert (done.returncode, done.stdout) == (2, "")
        assert "merge takes -o, --folders" in done.stderr
        assert not (out / "journal.jsonl").exists()
    done = unitcad("batch", "merge", out, "--report", "--table", "csv")
    assert done.returncode == 0, done.stderr
    assert "4 of 4 variants joined; 0 failed;" in done.stdout
    assert (out / "report.html").is_file()


def test_without_folders_one_is_made_when_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr(result_folders, "FOLDERS_BELOW", 5)
    sweep, out = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=3), tmp_path / "out"
    made(sweep, out)  # six variants: too many for folders
    assert not list(out.glob("ring-*"))
    made(sweep, tmp_path / "plain", folders=True)
    wanted = rows(out)[4]["folder"]
    assert export_variant(out, wanted[-12:-6], tmp_path / "some") == tmp_path / "some" / wanted
    assert bytes_of(tmp_path / "some") == results_of(tmp_path / "plain", wanted) != {}
    for wrong, words in (("ffffffffffff", "no variant"), ("nonsense", "needs 4 to 12"), ("../x", "needs 4 to 12")):
        with pytest.raises(WrongArgument, match=words):
            export_variant(out, wrong, tmp_path / "some")
    with pytest.raises(UnitcadError, match="is not in a store, its folder is its result"):
        export_variant(tmp_path / "plain", wanted[-12:], tmp_path / "some")
    with pytest.raises(UnitcadError, match="--batch names the folder of a batch"):
        export_variant(tmp_path, wanted[-12:], tmp_path / "some")


def test_folders_asked_for_later_are_made_of_what_is_kept(four, tmp_path):
    sweep, out = four
    made(sweep, out, folders=False, cache=tmp_path / "one")
    before = len(calls(tmp_path / "s"))
    summary = made(sweep, out, folders=True, cache=tmp_path / "two")
    assert (summary.ok, summary.resumed, len(calls(tmp_path / "s"))) == (4, 4, before)
    made(sweep, tmp_path / "plain", folders=True, cache=tmp_path / "one")
    assert results_of(out) == results_of(tmp_path / "plain")
    # What the store has lost is made anew.
    lose((out / "store" / "packs").rglob("*"))
    (out / rows(out)[0]["folder"] / "manifest.json").unlink()
    summary = made(sweep, out, folders=True, cache=tmp_path / "two")
    assert (summary.ok, summary.resumed) == (4, 3)


def test_parquet_has_the_rows_of_the_json(tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=3)
    made(sweep, tmp_path / "out", tables=("json", "parquet"))
    there = read_parquet(tmp_path / "out" / "variants.parquet")["variants"]
    known = [{key: value for key, value in row.items() if value is not None} for row in there]
    assert known == rows(tmp_path / "out")
    schema = parquet.read_schema(tmp_path / "out" / "variants.parquet")
    head = json.loads((tmp_path / "out" / "batch.json").read_text())
    assert json.loads(schema.metadata[b"unitcad"]) == {k: v for k, v in head.items() if k != "variants"}
    assert (str(schema.field("index").type), str(schema.field("layer1_mass_g").type)) == ("int64", "double")
    # By default from MOST_ROWS on, and then alone; the same bytes again.
    monkeypatch.setattr(results, "MOST_ROWS", 6)
    made(sweep, tmp_path / "many")
    tables = [(tmp_path / "many" / name).is_file() for name in ("variants.csv", "batch.json", "variants.parquet")]
    assert tables == [False, False, True]
    pages = [Path(write_report(tmp_path / name)).read_bytes() for name in ("many", "out")]
    assert pages[0].replace(b">many", b">out") == pages[1].replace(b">many", b">out")
    made(sweep, tmp_path / "parts", shard=Shard(1, 2))  # of the whole's table
    assert (tmp_path / "parts" / "shard-1-of-2" / "variants.parquet").is_file()
    assert (tmp_path / "many" / "variants.parquet").read_bytes() == (tmp_path / "out" / "variants.parquet").read_bytes()
    made(sweep, tmp_path / "many", tables=("csv",))
    assert (tmp_path / "many" / "variants.csv").is_file()


def test_a_column_of_several_kinds_is_text(tmp_path):
    pytest.importorskip("pyarrow")
    values = [1, 2.5, None, True, "a", [1, 2], 1 << 70]
    entries = [
        JournalEntry(index=i, status="ok", values={"mixed": v, "number": i + 0.5 * (i % 2)})
        for i, v in enumerate(values)
    ]
    columns = ["index", "status", "reason", "folder", "mixed", "number"]
    write_results(tmp_path, columns, lambda: entries, BatchHead(batch="a", name="b"), None, ("parquet",))
    there = read_parquet(tmp_path / "variants.parquet")["variants"]
    assert [row["mixed"] for row in there] == ["1", "2.5", None, "true", '"a"', "[1, 2]", str(1 << 70)]
    assert [row["number"] for row in there] == [0.0, 1.5, 2.0, 3.5, 4.0, 5.5, 6.0]


def test_without_the_extra_parquet_is_refused_and_tables_are_as_before(tmp_path, monkeypatch):
    monkeypatch.setattr(results, "can_write", lambda: False)
    monkeypatch.setattr(results, "MOST_ROWS", 1)
    head, entries = BatchHead(batch="a", name="b"), [JournalEntry(index=0, status="ok")]
    write_results(tmp_path, ["index"], lambda: entries, head, None, None, 1)
    assert (tmp_path / "variants.csv").read_text() == "index\n0\n"
    with pytest.raises(UnitcadError, match=r"-m pip install .*\[parquet\]"):
        write_results(tmp_path, ["index"], lambda: entries, head, None, ("parquet",), 1)
