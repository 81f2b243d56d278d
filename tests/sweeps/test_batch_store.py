"""Results in a store: a folder, and a real S3-compatible server; faults of both; what passes the scheduler."""

import pickle
import re
from collections import Counter
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest
from batching import bytes_of, calls, made, ring_sweep, rows
from batching import unitcad as run_unitcad
from object_store import BUCKET, Faulty, s3_server

from unitcad.cache import MissingContent, SharedStore, digest, shared_store
from unitcad.cache.shared_store import TRIES
from unitcad.errors import UnitcadError
from unitcad.spec import custom_code
from unitcad.sweeps import BatchOptions, batch, load_sweep, record_packs, run
from unitcad.sweeps.batch_call import make
from unitcad.sweeps.executors import SerialExecutor, Workers
from unitcad.sweeps.sweep import from_file
from unitcad.workers import WorkerEnded


@pytest.fixture(scope="module")
def s3():
    pytest.importorskip("s3fs")
    pytest.importorskip("moto")
    with s3_server():
        yield f"s3://{BUCKET}"


@pytest.fixture(params=["folder", "s3"])
def address(request, tmp_path):
    if request.param == "folder":
        return str(tmp_path / "store")
    return f"{request.getfixturevalue('s3')}/{tmp_path.name}"


class Recording(SerialExecutor):
    """Keeps the bytes of each task and its answer, as a scheduler would get them, and how many variants it had."""

    def __init__(self):
        self.passed = []

    def submit(self, fn, /, *args, **kwargs):
        message = pickle.dumps((fn, args, kwargs))
        future = super().submit(*pickle.loads(message)[:1], *pickle.loads(message)[1])
        answer = pickle.dumps(future.result())
        self.passed.append((len(future.result()), len(message) + len(answer)))
        return future


class Dying(SerialExecutor):
    """Loses the answers of the first tasks, which have been done: the worker died between its last put and the row."""

    def __init__(self, deaths):
        self.deaths = deaths

    def submit(self, fn, /, *args, **kwargs):
        done = super().submit(fn, *args, **kwargs)
        if self.deaths:
            self.deaths -= 1
            done = Future()
            done.set_exception(WorkerEnded("the worker died (SIGKILL)"))
        return done


def faulty(monkeypatch, fault):
    """Let stores that are opened from now on have a fault."""
    plain = shared_store.objects_at
    monkeypatch.setattr(shared_store, "objects_at", lambda address: Faulty(plain(address), fault))


def test_a_store_gives_the_bytes_of_a_run_without_one(address, tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=3)
    made(sweep, tmp_path / "plain", cache=tmp_path / "other")
    summary = made(sweep, tmp_path / "out", store=address)
    assert (summary.ok, summary.geometries, summary.reused) == (6, 2, 4)
    assert bytes_of(tmp_path / "out") == bytes_of(tmp_path / "plain")
    assert len(calls(tmp_path / "s")) == 2 * 2  # each geometry once in each batch

    # Another batch finds the geometries in the store; without folders there are rows alone.
    more = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=5)
    summary = made(more, tmp_path / "rows", store=address, folders=False)
    assert (summary.ok, summary.reused) == (10, 10)
    assert len(calls(tmp_path / "s")) == 2 * 2
    assert {path.name for path in (tmp_path / "rows").iterdir() if not path.is_file()} == set()
    # The same batch later, now with folders: nothing is made but they.
    summary = made(more, tmp_path / "rows", store=address, folders=True)
    assert summary.resumed == 10
    made(more, tmp_path / "plain-5", cache=tmp_path / "other")
    assert bytes_of(tmp_path / "rows") == bytes_of(tmp_path / "plain-5")


def test_at_most_two_kilobytes_a_variant_pass_the_scheduler(tmp_path, monkeypatch):
    monkeypatch.setattr(custom_code, "_allowed", set())  # a task names the codes of earlier tests
    silicones = ["ecoflex-00-10", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10-medium", "dragon-skin-30"]
    data = {
        "base": "encapsulating",
        "set": {"output.formats": ["stl"]},
        "sweep": {"layers.0.material": silicones, "estimate.frequency_hz": [80.0, 125.0]},
    }
    executor = Recording()
    options = BatchOptions(("unit", "estimate"), check=False, store=str(tmp_path / "store"), folders=False)
    summary = run(from_file(data, Path(), "few"), tmp_path / "out", options, executor, workers=1)
    assert summary.ok == 10
    assert [variants for variants, _ in executor.passed] == [4, 6]
    # A task of one variant has nothing to share its fixed part with: the most that a variant can cost.
    alone = run(
        from_file({**data, "sweep": {"diameter_mm": [15.0]}}, Path(), "alone"),
        tmp_path / "alone", options, executor, workers=1,
    )  # fmt: skip
    assert alone.ok == 1
    assert [variants for variants, _ in executor.passed[2:]] == [1]
    assert max(size / variants for variants, size in executor.passed) <= 3000


def test_a_put_that_fails_is_tried_again(address, tmp_path, monkeypatch):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2)
    tries = Counter()

    def fault(verb, name, count):
        tries[name] += verb == "put"
        return verb == "put" and tries[name] < (TRIES if "/" in name else 2)

    faulty(monkeypatch, fault)
    assert made(sweep, tmp_path / "out", store=address).ok == 4
    assert len(calls(tmp_path / "s")) == 2
    assert {kind.partition("/")[0] for kind in tries} >= {"content", "entries", "packs"}


def test_a_store_that_takes_no_pack_fails_the_variant_and_loses_none(tmp_path, monkeypatch):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2)
    with monkeypatch.context() as broken:
        faulty(broken, lambda verb, name, count: verb == "put" and name.startswith("packs/"))
        summary = made(sweep, tmp_path / "out", store=str(tmp_path / "store"), keep_going=True)
    assert (summary.ok, summary.failed) == (0, 4)
    assert {row["reason"] for row in rows(tmp_path / "out")} == {"OSError: 503 Slow Down"}
    record_packs.store_at.cache_clear()
    assert made(sweep, tmp_path / "out", store=str(tmp_path / "store")).ok == 4
    assert len(calls(tmp_path / "s")) == 2  # what was made is in the store by then


def test_a_read_that_is_cut_is_read_again_or_refused(address, tmp_path, monkeypatch):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0], materials=5)
    with monkeypatch.context() as broken:
        faulty(broken, lambda verb, name, count: verb == "get" and count % 3 != 0)
        assert made(sweep, tmp_path / "out", store=address).ok == 5
    made(sweep, tmp_path / "plain", cache=tmp_path / "other")
    assert bytes_of(tmp_path / "out") == bytes_of(tmp_path / "plain")

    content = digest((next((tmp_path / "out").glob("ring-*/unit/*.stl"))).read_bytes())
    with monkeypatch.context() as broken:
        faulty(broken, lambda verb, name, count: verb == "get")
        with pytest.raises(MissingContent, match=r"content/../\w+ is not in .*, or damaged there"):
            SharedStore(address).content(content)


def test_damaged_content_is_found_and_made_again(tmp_path):
    sweep, store = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2), tmp_path / "store"
    made(sweep, tmp_path / "plain", cache=tmp_path / "other")
    made(sweep, tmp_path / "out", store=str(store), folders=False)
    content = digest((next((tmp_path / "plain").glob("ring-*/unit/*.stl"))).read_bytes())
    file = store / "content" / content[:2] / content
    file.write_bytes(file.read_bytes()[:-1] + b"!")
    with pytest.raises(UnitcadError, match=r"content/../\w+ is not in .* with --verify makes missing contents again"):
        made(sweep, tmp_path / "out", store=str(store), folders=True, cache=tmp_path / "fresh")
    record_packs.store_at.cache_clear()
    summary = made(sweep, tmp_path / "out", store=str(store), folders=True, verify=True, cache=tmp_path / "fresh")
    assert summary.resumed == 2  # the other height's
    assert bytes_of(tmp_path / "out") == bytes_of(tmp_path / "plain")


def test_a_worker_that_dies_between_put_and_row(address, tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=3)
    summary = made(sweep, tmp_path / "out", Dying(2), store=address)
    assert (summary.ok, summary.failed) == (6, 0)
    assert len(calls(tmp_path / "s")) == 2  # the geometries that it made are found
    made(sweep, tmp_path / "plain", cache=tmp_path / "other")
    assert bytes_of(tmp_path / "out") == bytes_of(tmp_path / "plain")


def test_of_several_writers_the_first_one_wins(address):
    stores = [SharedStore(address) for _ in range(8)]
    for store in stores:
        store.claim()
    for key in ("a" * 64, "b" * 64):
        with ThreadPoolExecutor(8) as pool:
            first = list(pool.map(lambda i, key=key: stores[i].enter(key, {"writer": i}), range(8)))
        assert sum(first) == 1
        assert {store.entry(key)["writer"] for store in stores} == {first.index(True)}


def test_a_damaged_entry_counts_as_absent(tmp_path):
    store = SharedStore(str(tmp_path / "store"))
    store.enter("ab12", {"a": 1})
    file = tmp_path / "store" / "entries" / "ab" / "ab12"
    file.write_bytes(file.read_bytes().replace(b"1}", b"2}"))
    assert store.entry("ab12") is None
    assert store.enter("ab12", {"a": 3})
    assert store.entry("ab12") == {"a": 3}


@pytest.mark.parametrize("path", ["../x", "/tmp/x", "a/../../x", "C:x", "a\\b"])
def test_a_record_names_no_file_outside_its_folder(path, tmp_path):
    from unitcad.pipeline.make import Product

    store = SharedStore(str(tmp_path / "store"))
    manifest = {}
    (place,) = record_packs.pack(store, [Product(manifest, {"manifest.json": b"{}", path: b""}, {})])
    with pytest.raises(UnitcadError, match="names a file outside its folder"):
        record_packs.read_record(store, place)


def test_a_batch_whose_store_is_refused_leaves_nothing(tmp_path):
    (tmp_path / "file").write_text("text")
    for out in ("new", "there"):
        (tmp_path / "there").mkdir(exist_ok=True)
        with pytest.raises(UnitcadError, match="is a file, not a folder"):
            made(ring_sweep(tmp_path), tmp_path / out, store=str(tmp_path / "file"))
    assert not (tmp_path / "new").exists()
    assert not list((tmp_path / "there").iterdir())
    made(ring_sweep(tmp_path), tmp_path / "there", store=str(tmp_path / "store"))
    before = sorted((tmp_path / "there").iterdir())
    with pytest.raises(UnitcadError, match="is a file, not a folder"):
        made(ring_sweep(tmp_path), tmp_path / "there", store=str(tmp_path / "file"))
    assert sorted((tmp_path / "there").iterdir()) == before


@pytest.mark.parametrize(
    ("store", "limit"),
    [
        *((store, "takes a folder, or a bucket of S3 such as s3://bucket/path; nearest accepted: 'store'")
          for store in ("", "s3://", "memory://x", "zip://a.zip", "file:///tmp/x", "gs://b/p", "nonsense://b", "../a://b")),
        ("s3:/bucket/x", "an address begins with s3://; a folder of that name is ./s3:/bucket/x; nearest accepted: "
         "'s3://bucket/x'"),
    ],
)  # fmt: skip
def test_a_store_that_is_neither_a_folder_nor_a_bucket_is_refused(store, limit, tmp_path):
    for more in ((), ("--dry-run",)):
        done = run_unitcad("batch", ring_sweep(tmp_path), "-o", tmp_path / "out", "--store", store, *more)
        assert (done.returncode, done.stdout, done.stderr) == (2, "", f"error: --store = {store!r}: {limit}\n")
    with pytest.raises(UnitcadError, match=re.escape(limit)):
        batch(ring_sweep(tmp_path), tmp_path / "out", only="unit", jobs=0, store=store)
    assert not (tmp_path / "out").exists()


def test_a_table_of_estimates_has_no_folders(tmp_path):
    with pytest.raises(UnitcadError, match="estimates only are one table"):
        make(load_sweep("thickness"), tmp_path / "out", BatchOptions(("estimate",), folders=True), Workers(jobs=0))
    assert not (tmp_path / "out").exists()


def test_a_page_needs_no_folders(tmp_path):
    """--report used to make them against --no-folders, and was refused for estimates alone, which have none."""
    sweep = ring_sweep(tmp_path, heights=[2.0, 3.0])
    made = batch(sweep, tmp_path / "stored", only="unit", jobs=0, report=True, folders=False)
    assert (made.folder / "report.html").is_file()
    assert not list(made.folder.glob("ring-*"))
    made = batch("thickness", tmp_path / "levels", only="estimate", limit=2, report=True)
    assert (made.folder / "report.html").is_file()
    refused = run_unitcad("batch", "thickness", "--only", "estimate", "--folders", "-o", tmp_path / "none")
    assert (refused.returncode, refused.stderr) == (
        2,
        "error: --folders: estimates only are one table: leave it out\n",
    )


class Elsewhere(SerialExecutor):
    """Workers on a machine of their own: what they keep in a folder is not on the disk of this one."""

    def __init__(self, store):
        self.store = store

    def submit(self, fn, /, *args, **kwargs):
        done = super().submit(fn, *args, **kwargs)
        for path in self.store.rglob("*"):
            if path.is_file() and path.name != "unitcad-store":
                path.unlink()
        return done


def test_results_on_the_disk_of_another_machine_are_not_taken_for_kept(tmp_path):
    sweep, store = ring_sweep(tmp_path / "s", heights=[2.0], materials=2), tmp_path / "store"
    options = BatchOptions(("unit",), store=str(store), folders=False)
    with pytest.raises(UnitcadError, match="have a disk of their own; name a store that they and this machine reach"):
        run(load_sweep(sweep), tmp_path / "out", options, Elsewhere(store), workers=1, remote=True)
    assert (tmp_path / "out" / "journal.jsonl").read_text().count("\n") == 1  # its head alone
    assert run(load_sweep(sweep), tmp_path / "out", options, SerialExecutor(), workers=1, remote=True).ok == 2


def test_a_server_that_is_not_there(s3, tmp_path, monkeypatch):
    sweep = ring_sweep(tmp_path / "s")
    with pytest.raises(UnitcadError, match=r"--store s3://elsewhere/x: can't be reached \(.*bucket does not exist"):
        made(sweep, tmp_path / "out", store="s3://elsewhere/x")
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    with pytest.raises(UnitcadError, match=r"can't be reached \(EndpointConnectionError"):
        made(sweep, tmp_path / "out", store=f"{s3}/y")
