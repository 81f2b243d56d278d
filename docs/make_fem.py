"""Writes docs/fem.json: the nine units by finite elements, at nominal values and over seeded draws.

python docs/make_fem.py [DRAWS]    about 3 s a draw, 24 levels; tables: explanation/finite-elements.md
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from benchmarks.accuracy.fem_search import as_data, drawn_levels, unit_levels
from unitcad.attenuation.edge.measured import measured_table

FILE = Path(__file__).parent / "fem.json"
SEED, DRAWS, FINENESS = 1, 256, 1.0

if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS
    nominal = np.array([unit_levels(name, None, FINENESS) for name in measured_table().names])
    levels = []
    for one in drawn_levels(SEED, count, FINENESS):
        levels.append(one)
        print(f"draw {len(levels)} of {count}", file=sys.stderr)
        if len(levels) % 16 == 0 or len(levels) == count:  # what is there so far is of use
            data = as_data(SEED, FINENESS, nominal, np.array(levels))
            FILE.write_text(json.dumps(data, separators=(",", ":")) + "\n")
