"""Many variants from one sweep file, each distinct part made once, on one machine or many.

`batch("sweep.toml")` runs a sweep from Python; the command line calls `run`.
"""

from unitcad.sweeps.batch_call import BatchResult, batch
from unitcad.sweeps.journal import Summary
from unitcad.sweeps.run import BatchOptions, run
from unitcad.sweeps.sweep import Sweep, load_sweep

__all__ = ["BatchOptions", "BatchResult", "Summary", "Sweep", "batch", "load_sweep", "run"]
