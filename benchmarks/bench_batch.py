"""Batches: how near to the ceiling, two workers against one, memory and cost a variant as the number grows, estimates.

    python benchmarks/bench_batch.py [--rounds 3] [--sizes 100,1000,10000] [--quick] [--json FILE]

Everything is measured in one run, what is compared in turns, medians of the rounds; only the ratios mean anything.

- ceiling: what can't be spared, measured with the same warm workers: making the 20 geometries (their first variants,
  checks on), and linking 1,000 folders (folders and hard links only, split among the workers). The aim stands beside.
- estimates: a loop of single estimates' closed forms beside the table of the same variants, both through the door.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import psutil

from unitcad.cache import usage
from unitcad.sweeps import BatchOptions, estimate_table, run
from unitcad.sweeps.executors import SerialExecutor
from unitcad.sweeps.journal import JournalEntry
from unitcad.sweeps.sweep import Sweep, from_file

SILICONES = ["ecoflex-00-10", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10-medium", "dragon-skin-30"]
GEOMETRIES = 20
ONLY = ("unit", "moulds")
ALL = (*ONLY, "estimate", "casting")
AIM = 0.8
"""Least share of the ceiling that is aimed at."""


def sweep_of(variants: int, geometries: int = GEOMETRIES) -> Sweep:
    """`variants` over `geometries` diameters: silicones and rooms make the rest, geometry runs fastest."""
    each = variants // geometries
    pairs = [(a, b) for a in SILICONES for b in SILICONES]
    cases = [
        {
            "diameter_mm": round(14.0 + 0.1 * geometry, 9),
            "layers.0.material": pairs[i % 25][0],
            "layers.1.material": pairs[i % 25][1],
            "casting.room_c": round(20.0 + 0.01 * (i // 25), 9),
        }
        for i in range(each)
        for geometry in range(geometries)
    ]
    data = {"base": "encapsulating", "set": {"output.formats": ["stl"]}, "sweep": {"mode": "cases", "cases": cases}}
    return from_file(data, Path(), "bench")


def timed(work: Callable[[], Any]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def link_folders(source: str, target: str, first: int, count: int) -> None:
    """Folders and links of `count` variants, as bare as can be."""
    root, files = Path(source), [f for f in Path(source).rglob("*") if f.is_file() and f.suffix in (".stl", ".svg")]
    names = [(str(f), str(f.relative_to(root))) for f in files]
    folders = sorted({str(Path(name).parent) for _, name in names})
    for i in range(first, first + count):
        for folder in folders:
            os.makedirs(f"{target}/{i}/{folder}", exist_ok=True)
        for path, name in names:
            os.link(path, f"{target}/{i}/{name}")


class Bench:
    """Measurements in a scratch folder, each with workers of its own that have been warmed up: nothing of an earlier
    one is left in their memory.
    """

    def __init__(self, scratch: Path, workers: int, only: tuple[str, ...] = ONLY) -> None:
        self.scratch, self.workers, self.only, self.count, self.last = scratch, workers, only, 0, scratch

    def batch(self, sweep: Sweep, cache: Path | None = None) -> float:
        """Seconds of a batch, with a fresh cache if none is given."""
        self.count += 1
        self.last = self.scratch / f"out{self.count}"
        options = BatchOptions(self.only, cache=cache or self.scratch / f"cache{self.count}", cache_mb=1e6)
        with self._warm() as executor:
            start = time.perf_counter()
            summary = run(sweep, self.last, options, executor, workers=self.workers)
            seconds = time.perf_counter() - start
        assert summary.ok == sweep.count, summary.failures
        return seconds

    def link(self, variants: int) -> float:
        """Seconds of linking that many folders like the last batch's first one."""
        from bench_batch import link_folders  # by the name under which a worker finds it

        self.count += 1
        source, target = str(next(self.last.glob("encapsulating-*"))), str(self.scratch / f"links{self.count}")
        share = variants // self.workers
        with self._warm() as executor:
            start = time.perf_counter()
            tasks = [(link_folders, source, target, i * share, share) for i in range(self.workers)]
            for future in [executor.submit(*task) for task in tasks]:
                future.result()
            return time.perf_counter() - start

    @contextlib.contextmanager
    def _warm(self) -> Iterator[ProcessPoolExecutor]:
        with ProcessPoolExecutor(self.workers) as executor:
            for future in [executor.submit(time.sleep, 1.0) for _ in range(self.workers)]:
                future.result()
            yield executor


def ceiling(scratch: Path, rounds: int, variants: int, workers: int, only: tuple[str, ...]) -> dict[str, Any]:
    """Batch against ceiling, in turns, each round with a fresh cache."""
    bench = Bench(scratch, workers, only)
    some, all_ = sweep_of(GEOMETRIES), sweep_of(variants)
    found: dict[str, list[float]] = {"builds": [], "links": [], "batch": [], "ratio": []}
    for _ in range(rounds):
        builds = bench.batch(some)
        links = bench.link(variants)
        batch = bench.batch(all_)
        for name, value in (
            ("builds", builds),
            ("links", links),
            ("batch", batch),
            ("ratio", (builds + links) / batch),
        ):
            found[name].append(value)
        for folder in scratch.iterdir():
            shutil.rmtree(folder)
    return {"variants": variants, "workers": workers, "outputs": list(only), **_medians(found), "aim, at least": AIM}


def two_workers(scratch: Path, rounds: int) -> dict[str, Any]:
    """Distinct geometries with one worker and with two, in turns."""
    one, two, sweep = Bench(scratch / "1", 1), Bench(scratch / "2", 2), sweep_of(GEOMETRIES)
    found: dict[str, list[float]] = {"one": [], "two": [], "ratio": []}
    for _ in range(rounds):
        a, b = one.batch(sweep), two.batch(sweep)
        for name, value in (("one", a), ("two", b), ("ratio", a / b)):
            found[name].append(value)
    return _medians(found)


def growth(scratch: Path, sizes: list[int], workers: int) -> list[dict[str, Any]]:
    """Milliseconds a variant and the parent's memory, everything in the cache, as the number of variants grows."""
    bench, found = Bench(scratch, workers), []
    cache = scratch / "cache"
    bench.batch(sweep_of(sizes[0]), cache)
    for size in sizes:
        sweep = sweep_of(size)
        before = psutil.Process().memory_info().rss
        seconds = bench.batch(sweep, cache)
        after = psutil.Process().memory_info().rss
        found.append(
            {
                "variants": size,
                "ms_a_variant": round(seconds / size * 1e3, 3),
                "parent_mb": round(after / 1e6, 1),
                "grown_mb": round((after - before) / 1e6, 2),
            }
        )
        shutil.rmtree(bench.last)
    return found


class Nothing(Executor):
    """An executor that makes nothing: what is left of a batch is the parent's own work."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        row = {
            "name": "encapsulating",
            "design": "encapsulating",
            "layer1_volume_mm3": 1.0,
            "laws": 44,
            "laws_held": 44,
        }
        future.set_result(
            [JournalEntry(job.index, "ok", folder=f"encapsulating-{job.index:012x}", row=row) for job in args[0].jobs]
        )
        return future


def costs(scratch: Path, variants: int) -> dict[str, Any]:
    """Processor milliseconds: a geometry made, a variant of a geometry that is there, the parent's share of each; bytes
    and files of a variant's own.
    """

    def spent(sweep: Sweep, out: str, executor: Executor, only: tuple[str, ...] = ONLY) -> float:
        start = time.process_time()
        run(
            sweep,
            scratch / out,
            BatchOptions(only, cache=scratch / "cache", cache_mb=1e6),
            executor,
            workers=1,
        )
        return time.process_time() - start

    parent = spent(sweep_of(variants), "a", Nothing()) / variants
    built = spent(sweep_of(GEOMETRIES), "b", SerialExecutor()) / GEOMETRIES
    reused = spent(sweep_of(variants), "c", SerialExecutor()) / variants - parent
    spent(sweep_of(GEOMETRIES), "d", SerialExecutor(), ALL)
    all_reused = spent(sweep_of(variants), "e", SerialExecutor(), ALL) / variants - parent
    own = [_own_files(next((scratch / out).glob("encapsulating-*"))) for out in ("c", "e")]
    store = usage(scratch / "cache")
    return {
        "parent_ms": round(parent * 1e3, 2),
        "geometry_ms": round((built - parent - reused) * 1e3, 1),
        "variant_ms": round(reused * 1e3, 2),
        "variant_ms, all outputs": round(all_reused * 1e3, 2),
        "own": own[0],
        "own, all outputs": own[1],
        "cache_kb_a_geometry": round(store.bytes / GEOMETRIES / 1e3, 1),
    }


def _own_files(folder: Path) -> dict[str, int]:
    files = [f for f in folder.rglob("*") if f.is_file()]
    own = [f for f in files if f.stat().st_nlink == 1]
    blocks = sum(f.stat().st_blocks * 512 for f in own)
    folders = 1 + sum(f.is_dir() for f in folder.rglob("*"))
    return {
        "files": len(own), "bytes": sum(f.stat().st_size for f in own), "on_disk": blocks + 4096 * folders,
        "folders": folders, "links": len(files) - len(own),
    }  # fmt: skip


def estimates(scratch: Path, variants: int) -> dict[str, Any]:
    """Write the table of `variants`; return how many a second."""
    sweep = from_file(
        {
            "base": ["encapsulating", "embedded"],
            "sweep": {
                "layers.0.wall_mm": {"start": 1.0, "stop": 1.6, "num": 10},
                "layers.1.wall_mm": {"start": 1.0, "stop": 1.6, "num": 10},
                "layers.0.material": SILICONES,
                "layers.1.material": SILICONES,
                "estimate.frequency_hz": {"start": 60.0, "stop": 250.0, "num": variants // 5000},
            },
        },
        Path(),
        "estimates",
    )
    seconds = timed(lambda: estimate_table.write_estimates(sweep, scratch / "table", BatchOptions(("estimate",))))
    return {"variants": sweep.count, "variants_a_second": round(sweep.count / seconds)}


def _medians(found: dict[str, list[float]]) -> dict[str, float]:
    return {name: round(statistics.median(values), 3) for name, values in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description="Benchmark of batches")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--variants", type=int, default=1000)
    parser.add_argument("--sizes", default="100,1000,10000")
    parser.add_argument("--estimates", type=int, default=100_000)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    if asked.quick:
        asked.rounds, asked.variants, asked.sizes, asked.estimates = 1, 200, "100,400", 10_000
    result: dict[str, Any] = {}

    def tell(name: str, work: Callable[[Path], Any]) -> None:
        with tempfile.TemporaryDirectory(prefix="unitcad-bench-") as scratch:
            result[name] = work(Path(scratch))
        print(f"{name}: {json.dumps(result[name])}", flush=True)

    tell("ceiling", lambda scratch: ceiling(scratch, asked.rounds, asked.variants, 2, ONLY))
    tell("ceiling, all outputs", lambda s: ceiling(s, asked.rounds, asked.variants, 2, ALL))
    tell("costs", lambda scratch: costs(scratch, asked.variants))
    tell("two workers", lambda scratch: two_workers(scratch, asked.rounds))
    tell("growth", lambda scratch: growth(scratch, [int(size) for size in asked.sizes.split(",")], 2))
    tell("estimates", lambda scratch: estimates(scratch, asked.estimates))
    if asked.json:
        asked.json.write_text(json.dumps(result, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
