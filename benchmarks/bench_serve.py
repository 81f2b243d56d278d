"""The live page: milliseconds from a change to what is shown, in Chromium: unit and section, moulds judged, estimate.

    python benchmarks/bench_serve.py [--changes 40] [--specs encapsulating,three-layer] [--json FILE]

A wall's number is typed; the time ends with the frame after what is shown. Prints the table of docs/serve.md.
Needs the extras `serve` and `test`, and Chromium.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "report"))

import chromium

SHOWN = {"unit": "unit and section", "moulds": "moulds judged", "estimate": "estimate"}
WARM = 5
"""Changes that do not count."""
CHANGE = """async ([path, value]) => {
  const frame = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const { timings } = window.unitcad;
  const before = timings.length;
  const input = document.querySelector(`input[name="${path}"]`);
  const begun = performance.now();
  input.value = String(value);
  input.dispatchEvent(new Event("input"));
  const shown = {};
  while (!("unit" in shown && "moulds" in shown && "estimate" in shown)) {
    await frame();
    for (const one of timings.slice(before)) shown[one.what] ??= performance.now() - begun;
    if (timings.slice(before).some((one) => one.faults)) throw new Error("refused");
  }
  return shown;
}"""


def main() -> None:
    """Measure every spec and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--changes", type=int, default=40, help="of each spec")
    parser.add_argument("--specs", default="single-embedded,embedded,encapsulating,three-layer")
    parser.add_argument("--json", type=Path, metavar="FILE")
    asked = parser.parse_args()
    measured = {}
    with chromium.browser() as running:
        for spec in asked.specs.split(","):
            with tempfile.TemporaryDirectory() as folder, served(spec, Path(folder)) as address:
                measured[spec] = changes(running, address, asked.changes)
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, {asked.changes} changes of each spec, ms\n")
    print("| spec | " + " | ".join(f"{name}: median | 95 %" for name in SHOWN.values()) + " |")
    print("|---|" + "---:|" * (2 * len(SHOWN)))
    for spec, times in measured.items():
        cells = (f"{statistics.median(times[what]):.0f} | {percentile(times[what]):.0f}" for what in SHOWN)
        print(f"| {spec} | " + " | ".join(cells) + " |")
    if asked.json:
        asked.json.write_text(json.dumps(measured, indent=1) + "\n")


def percentile(values: list[float]) -> float:
    """The 95th percentile."""
    return statistics.quantiles(values, n=20, method="inclusive")[-1]


def changes(running: Any, address: str, count: int) -> dict[str, list[float]]:
    """Milliseconds of `count` changes of the first wall, by what is shown."""
    seen = chromium.Visit(running, address)
    seen.page.wait_for_selector("#page[aria-busy=false]", timeout=120_000)
    times: dict[str, list[float]] = {what: [] for what in SHOWN}
    for i in range(count + WARM):
        # No value comes twice: nothing is answered from memory.
        shown = seen.page.evaluate(CHANGE, ["layers.0.wall_mm", round(1.0 + 0.5 * i / (count + WARM), 4)])
        for what in SHOWN:
            times[what] += [shown[what]] if i >= WARM else []
    seen.close()
    return times


@contextlib.contextmanager
def served(spec: str, folder: Path) -> Iterator[str]:
    """The address of a server of a spec."""
    command = [sys.executable, "-P", "-m", "unitcad", "serve", spec, "--no-browser"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        try:
            yield process.stdout.readline().strip()
        finally:
            process.send_signal(signal.SIGINT)


if __name__ == "__main__":
    main()
