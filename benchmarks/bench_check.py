"""Speed and memory of the mesh checks beside their peers, interleaved, medians of one run.

    python benchmarks/bench_check.py [--peer /path/to/python-with-pymeshlab] [--sizes 10000,100000,1000000,5000000]

Topology rules against trimesh's is_volume on the same arrays; all rules (topology, self-crossing, shells) against
pymeshlab's compute_selection_by_self_intersections_per_face, which is GPL and runs in an environment of its own
(`--peer`); a whole file by `check_file` beside the admesh command, which knows no crossing; and the peak memory of a
process that judges the file. With `--peer`, an environment that also has meshlib (non-commercial), the crossing test
alone on six shapes, and the whole process `unitcad check FILE` beside one in which MeshLib reads the file and looks for
holes, degenerate faces, edges of more than two faces and crossings.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from meshes import torus, write_stl

from unitcad.accuracy.measurements import timing

PAIRS = (
    ("topology", "trimesh is_volume", " (4 wanted at 1,000,000)"),
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
from unitcad.meshcheck import check_file
def peak():  # of this process alone: a child's ru_maxrss begins at its parent's
    with open("/proc/self/status") as status:
        return int(next(line.split()[1] for line in status if line.startswith("VmHWM"))) // 1024
before = peak()
report = check_file(sys.argv[1])
print(before, peak(), report.verdict)
"""


SHAPES = ("torus", "plate", "gyroid", "scan", "body", "cubes")
CROSSING = """
import sys, time
sys.path.insert(0, {here!r})
import meshes
v, f = getattr(meshes, {shape!r})({size})
def pymeshlab():
    import pymeshlab
    mesh = pymeshlab.MeshSet()
    mesh.add_mesh(pymeshlab.Mesh(v, f))
    return mesh.compute_selection_by_self_intersections_per_face
def meshlib():
    from meshlib import mrmeshnumpy, mrmeshpy
    mesh = mrmeshnumpy.meshFromFacesVerts(f, v)
    return lambda: mrmeshpy.findSelfCollidingTriangles(mrmeshpy.MeshPart(mesh))
for line in sys.stdin:
    work = globals()[line.strip()]()
    start = time.process_time()
    work()
    print(time.process_time() - start, flush=True)
"""


def crossing_test(shape: str, size: int, peer: str, rounds: int) -> str:
    """Processor seconds of the crossing test alone, and of ours over those of pymeshlab and MeshLib, interleaved."""
    import meshes

    from unitcad.meshcheck.geometry import crossings
    from unitcad.meshcheck.geometry.mesh import Mesh
    from unitcad.meshcheck.geometry.topology import topology_of
    from unitcad.meshcheck.rules.f_file import Deadline

    vertices, faces = getattr(meshes, shape)(size)
    found = topology_of(Mesh(vertices, faces), Deadline(600).tick)
    code = CROSSING.format(here=str(Path(__file__).parent), shape=shape, size=size)
    other = subprocess.Popen([peer, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert other.stdin is not None
    assert other.stdout is not None
    times: dict[str, list[float]] = {"ours": [], "pymeshlab": [], "meshlib": []}
    for _ in range(rounds):
        start = time.process_time()
        crossings.crossings_of(found, Deadline(600).tick)
        times["ours"].append(time.process_time() - start)
        for name in ("pymeshlab", "meshlib"):
            other.stdin.write(f"{name}\n")
            other.stdin.flush()
            times[name].append(float(other.stdout.readline() or "nan"))
    other.kill()
    middle = {name: sorted(of)[rounds // 2] for name, of in times.items()}
    ratios = ", ".join(f"{middle['ours'] / middle[name]:.2f} of {name}" for name in ("pymeshlab", "meshlib"))
    return f"crossing test, {shape}, {len(faces)} faces: {middle['ours']:.3f} s, {ratios} (1 wanted)"


WHOLE = """
import sys
from meshlib import mrmeshpy
mesh = mrmeshpy.loadMesh(sys.argv[1])
part = mrmeshpy.MeshPart(mesh)
holes, bad = mesh.topology.findNumHoles(), mrmeshpy.findDegenerateFaces(part, 1e6).count()
bad += mrmeshpy.findMultipleEdges(mesh.topology).size() + mrmeshpy.findSelfCollidingTriangles(part).size()
print(holes, bad)
"""


def whole_process(shape: str, size: int, peer: str, rounds: int, folder: Path) -> str:
    """Wall and processor seconds of the whole command on an STL file, and their ratios to MeshLib's process."""
    import meshes

    vertices, faces = getattr(meshes, shape)(size)
    path = folder / f"{shape}-{size}.stl"
    write_stl(path, vertices, faces)
    commands = {
        "ours": [sys.executable, "-m", "unitcad", "check", str(path)],
        "meshlib": [peer, "-c", WHOLE, str(path)],
    }
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    for _ in range(rounds):
        for name, command in commands.items():
            before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            subprocess.run(command, capture_output=True, check=False)
            wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
            times[name].append((wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime))
    path.unlink()
    (ours, worked), (other, spent) = (
        (statistics.median(wall for wall, _ in of), statistics.median(cpu for _, cpu in of)) for of in times.values()
    )
    return (
        f"whole process, {shape}, {len(faces)} faces: {ours:.3f} s, {ours / other:.2f} of meshlib (1 wanted); "
        f"processor {worked:.3f} s, {worked / spent:.2f} of it"
    )


def timed(work: Callable[[], object]) -> float:
    """Seconds of wall time."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def measure(size: int, peer: str | None, rounds: int, folder: Path) -> list[str]:
    """The lines to print on a torus of about `size` faces."""
    import trimesh

    from unitcad.meshcheck import check_file, check_mesh
    from unitcad.meshcheck.geometry.mesh import Mesh
    from unitcad.meshcheck.geometry.topology import topology_of
    from unitcad.meshcheck.rules.f_file import Deadline

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
        note("topology", timed(lambda: topology_of(Mesh(vertices, faces), Deadline(600).tick)))
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
    parser.add_argument("--peer", help="a python that has pymeshlab, meshlib and manifold3d")
    parser.add_argument("--sizes", default="10000,100000,1000000")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for size in given.sizes.split(","):
            print("\n".join(measure(int(size), given.peer, given.rounds, Path(folder))), flush=True)
            for shape in SHAPES if given.peer else ():
                print(crossing_test(shape, int(size), given.peer, given.rounds), flush=True)
                print(whole_process(shape, int(size), given.peer, given.rounds, Path(folder)), flush=True)


if __name__ == "__main__":
    main()
