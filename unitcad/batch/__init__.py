"""Many variants from one sweep file, each distinct part made once, on one machine or many."""

from unitcad.batch.batch_records import Summary
from unitcad.batch.run import BatchOptions, run
from unitcad.batch.sweep import Sweep, load_sweep

__all__ = ["BatchOptions", "Summary", "Sweep", "load_sweep", "run"]
