"""The mesh check works without the rest of the package: as the wheel unitcad-check has it, with numpy and manifold3d."""

import importlib.util
import json
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from shapes import CUBE_CORNERS, CUBE_FACES, box, obj, package, stl
from test_check_command import run

import unitcad

ROOT = Path(__file__).parents[2]
WHEEL = ROOT / "packages" / "unitcad-check"
LIBRARIES = {"numpy", "manifold3d", "typing_extensions"}  # the last one if numpy finds it
CODE = """
import json, sys
started = set(sys.modules)  # a .pth file of the environment may load a library before the first line
from types import SimpleNamespace
from unitcad_check.meshcheck import Options, manifest
from unitcad_check.meshcheck.file_checks import check_files
from unitcad_check.meshcheck.output import FORMATS, render

assert callable(manifest.read)
sides = dict.fromkeys(("bed_x_mm", "bed_y_mm", "bed_z_mm"), 200.0)
floors = dict.fromkeys(("least_wall_mm", "least_flat_wall_mm", "least_feature_mm", "layer_mm", "xy_play_mm"), 0.4)
printer = SimpleNamespace(name="own", overhang_deg=45.0, bridge_mm=5.0, support=None, **sides, **floors)
work = [(path, Options(printer=printer)) for path in sys.argv[1:]]
reports = list(check_files(work))
assert list(check_files(work, jobs=2)) == reports
assert all(render(reports, form) for form in FORMATS)
loaded = {name: getattr(module, "__file__", None) or "" for name, module in sys.modules.items() if name not in started}
libraries = {name.partition(".")[0] for name, path in loaded.items() if "site-packages" in path}
print(json.dumps([[[item.code for item in report.findings] for report in reports], sorted(libraries)]))
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """A folder with the wheel's modules and files to check."""
    spec = importlib.util.spec_from_file_location("modules", WHEEL / "modules.py")
    modules = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(modules)
    folder = tmp_path_factory.mktemp("alone")
    modules.write(folder / modules.NAME)
    (folder / "open.stl").write_bytes(stl(box()[2:]))
    (folder / "whole.3mf").write_bytes(package())
    (folder / "thin.obj").write_text(obj(CUBE_CORNERS * [10, 10, 0.2], CUBE_FACES))
    return folder


def test_check_needs_only_the_modules_below_it(alone):
    command = [sys.executable, "-c", CODE, "open.stl", "whole.3mf", "thin.obj"]
    done = subprocess.run(command, cwd=alone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    codes, libraries = json.loads(done.stdout)
    assert codes == [["T001"], [], ["D001"]]
    assert set(libraries) <= LIBRARIES
    left = {path.name for path in alone.rglob("*.py")
            if re.search(r"^ *(import|from) unitcad\b", path.read_text("utf-8"), re.MULTILINE)}  # fmt: skip
    assert left == set()


def _command(*words, cwd):
    code = "from unitcad_check.meshcheck.alone import main; main()"
    return subprocess.run([sys.executable, "-c", code, *words], cwd=cwd, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "words",
    [
        ["open.stl", "whole.3mf", "-j", "2"],
        ["whole.3mf", "--strict", "open.stl", "--quiet"],
        ["open.stl", "--json", "--select", "T", "--select", "G", "--no-strict"],
        ["open.stl", "--ignore", "T001", "--fail-on=warning"],
        ["--diff", "whole.3mf", "open.stl", "--output-format", "markdown"],
        ["open.stl", "--output-format", "sarif"],
        ["--hook", "--ignore", "F", "open.stl"],
        ["--explain", "T001"],
        ["open.stl", "--max-faces", "0"],
        ["open.stl", "--timeout", "soon"],
        ["open.stl", "--output-format", "text2"],
        ["none.stl"],
        ["--select", "Q", "--json", "open.stl"],
    ],
    ids=" ".join,
)
def test_both_command_lines_do_the_same(words, alone):
    one, other = _command(*words, cwd=alone), run(*words, cwd=alone)
    said = [done.stdout.replace("unitcad check --", "unitcad-check --") for done in (one, other)]
    assert (one.returncode, said[0], len(one.stderr.splitlines())) == (
        other.returncode, said[1], len(other.stderr.splitlines())
    )  # fmt: skip
    if "--json" not in words:
        assert one.stderr.replace("unitcad-check", "unitcad check") == other.stderr


def test_the_settings_and_a_baseline_are_read(alone):
    (alone / "unitcad.toml").write_text('[check]\nbaseline = "known.json"\nselect = ["T"]\n')
    try:
        assert _command("open.stl", "--write-baseline", "known.json", cwd=alone).returncode == 0
        assert _command("open.stl", cwd=alone).returncode == 0
        (alone / "unitcad.toml").write_text("[check]\nprinter = 'fdm-0.4'\n")
        done = _command("open.stl", cwd=alone)
        assert (done.returncode, done.stderr) == (
            2, "error: unitcad.toml: check.printer = 'fdm-0.4': needs the package unitcad, which has the printers\n"
        )  # fmt: skip
    finally:
        (alone / "unitcad.toml").unlink()


def test_the_whole_is_needed_for_printers_and_pictures(alone):
    for words in (["--printer", "fdm-0.4"], ["--pictures", "out"]):
        done = _command("open.stl", *words, cwd=alone)
        assert done.returncode == 2
        assert "needs the package unitcad" in done.stderr


def test_a_manifest_is_read(alone):
    part = {"name": "a", "role": "tool", "volume_mm3": 7.0, "files": {"3mf": {"path": "whole.3mf", "sha256": "0" * 64}}}
    (alone / "manifest.json").write_text(json.dumps({"parts": [part]}))
    done = _command("--manifest", ".", cwd=alone)
    assert done.returncode == 1
    assert "M001" in done.stdout


def test_the_wheels_libraries_are_those_of_the_package():
    own, whole = (tomllib.loads((at / "pyproject.toml").read_text("utf-8"))["project"] for at in (WHEEL, ROOT))
    assert set(own["dependencies"]) <= set(whole["dependencies"])
    assert own["requires-python"] == whole["requires-python"]


def test_hatchling_makes_the_wheel(tmp_path, alone):
    from hatchling.builders.wheel import WheelBuilder

    (made,) = WheelBuilder(str(WHEEL)).build(directory=str(tmp_path))
    with zipfile.ZipFile(made) as wheel:
        names = set(wheel.namelist())
        entry = wheel.read(next(name for name in names if name.endswith("entry_points.txt"))).decode()
    there = {path.relative_to(alone).as_posix() for path in (alone / "unitcad_check").rglob("*.py")}
    assert there <= names
    assert Path(made).name.startswith(f"unitcad_check-{unitcad.__version__}-")
    assert "unitcad-check = unitcad_check.meshcheck.alone:main" in entry
