"""What is freed is kept and cycles are sought seldom: cleared pages and searches are counted, with and without."""

from __future__ import annotations

import subprocess
import sys

import pytest

COUNT = """
import ctypes, resource, sys
if not hasattr(ctypes.CDLL(None), "mallopt"):
    sys.exit(77)
import numpy as np
if "keep" in sys.argv:
    from unitcad.heap import keep_freed_memory
    keep_freed_memory()
def go():
    for _ in range(10):
        arrays = [np.ones(1 << 17) for _ in range(20)]
        del arrays
go()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
go()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def _pages(*words: str) -> int:
    done = subprocess.run([sys.executable, "-c", COUNT, *words], capture_output=True, text=True)
    if done.returncode == 77:
        pytest.skip("the C library is not glibc")
    return int(done.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="glibc is Linux's")
def test_memory_that_is_kept_is_not_cleared_again() -> None:
    assert _pages("keep") * 10 < _pages()


def _searches(*before: str) -> int:
    """Return how often Python sought cycles while a build's modules were loaded."""
    lines = (*before, "import gc, unitcad.pipeline.write", "print(gc.get_stats()[0]['collections'])")
    done = subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True)
    return int(done.stdout)


def test_modules_are_seldom_searched_for_cycles_while_they_load() -> None:
    told = ("from unitcad.heap import seek_cycles_seldom", "seek_cycles_seldom()")
    assert _searches(*told) * 5 < _searches()
