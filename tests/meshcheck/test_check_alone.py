"""The mesh check works without the rest of the package: in a folder that holds nothing but the rooms below it."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

from shapes import box, package, stl

import unitcad

BELOW = (
    "__init__.py",
    "arguments.py",
    "errors.py",
    "text.py",
    "files.py",
    "workers.py",
    "geometry",
    "catalogue",
    "meshcheck",
)
CODE = """
import json, sys
from unitcad.catalogue import printers
from unitcad.meshcheck import Options, baseline, check_file, manifest
from unitcad.meshcheck.many_files import check_files
from unitcad.meshcheck.output import FORMATS, render

assert baseline.EMPTY.files == {} and callable(manifest.read)
options = Options(printer=printers()["fdm-0.4"])
reports = list(check_files([(path, options) for path in sys.argv[1:]]))
assert all(render(reports, form) for form in FORMATS)
rooms = {name.split(".")[1] for name in sys.modules if name.startswith("unitcad.")}
print(json.dumps([[[item.code for item in report.findings] for report in reports], sorted(rooms)]))
"""


def test_check_needs_only_the_rooms_below_it(tmp_path: Path) -> None:
    whole, alone = Path(unitcad.__file__).parent, tmp_path / "unitcad"
    alone.mkdir()
    for name in BELOW:
        source = whole / name
        (shutil.copytree if source.is_dir() else shutil.copy)(source, alone / name)
    (tmp_path / "open.stl").write_bytes(stl(box()[2:]))
    (tmp_path / "whole.3mf").write_bytes(package())
    done = subprocess.run(
        [sys.executable, "-c", CODE, "open.stl", "whole.3mf"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    codes, rooms = json.loads(done.stdout)
    assert codes == [["T001"], []]
    assert set(rooms) <= {Path(name).stem for name in BELOW}
