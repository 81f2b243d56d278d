"""Speed and memory of the mesh checks beside their peers, interleaved, medians of one run.

    python benchmarks/bench_check.py [--peer /path/to/python-with-pymeshlab] [--sizes 10000,100000,1000000,5000000]

Topology rules against trimesh's is_volume on the same arrays; all rules (topology, self-crossing, shells) against
pymeshlab's compute_selection_by_self_intersections_per_face, which is GPL and runs in an environment of its own
(`--peer`); a whole file by `check_file` beside the admesh command, which knows no crossing; and the peak memory of a
process that judges the file.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from meshes import torus, write_stl

from unitcad.accuracy.timing import timing

PAIRS = (
    ("topology rules", "trimesh is_volume", " (4 wanted at 1,000,000)"),
    ("all rules", "pymeshlab crossing", " (1 wanted)"),
    ("check_file", "admesh", ""),
)
"""Ours, its peer, and what is aimed at: how many times faster ours is."""
PEER = """
import sys, time, json
sys.path.insert(0, {here!r})
import pymeshlab
from meshes import torus
v, f = torus({size})
for line in sys.stdin:
    mesh = pymeshlab.MeshSet()
    mesh.add_mesh(pymeshlab.Mesh(v, f))
    start = time.perf_counter()
    mesh.compute_selection_by_self_intersections_per_face()
    print(time.perf_counter() - start, flush=True)
"""
MEMORY = """
import sys
from unitcad.check import check_file
def peak():  # of this process alone: a child's ru_maxrss begins at its parent's
    with open("/proc/self/status") as status:
        return int(next(line.split()[1] for line in status if line.startswith("VmHWM"))) // 1024
before = peak()
report = check_file(sys.argv[1])
print(before, peak(), report.verdict)
"""


def timed(work: Callable[[], object]) -> float:
    """Seconds of wall time."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def measure(size: int, peer: str | None, rounds: int, folder: Path) -> list[str]:
    """The lines to print on a torus of about `size` faces."""
    import trimesh

    from unitcad.check import check_file, check_mesh, topology
    from unitcad.check.limits import Deadline
    from unitcad.check.mesh import Mesh

    vertices, faces = torus(size)
    path = folder / f"torus-{size}.stl"
    write_stl(path, vertices, faces)
    times: dict[str, list[float]] = {}
    other = None
    if peer:
        code = PEER.format(here=str(Path(__file__).parent), size=size)
        other = subprocess.Popen([peer, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def note(name: str, seconds: float) -> None:
        times.setdefault(name, []).append(seconds)

    for _ in range(rounds):
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        note("trimesh is_volume", timed(lambda mesh=mesh: mesh.is_volume))
        note("topology rules", timed(lambda: topology.judge(Mesh(vertices, faces), Deadline(600))))
        note("all rules", timed(lambda: check_mesh(vertices, faces)))
        if other and other.stdin and other.stdout:
            other.stdin.write("go\n")
            other.stdin.flush()
            note("pymeshlab crossing", float(other.stdout.readline()))
        note("check_file", timed(lambda: check_file(path)))
        if shutil.which("admesh"):
            note("admesh", timed(lambda: subprocess.run(["admesh", str(path)], capture_output=True, check=False)))
    if other:
        other.kill()
    took = {name: timing(of) for name, of in times.items()}
    lines = [f"{len(faces)} faces"]
    lines += [f"  {name:<20} {spent}" for name, spent in took.items()]
    for ours, other, wanted in PAIRS:
        if other in took:
            lines.append(f"  {other} over {ours}: {took[other].median / took[ours].median:.2f} x{wanted}")
    memory = subprocess.run([sys.executable, "-c", MEMORY, str(path)], capture_output=True, text=True, check=True)
    before, peak, verdict = memory.stdout.split()
    return [*lines, f"  check_file takes {peak} MB at most, {before} of it before it reads; verdict {verdict}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", help="a python that has pymeshlab")
    parser.add_argument("--sizes", default="10000,100000,1000000")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for size in given.sizes.split(","):
            print("\n".join(measure(int(size), given.peer, given.rounds, Path(folder))), flush=True)


if __name__ == "__main__":
    main()
