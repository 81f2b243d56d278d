"""What other programs say of the corpus, written for the tests. Run by hand:

    python benchmarks/check_verdicts.py --lib3mf /path/to/python-with-lib3mf

trimesh runs in this Python; admesh and prusa-slicer are Debian's; lib3mf's wheel has an environment of its own.
A verdict is `pass`, `altered` (read, and changed or found in need of repair), `fail`, `hang` (20 s) or `-` (not read).
"""

import argparse
import json
import re
import subprocess
import tempfile
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"
CORPUS, VERDICTS = TESTS / "corpus", TESTS / "meshcheck" / "peers" / "verdicts.json"
LIB3MF = """
import json, sys
import lib3mf
found = {}
wrapper = lib3mf.get_wrapper()
for path in sys.argv[1:]:
    try:
        model = wrapper.CreateModel()
        reader = model.QueryReader(path.rsplit(".", 1)[1].lower())
        reader.SetStrictModeActive(False)
        reader.ReadFromFile(path)
        items = model.GetMeshObjects()
        good = reader.GetWarningCount() == 0
        while items.MoveNext():
            good = good and items.GetCurrentMeshObject().IsManifoldAndOriented()
        found[path] = "pass" if good else "altered"
    except Exception as error:
        found[path] = "fail"
print(json.dumps(found))
"""


def _run(*command):
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=20, errors="replace", check=False)
    except subprocess.TimeoutExpired:
        return None
    return done.returncode, done.stdout + done.stderr


def trimesh_says(path):
    """`is_volume` of what trimesh loads with its usual processing; its 3MF reader needs further packages."""
    if path.suffix == ".3mf":
        return "-"
    import trimesh

    try:
        loaded = trimesh.load(path)
        meshes = list(loaded.geometry.values()) if isinstance(loaded, trimesh.Scene) else [loaded]
        return "pass" if meshes and all(mesh.is_volume for mesh in meshes) else "fail"
    except Exception:
        return "fail"


def admesh_says(path):
    """Exit code, and whether admesh's own table says that it changed anything."""
    if path.suffix != ".stl":
        return "-"
    done = _run("admesh", str(path))
    if done is None:
        return "hang"
    code, said = done
    if code or "Number of parts" not in said:
        return "fail"
    names = ("Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Backwards edges", "Normals fixed")
    changed = [int(n) for name in names for n in re.findall(rf"{name}\s*:\s*(\d+)", said)]
    return "altered" if any(changed) else "pass"


def slicer_says(path):
    """`prusa-slicer --info`: manifold, and whether it was repaired."""
    done = _run("prusa-slicer", "--info", str(path))
    if done is None:
        return "hang"
    code, said = done
    if code or "manifold" not in said:
        return "fail"
    repaired = re.search(
        r"(open_edges|facets_removed|facets_reversed|degenerate_facets|edges_fixed|backwards_edges) = [1-9]", said
    )
    return "altered" if "manifold = no" in said or repaired else "pass"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lib3mf", required=True)
    given = parser.parse_args()
    paths = sorted([*CORPUS.rglob("*.stl"), *CORPUS.rglob("*.3mf")])
    with tempfile.NamedTemporaryFile("w", suffix=".py") as script:
        script.write(LIB3MF)
        script.flush()
        done = subprocess.run([given.lib3mf, script.name, *map(str, paths)], capture_output=True, text=True, check=True)
    by_lib3mf = json.loads(done.stdout)
    found = {
        path.relative_to(CORPUS).as_posix(): {
            "trimesh": trimesh_says(path),
            "admesh": admesh_says(path),
            "lib3mf": by_lib3mf[str(path)],
            "PrusaSlicer": slicer_says(path),
        }
        for path in paths
    }
    VERDICTS.write_text(json.dumps(found, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
