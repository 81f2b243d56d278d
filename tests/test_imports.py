"""The house: imports run downward only, without a circle, and nothing heavy is loaded by what does not need it."""

import ast
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest

import unitcad
from benchmarks.size import ROOMS
from unitcad import designs
from unitcad.designs import shipped
from unitcad.rooms import commands, file_kinds
from unitcad.validation import default_template, templates

PACKAGE = Path(unitcad.__file__).parent
FLOORS = [
    {"accuracy", "arrays", "bodies", "lab", "search", "serve", "sweeps"},
    {"cli"},
    {"api"},
    {"report"},
    {"pipeline"},
    {"casting", "checks", "skin_map"},
    {"moulds", "estimate_inputs"},
    {"validation"},
    {"export"},
    {"attenuation"},
    {"kernels", "cache"},
    {"designs"},
    {"spec"},
    {"shape"},
    {"meshcheck"},
    {"catalogue"},
    {"rooms", "extras", "json_text"},
    {"documents"},
    {"files", "arguments", "hook_words"},
    {"workers"},
    {"errors"},
    {"text", "geometry", "lean_scipy"},
]
LEVEL = {room: level for level, rooms in enumerate(FLOORS) for room in rooms}
LIVE = {Path(importlib.util.find_spec(kind.page).origin or "") for kind in file_kinds() if kind.page}
CAD = ("OCP", "build123d", "cadquery")


@cache
def _tree(file):
    return ast.parse(file.read_text("utf-8"))


def _edges():
    found = set()
    for file in sorted(PACKAGE.rglob("*.py")):
        room = file.relative_to(PACKAGE).parts[0].removesuffix(".py")
        if room in ("__init__", "__main__") or file in LIVE:  # only the live page loads these
            continue
        for node in ast.walk(_tree(file)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module] if node.module != "unitcad" else [f"unitcad.{a.name}" for a in node.names]
            for name in names:
                parts = name.split(".")
                if parts[0] == "unitcad" and len(parts) > 1 and parts[1] != room and parts[1] != "__version__":
                    found.add((room, parts[1], str(file.relative_to(PACKAGE))))
    return found


def test_imports_run_downward_only():
    upward = [edge for edge in _edges() if LEVEL[edge[0]] >= LEVEL[edge[1]]]
    assert upward == []


def test_attenuation_and_check_know_nothing_of_cad():
    for room, below, file in _edges():
        if room == "attenuation":
            known = (
                "arguments",
                "catalogue",
                "workers",
                "documents",
                "json_text",
                "extras",
                "files",
                "geometry",
                "text",
                "errors",
                "lean_scipy",
            )
            assert below in known, f"{file} imports {below}"
        if room == "meshcheck":  # usable alone
            known = ("workers", "files", "geometry", "text", "errors", "documents", "extras", "hook_words")
            assert below in known, f"{file} imports {below}"


def _file_imports(folder):
    """The files below `folder` and those of them that each imports, at its top or within a function, for types too."""
    names = {file: file.relative_to(PACKAGE).as_posix() for file in folder.rglob("*.py")}
    modules = {f"unitcad.{name[:-3].replace('/', '.')}".removesuffix(".__init__"): name for name in names.values()}
    graph = {}
    for file in names:
        wanted = set()
        for node in ast.walk(_tree(file)):
            if isinstance(node, ast.Import):
                wanted |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                whole = {alias.name: f"{node.module}.{alias.name}" for alias in node.names}
                wanted |= {name if name in modules else node.module for name in whole.values()}
        graph[names[file]] = {modules[name] for name in wanted if name in modules}
    return graph


def _circles(graph):
    """What is left of a graph once all that import nothing, or that nothing imports, are taken away again and again."""
    left, before = dict(graph), None
    while left != before:
        before, imported = left, set().union(*left.values())
        kept = {file: below & left.keys() for file, below in left.items() if file in imported}
        left = {file: below for file, below in kept.items() if below}
    return left


def test_a_test_that_imports_a_room_lies_in_the_room_s_folder():
    """The others are the core's, but for tests/whole, on pages and commands of several rooms; .ci/core runs them."""
    tests = Path(__file__).parent
    imports = re.compile(rf"^\s*(?:from|import) unitcad\.({'|'.join(ROOMS)})\b", re.MULTILINE)
    found = {
        file.relative_to(tests).as_posix(): imports.findall(file.read_text("utf-8")) for file in tests.rglob("*.py")
    }
    apart = (*(f"{room}/" for room in ROOMS), "whole/", "attenuation/references/")
    assert {name: rooms for name, rooms in found.items() if rooms and not name.startswith(apart)} == {}


def test_no_files_import_each_other_in_a_circle():
    graph = _file_imports(PACKAGE)
    assert len(graph) > 150
    assert graph.keys() >= set().union(*graph.values()) != set()
    del graph["__init__.py"]  # it loads its names on first use, and holds the version
    assert _circles(graph) == {}


def test_the_rooms_of_check_import_one_way():
    """Geometry knows no rules, rules know no files; neither rules, readers nor outputs know what runs them."""
    floors = [
        {"alone"},
        {"run"},
        {"manifest", "compare"},
        {"file_checks"},
        {"builds"},
        {"readers", "output", "baseline"},
        {"rules"},
        {"findings"},
        {"geometry", "arguments", "settings"},
    ]
    level = {room: level for level, rooms in enumerate(floors) for room in rooms}
    for file, below in _file_imports(PACKAGE / "meshcheck").items():
        room = file.split("/")[1].removesuffix(".py")
        for other in {name.split("/")[1].removesuffix(".py") for name in below} - {room, "__init__"}:
            assert room == "__init__" or level[room] < level[other], f"{file} imports {other}"


def _decisions_by_design(file):
    """The places where a file compares something with the name of a shipped design, or keeps a table of such names."""
    found = []
    for node in ast.walk(_tree(file)):
        if isinstance(node, ast.Compare):
            asked = [node.left, *node.comparators]
        elif isinstance(node, ast.Dict):
            asked = [key for key in node.keys if key]
        elif isinstance(node, ast.MatchValue):
            asked = [node.value]
        else:
            continue
        words = [part.value for one in asked for part in ast.walk(one) if isinstance(part, ast.Constant)]
        found += [f"{file.name}:{node.lineno}: {word}" for word in words if word in shipped()]
    return found


def test_no_code_decides_by_the_name_of_a_design():
    """A file that needs to know reads the design's `Design`; words and comments may use any name."""
    modules = [import_module(f"unitcad.designs.{module.name}") for module in iter_modules(designs.__path__)]
    own = {Path(module.__file__) for module in modules if hasattr(module, "DESIGN")}
    assert len(own) == len(shipped()) > 0
    assert [found for file in sorted({*PACKAGE.rglob("*.py")} - own) for found in _decisions_by_design(file)] == []


def test_every_design_has_a_template_and_one_is_the_default():
    assert templates().keys() >= shipped().keys()
    assert [name for name, design in shipped().items() if design.default] == [default_template()]


def test_no_piece_is_recognised_by_its_name():
    kinds = ("base", "cup", "lid", "tongue", "filament", "blade", "layer", "wire", "motor")
    found = []
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(_tree(file)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "startswith":
                words = [n.value for n in ast.walk(node) if isinstance(n, ast.Constant)]
                found += [f"{file.name}:{node.lineno}" for word in words if word in kinds]
    assert found == []


NOT_OF_AN_ESTIMATE = (
    "scipy.optimize", "scipy.linalg", "trimesh", "rich", "manifold3d", "unitcad.moulds", "unitcad.meshcheck",
    "unitcad.attenuation.edge.scoring", "unitcad.skin_map", "unitcad.attenuation.radial", "PIL",
)  # fmt: skip
"""Its lines need numpy, scipy.special and the stored scores: no tools, no mesh rules, no fits, no tables, no map."""


@pytest.mark.parametrize(
    "run",
    [
        ["--help"],
        ["list", "materials"],
        ["build", "encapsulating", "--formats", "stl"],
        ["estimate", "encapsulating"],
        ["check", "unit.stl"],
    ],
    ids=lambda run: run[0],
)
def test_nothing_needless_is_loaded(run, tmp_path):
    needless = (*CAD, "skfem", "matplotlib", *(f"unitcad.{room}" for room in ROOMS))
    needless += {"estimate": NOT_OF_AN_ESTIMATE, "check": ("scipy", "trimesh")}.get(run[0], ())
    corners = ["0 0 0", "9 0 0", "0 9 0", "0 0 9"]
    facets = [
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {corners[k]}\n" for k in face) + "endloop\nendfacet\n"
        for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    ]
    (tmp_path / "unit.stl").write_text(f"solid tetrahedron\n{''.join(facets)}endsolid\n")
    (tmp_path / "pyproject.toml").write_text("[tool.other]\n")
    code = "from unitcad.cli import main\ntry:\n    main()\nexcept SystemExit:\n    pass"
    code = f"import sys\n{code}\nprint([n for n in {needless} if n in sys.modules], file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code, *run], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1] == "[]", done.stderr


def test_importing_reads_no_file_of_ours():
    code = (
        "import sys, builtins, io\n"
        "opened = []\n"
        "sys.addaudithook(lambda e, a: opened.append(str(a[0])) if e == 'open' else None)\n"
        "import unitcad, unitcad.catalogue, unitcad.spec\n"
        "print([f for f in opened if f.endswith('.toml')])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


FIVE_COMMANDS = """
import sys
from contextlib import redirect_stdout
from glob import glob
from io import StringIO
from unitcad.cli.command_line import run

def each():
    yield ["--help"]
    print("=====")
    yield ["init", "mine", "--template", "embedded"]
    yield ["estimate", "mine.toml"]
    if sys.argv[1:]:
        yield ["build", "mine.toml", "--formats", "stl,svg", "--report", "-o", "."]
        yield ["check", *glob("mine-*/moulds")]
    with redirect_stdout(StringIO()) as listed:
        yield ["list"]
    yield from (["list", kind] for kind in listed.getvalue().split())

for words in each():
    assert run(words) == 0, words
"""


@pytest.mark.parametrize("gone", [*({room} for room in ROOMS), set(ROOMS)], ids=lambda gone: "-".join(sorted(gone)))
def test_a_room_can_be_deleted(gone, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(PACKAGE, copy / "unitcad", ignore=shutil.ignore_patterns("*.pyc.*", *gone))
    shutil.copytree(templates()["embedded"].parent, copy / "templates")

    done = subprocess.run(
        [sys.executable, "-c", FIVE_COMMANDS, *(["build"] if gone == {*ROOMS} else [])],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(copy)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert bool(list(tmp_path.glob("mine-*/report.html"))) == (gone == {*ROOMS})
    named = {name: command.run.split(".")[1] for name, command in commands().items()}
    told = re.findall(r"^  ([a-z-]+)  ", done.stdout.partition("Make:")[2].partition("=====")[0], re.MULTILINE)
    assert sorted(told) == sorted(name for name, room in named.items() if room not in gone)


def test_the_core_needs_no_extra():
    """Every public name, and the module of every command, loads without the packages of the extras."""
    extras = ("build123d", "cadquery", "OCP", "skfem", "threadpoolctl", "libdlf", "pyuff", "nptdms", "h5py", "ezdxf")
    extras += ("starlette", "uvicorn", "tomlkit", "distributed", "dask", "obstore", "pyarrow")
    code = (
        f"import sys\nfor name in {extras}: sys.modules[name] = None\n"
        "import unitcad\nfrom unitcad.rooms import commands, load\n"
        "for name in unitcad.__all__: getattr(unitcad, name)\n"
        "for command in commands().values(): load(command.run)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
