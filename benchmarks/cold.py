"""A first figure: cold processes, interleaved: the whole mesh build beside the bare import of a CAD library.

python benchmarks/cold.py [ROUNDS]
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time

ONLY = ["build", "encapsulating", "--only", "unit,moulds", "--no-check", "--formats", "stl"]


def main(rounds: int) -> None:
    """Print medians and their ratio."""
    with tempfile.TemporaryDirectory() as folder:
        commands = {
            "unitcad build, STL": [sys.executable, "-m", "unitcad", *ONLY, "-o", folder],
            "import cadquery": [sys.executable, "-c", "import cadquery"],
        }
        seconds: dict[str, list[float]] = {name: [] for name in commands}
        for _ in range(rounds + 1):
            for name, command in commands.items():
                start = time.perf_counter()
                subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
                seconds[name].append(time.perf_counter() - start)
    # The first round warms the disk.
    medians = {name: statistics.median(values[1:]) for name, values in seconds.items()}
    for name, values in seconds.items():
        print(f"{name:20} {medians[name]:.3f} s, {min(values[1:]):.3f} to {max(values[1:]):.3f}")
    build, bare = medians.values()
    print(f"ratio {build / bare:.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 9)
