"""The mesh check works without the rest of the package: copied with the few modules that it uses."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

from shapes import CUBE_CORNERS, CUBE_FACES, box, obj, package, stl

import unitcad

PARTS = ("__init__.py", "errors.py", "text.py", "files.py", "workers.py", "geometry", "meshcheck")
LIBRARIES = {"numpy", "scipy", "manifold3d", "msgspec", "typing_extensions"}  # the last one if numpy finds it
CODE = """
import json, sys
started = set(sys.modules)  # a .pth file of the environment may load a library before the first line
from types import SimpleNamespace
from unitcad.meshcheck import Options, manifest
from unitcad.meshcheck.file_checks import check_files
from unitcad.meshcheck.output import FORMATS, render

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


def test_check_needs_only_the_modules_below_it(tmp_path):
    whole, alone = Path(unitcad.__file__).parent, tmp_path / "unitcad"
    alone.mkdir()
    for name in PARTS:
        source = whole / name
        (shutil.copytree if source.is_dir() else shutil.copy)(source, alone / name)
    (tmp_path / "open.stl").write_bytes(stl(box()[2:]))
    (tmp_path / "whole.3mf").write_bytes(package())
    (tmp_path / "thin.obj").write_text(obj(CUBE_CORNERS * [10, 10, 0.2], CUBE_FACES))
    command = [sys.executable, "-c", CODE, "open.stl", "whole.3mf", "thin.obj"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    codes, libraries = json.loads(done.stdout)
    assert codes == [["T001"], [], ["D001"]]
    assert set(libraries) <= LIBRARIES
