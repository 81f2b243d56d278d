"""The cost of a variant with a store: processor time of parent and worker, requests, bytes, memory.

    python benchmarks/bench_store.py [--variants 1000] [--geometries 5] [--only unit,moulds] [--json FILE]

All in one process, one task after the other, on a store in a folder whose requests are counted. Processor time, so that
other work on the machine does not count. docs/explanation/scaling.md computes large batches from these figures.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import psutil
from bench_nodes import sweep_text

from unitcad.cache import shared_store
from unitcad.sweeps import BatchOptions, load_sweep
from unitcad.sweeps.executors import SerialExecutor
from unitcad.sweeps.run import run


class Counted:
    """Objects whose requests and bytes are counted by verb."""

    def __init__(self, inner: Any, counts: Counter[str]) -> None:
        self.inner, self.counts = inner, counts

    def __getattr__(self, name: str) -> Any:
        method = getattr(self.inner, name)
        if not callable(method):
            return method

        def counted(*args: Any) -> Any:
            self.counts[name] += 1
            if name in ("put", "create"):
                self.counts["bytes " + args[0].partition("/")[0]] += len(args[1])
            return method(*args)

        return counted


class Timed(SerialExecutor):
    """Adds up the processor seconds of tasks that make a geometry, and of the others."""

    def __init__(self) -> None:
        self.making = self.reusing = 0.0
        self.made = self.beside = self.reused = self.tasks = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        start = time.process_time()
        future = super().submit(fn, *args, **kwargs)
        seconds = time.process_time() - start
        done = future.result()
        self.tasks += 1
        if any(outcome.built for outcome in done):
            self.making, self.made = self.making + seconds, self.made + 1
            self.beside += len(done)
        else:
            self.reusing, self.reused = self.reusing + seconds, self.reused + len(done)
        return future


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--variants", type=int, default=1000)
    parser.add_argument("--geometries", type=int, default=5)
    parser.add_argument("--only", default="unit,moulds")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        figures = measured(asked, Path(scratch))
    print(json.dumps(figures, indent=1))
    if asked.json:
        asked.json.write_text(json.dumps(figures, indent=1) + "\n")


def measured(asked: argparse.Namespace, scratch: Path) -> dict[str, Any]:
    (scratch / "sweep.toml").write_text(sweep_text(asked.variants, asked.geometries))
    sweep, counts, executor = load_sweep(scratch / "sweep.toml"), Counter[str](), Timed()
    plain = shared_store.objects_at
    shared_store.objects_at = lambda address: Counted(plain(address), counts)
    only = tuple(asked.only.split(","))
    start, process = time.process_time(), psutil.Process()
    options = BatchOptions(only, store=str(scratch / "store"), folders=False, cache=scratch / "cache")
    summary = run(sweep, scratch / "out", options, executor, workers=1)
    assert summary.ok == summary.variants, summary.failures
    parent = time.process_time() - start - executor.making - executor.reusing
    journal = (scratch / "out" / "journal.jsonl").stat().st_size
    tables = {path.name: path.stat().st_size for path in (scratch / "out").glob("*.*") if path.name != "journal.jsonl"}
    each = executor.reusing / max(1, executor.reused)
    return {
        "variants": asked.variants,
        "geometries": executor.made,
        "tasks": executor.tasks,
        "parent_ms_a_variant": round(1000 * parent / asked.variants, 3),
        "worker_ms_a_variant": round(1000 * each, 3),
        "worker_ms_a_geometry": round(1000 * (executor.making - executor.beside * each) / max(1, executor.made)),
        "memory_mb": round(process.memory_info().rss / 1e6, 1),
        "requests": {verb: count for verb, count in sorted(counts.items()) if not verb.startswith("bytes")},
        "bytes": {kind[6:]: count for kind, count in sorted(counts.items()) if kind.startswith("bytes")},
        "journal_bytes_a_variant": round(journal / asked.variants),
        "tables_bytes": tables,
    }


if __name__ == "__main__":
    main()
