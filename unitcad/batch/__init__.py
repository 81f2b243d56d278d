"""Many variants from one sweep file, each distinct part made once, on one machine or many.

`unitcad.batch("sweep.toml")` calls this package: see `unitcad.batch.batch_call.batch`.
"""

import inspect
import sys
from types import ModuleType

from unitcad.batch.batch_call import BatchResult, batch
from unitcad.batch.batch_options import BatchOptions
from unitcad.batch.batch_records import Summary
from unitcad.batch.run import run
from unitcad.batch.sweep import Sweep, load_sweep

__all__ = ["BatchOptions", "BatchResult", "Summary", "Sweep", "load_sweep", "run"]


class _Callable(ModuleType):
    """A package that may be called, so that `unitcad.batch(...)` works beside `from unitcad.batch import ...`."""

    __call__ = staticmethod(batch)


__signature__ = inspect.signature(batch)
sys.modules[__name__].__class__ = _Callable
