"""Gang moulds at scale: processor time to judge a plate, and to draw it first, as a ratio to that of a small one.

    python benchmarks/bench_gangs.py [--cells 3,10] [--rounds 5]

Drawing, meshes and all mould checks of plates of 3 x 3 and 10 x 10 cells, by turns, each from an empty cache; medians.
Runs on one core: workers of the mesh kernel that wait for small tasks count as processor time.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time

from unitcad.checks import mould_checks
from unitcad.moulds import mould_set
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import Spec
from unitcad.validation import load

AIM = 3.0
"""Times that of nine cells to judge a hundred."""
JUDGED, DRAWN, BOTH = "all mould checks", "drawing and meshes", "both"
BED = ("moulds.bed_x_mm=1000", "moulds.bed_y_mm=1000")


def main() -> None:
    """Measure both plates and print the ratio with the aim beside it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", default="3,10", help="of a row and a column: the small plate, the large one")
    parser.add_argument("--rounds", type=int, default=5)
    asked = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    small, large = (int(each) for each in asked.cells.split(","))
    specs = {n: load("no-fpcb", (f"moulds.cavities=[{n},{n}]", *BED)) for n in (small, large)}
    judged(specs[small])  # what is loaded once
    times: dict[int, dict[str, list[float]]] = {n: {} for n in specs}
    for _ in range(asked.rounds):
        for n, spec in specs.items():
            for what, seconds in judged(spec).items():
                times[n].setdefault(what, []).append(seconds)
    print(f"| processor time, s | {small**2} cells | {large**2} cells | ratio |\n| --- | --- | --- | --- |")
    medians = {n: {what: statistics.median(each) for what, each in found.items()} for n, found in times.items()}
    for what in medians[small]:
        one, other = medians[small][what], medians[large][what]
        if what in (JUDGED, DRAWN, BOTH) or other > 0.05:
            print(f"| {what} | {one:.3f} | {other:.3f} | {other / max(one, 1e-9):.1f} |")
    ratio = {what: medians[large][what] / medians[small][what] for what in (JUDGED, BOTH)}
    print(
        f"\nTo judge {large**2} cells takes {ratio[JUDGED]:.2f} times as long as {small**2}; "
        f"the aim for 100 over 9 is less than {AIM:g}. With drawing and meshes it is {ratio[BOTH]:.2f} times."
    )


def judged(spec: Spec) -> dict[str, float]:
    """Return the processor time of drawing with meshes, of each check, and of all checks, s."""
    mould_set.forget()
    begun = last = time.process_time()
    seconds: dict[str, float] = {}

    def passed(what: str) -> None:
        nonlocal last
        now = time.process_time()
        seconds[what], last = now - last, now

    moulds = MouldSet(spec)
    for solid in moulds.solids.values():
        solid.num_tri()  # evaluated here, not in the first check that reads it
    passed(DRAWN)
    for code, check in mould_checks().items():
        for finding in check.findings(moulds):
            assert finding.ok, finding
        passed(code)
    both = time.process_time() - begun
    return {JUDGED: both - seconds[DRAWN], DRAWN: seconds[DRAWN], BOTH: both, **seconds}


if __name__ == "__main__":
    main()
