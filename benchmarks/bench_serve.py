"""The live page: milliseconds from a change to what is shown, in Chromium: unit and section, moulds judged, estimate.

    python benchmarks/bench_serve.py [--changes 40] [--specs encapsulating,three-layer] [--json FILE] [--write]

A number is typed: a unit's wall, an array's pitch or margin. The time ends with the frame after what is shown. Beside
it stands the processor time of the answers, which other work on the machine changes little; the load average before and
after says how much there was. `--write` puts the table into docs/how-to/live-page.md. Needs the extras `serve` and
`test`, and Chromium.
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
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "report"))

import chromium

SHOWN = {"unit": "unit and section", "moulds": "moulds judged", "estimate": "estimate"}
NUMBERS = {
    "forearm-pockets": ("layout.pitch_mm", 20.0, 24.0),
    "forearm-patch": ("sheet.margin_mm", 3.0, 5.0),
    "sleeve-curved": ("limb.radius_mm", 40.0, 44.0),
}
"""What is typed, and from where to where, in what is no unit's spec."""
DOCS = Path(__file__).resolve().parents[1] / "docs" / "how-to" / "live-page.md"
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
    for (const one of timings.slice(before)) shown[one.what] ??= [performance.now() - begun, one.processor];
    if (timings.slice(before).some((one) => one.faults)) throw new Error("refused");
  }
  return shown;
}"""


def main() -> None:
    """Measure every spec and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--changes", type=int, default=40, help="of each spec")
    parser.add_argument("--specs", default="embedded,encapsulating,three-layer,forearm-pockets,forearm-patch")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--write", action="store_true", help="the table into docs/how-to/live-page.md")
    asked = parser.parse_args()
    measured, load = {}, os.getloadavg()[0]
    with chromium.browser() as running:
        for spec in asked.specs.split(","):
            with tempfile.TemporaryDirectory() as folder, served(spec, Path(folder)) as address:
                measured[spec] = changes(running, address, spec, asked.changes)
    lines = table(measured, f"{load:.1f} before and {os.getloadavg()[0]:.1f} after", asked.changes)
    print(*lines, sep="\n")
    if asked.write:
        head, mark, rest = DOCS.read_text("utf-8").partition("<!-- computed: latency -->\n")
        written = head + mark + "\n".join(lines) + "\n" + rest[rest.index("<!-- end -->") :]
        DOCS.write_text(written, "utf-8")
    if asked.json:
        asked.json.write_text(json.dumps(measured, indent=1) + "\n")


def table(measured: dict[str, dict[str, list[list[float]]]], load: str, count: int) -> list[str]:
    """Return the lines of the page: milliseconds to what is shown, median and 95th percentile, and of the processor."""
    lines = [
        f"{os.cpu_count()} cores, load average {load}, {count} changes of each spec; "
        "median, 95th percentile, and in brackets the processor's median, in milliseconds:",
        "",
        "| spec | " + " | ".join(SHOWN.values()) + " |",
        "|---|" + "---:|" * len(SHOWN),
    ]
    for spec, times in measured.items():
        cells = []
        for what in SHOWN:
            shown, worked = zip(*times[what], strict=True)
            cells.append(f"{statistics.median(shown):.0f}, {percentile(shown):.0f} ({statistics.median(worked):.0f})")
        lines.append(f"| {spec} | " + " | ".join(cells) + " |")
    return lines


def percentile(values: Sequence[float]) -> float:
    """The 95th percentile."""
    return statistics.quantiles(values, n=20, method="inclusive")[-1]


def changes(running: Any, address: str, spec: str, count: int) -> dict[str, list[list[float]]]:
    """Milliseconds of `count` changes of one number, by what is shown: until it is, and of the processor."""
    path, low, high = NUMBERS.get(spec, ("layers.0.wall_mm", 1.0, 1.5))
    seen = chromium.Visit(running, address)
    seen.page.wait_for_selector("#page[aria-busy=false]", timeout=120_000)
    times: dict[str, list[list[float]]] = {what: [] for what in SHOWN}
    for i in range(count + WARM):
        # No value comes twice: nothing is answered from memory.
        shown = seen.page.evaluate(CHANGE, [path, round(low + (high - low) * i / (count + WARM), 4)])
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
