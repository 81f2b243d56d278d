"""Scipy without numpy's developer tools: they are not loaded until they are used, and are whole then."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import sys
from unitcad.lean_import import postpone_tools
postpone_tools()
import scipy.special, scipy.sparse.csgraph
assert {tools} <= sys.modules.keys()
assert not {inner} & sys.modules.keys(), "loaded"
import numpy, numpy.testing
numpy.testing.assert_allclose([1.0], [1.0])
assert numpy.f2py.get_include()
assert {inner} <= sys.modules.keys()
postpone_tools()
assert numpy.testing is sys.modules["numpy.testing"]
"""


def test_numpys_tools_load_when_they_are_used() -> None:
    program = PROGRAM.format(
        tools={"numpy.f2py", "numpy.testing"}, inner={"numpy.f2py.f2py2e", "numpy.testing._private.utils"}
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
