"""The heap keeps what is freed: pages that the system cleared are counted, with and without."""

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
