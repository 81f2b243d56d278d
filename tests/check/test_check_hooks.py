"""The pre-commit hook and the GitHub Action, as data and by running what they run."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from shapes import box, stl

ROOT = Path(__file__).parent.parent.parent


def _value(text: str, key: str) -> str:
    found = re.search(rf"(?m)^\s*{key}: (.+)$", text)
    assert found is not None
    return found.group(1)


@pytest.mark.parametrize(("name", "wanted"), [
    ("a.stl", True), ("dir/b.STL", True), ("c.3mf", True), ("d.obj", True), ("e.ply", True), ("f.off", True),
    ("g.step", False), ("h.stl.txt", False), ("stl", False), ("i.object", False),
])  # fmt: skip
def test_hook_takes_mesh_files_by_suffix(name: str, wanted: bool) -> None:
    hook = (ROOT / ".pre-commit-hooks.yaml").read_text("utf-8")
    assert bool(re.search(_value(hook, "files"), name)) == wanted
    assert _value(hook, "entry") == "unitcad check"


@pytest.mark.skipif(sys.platform == "win32", reason="the action's script is bash")
@pytest.mark.parametrize(("content", "code"), [(stl(box()), 0), (stl(box()[2:]), 1)])
def test_the_actions_script(content: bytes, code: int, tmp_path: Path) -> None:
    text = (ROOT / "action.yml").read_text("utf-8")
    script = text[text.rindex("run: |") + 6 :]
    (tmp_path / "a b").mkdir()
    (tmp_path / "part.stl").write_bytes(content)
    (tmp_path / "unitcad").write_text(
        f'#!/bin/sh\nexec {sys.executable} -c "from unitcad.cli import main; main()" "$@"\n'
    )
    (tmp_path / "unitcad").chmod(0o755)
    given = {"FILES": "part.stl *.none", "FAIL_ON": "error", "PRINTER": "", "ARGUMENTS": "", "SARIF": "out.sarif"}
    given["FILES"] = "part.stl"
    environment = {**os.environ, **given, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-e", "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    assert ("::error file=part.stl" in done.stdout) == bool(code)
    assert '"version": "2.1.0"' in (tmp_path / "out.sarif").read_text()
    for name in given:
        assert f"{name}: ${{{{ inputs." in text


def test_the_actions_inputs_are_not_pasted_into_its_script() -> None:
    """An input inside `run:` would let a pull request's text become a command."""
    text = (ROOT / "action.yml").read_text("utf-8")
    for script in re.findall(r"run: \|\n(.*)", text, re.DOTALL):
        assert "${{" not in script
