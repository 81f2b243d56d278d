"""The plain propagator method, to stand beside the solver and be seen to fail: the accuracy suite's."""

from unitcad.accuracy.thomson_haskell import compliance

__all__ = ["compliance"]
