"""The command that a missing extra's message gives, by the place that the installation came from."""

import json
import re
import shlex
import sys
import tomllib
from importlib import metadata, util
from pathlib import Path
from types import SimpleNamespace

import pytest
from packaging.requirements import Requirement

import unitcad
from unitcad.extras import install_command, install_step

ROOT = Path(__file__).parent.parent


@pytest.fixture
def installed_from(monkeypatch):
    def set_source(source):
        text = None if source is None else json.dumps(source)
        monkeypatch.setattr(metadata, "distribution", lambda name: SimpleNamespace(read_text=lambda file: text))
        return shlex.split(install_command("lab"))

    return set_source


def test_a_clones_command_names_its_folder_and_its_constraints(installed_from, tmp_path):
    folder = tmp_path / "a clone"
    folder.mkdir()
    (folder / "pyproject.toml").touch()
    pip = [sys.executable, "-m", "pip", "install"]
    assert installed_from({"url": folder.as_uri(), "dir_info": {}}) == [*pip, f"{folder}[lab]"]
    (folder / "constraints.txt").touch()
    pip += ["-c", str(folder / "constraints.txt")]
    editable = {"url": folder.as_uri(), "dir_info": {"editable": True}}
    assert installed_from(editable) == [*pip, "-e", f"{folder}[lab]"]


def test_an_address_is_installed_from_again(installed_from):
    vcs = {
        "url": "https://git.example/unitcad",
        "vcs_info": {"vcs": "git", "commit_id": "abc", "requested_revision": "v1"},
    }
    assert installed_from(vcs)[-1] == "unitcad[lab] @ git+https://git.example/unitcad@abc"
    archive = {"url": "https://git.example/unitcad-1.whl", "archive_info": {}}
    assert installed_from(archive)[-1] == "unitcad[lab] @ https://git.example/unitcad-1.whl"


def test_every_command_to_install_comes_from_the_one_function():
    """Messages that spell one fail where the package came from elsewhere."""
    package = Path(unitcad.__file__).parent
    spelled = {
        str(file.relative_to(package))
        for file in package.rglob("*.py")
        if re.search(r"pip[\"', ]+install|in a clone", file.read_text("utf-8"))
    }
    assert spelled == {"extras.py"}


def test_a_folder_that_is_gone_is_a_clone_to_be_found(installed_from, tmp_path):
    gone = {"url": (tmp_path / "gone").as_uri(), "dir_info": {}}
    assert installed_from(gone)[:3] == ["in", "a", "clone,"]
    assert installed_from(gone)[-1] == ".[lab]"


def test_an_environment_without_pip_uses_uv(installed_from, monkeypatch):
    monkeypatch.setattr(util, "find_spec", lambda name: None)
    source = {"url": "https://git.example/unitcad-1.whl", "archive_info": {}}
    command = ["uv", "pip", "install", "--python", sys.executable]
    assert installed_from(source) == [*command, "unitcad[lab] @ https://git.example/unitcad-1.whl"]


MACHINES = {
    ("linux", "x86_64"): True,
    ("linux", "aarch64"): True,
    ("darwin", "arm64"): True,
    ("darwin", "x86_64"): True,
    ("win32", "AMD64"): True,
    ("win32", "ARM64"): False,
    ("win32", "x86"): False,
    ("linux", "armv7l"): False,
    ("linux", "i686"): False,
}


@pytest.mark.parametrize(("where", "has"), MACHINES.items(), ids=str)
def test_readmes_command_installs_on_machines_without_a_step_kernel(where, has, monkeypatch):
    """The extras leave the kernel out there, and a build then says so in place of a command that can't help."""
    system, machine = where
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    kernels = [
        Requirement(line)
        for extra in ("step", "build123d", "cadquery")
        for line in extras[extra]
        if not line.startswith("unitcad")
    ]
    assert len(kernels) == 4
    for kernel in kernels:
        assert kernel.marker.evaluate({"platform_machine": machine, "sys_platform": system}) == has, kernel
    monkeypatch.setattr("platform.machine", lambda: machine)
    assert (install_step() == install_command("step")) == has
    assert has or install_step() == f"it has no wheel for {machine}"
