"""A missing or broken OCP: one message, and it tells how to fix it."""

import re
import shlex
import subprocess
import sys
from types import SimpleNamespace

import pytest

import unitcad
from unitcad.errors import UnitcadError
from unitcad.kernels import ocp
from unitcad.validation import load


def test_nothing_installed():
    error = ModuleNotFoundError("No module named 'OCP'", name="OCP")
    text = ocp.advice("OCP", error, {})
    assert text.startswith("OCP is not installed; build without STEP (--formats stl,3mf), or install it: ")
    assert "-m pip install" in text
    assert shlex.split(text)[-1].endswith("[step]")
    error = ModuleNotFoundError("No module named 'cadquery'", name="cadquery")
    assert ocp.advice("cadquery", error, {"cadquery-ocp-novtk": "7.9.3.1.1"}).rstrip("'").endswith("[cadquery]")


@pytest.mark.parametrize(
    ("name", "error", "installed", "said"),
    [
        (  # one of the two wheels is uninstalled: the other's record is there, the files are not
            "OCP",
            ModuleNotFoundError("No module named 'OCP.gp'", name="OCP.gp"),
            {"cadquery-ocp-novtk": "7.9.3.1.1"},
            r"found cadquery-ocp-novtk 7\.9\.3\.1\.1.* --force-reinstall --no-deps cadquery-ocp-novtk==7\.9\.3\.1\.1$",
        ),
        (
            "cadquery",
            ModuleNotFoundError("No module named 'OCP.IVtkOCC'", name="OCP.IVtkOCC"),
            {"cadquery-ocp-novtk": "7.9.3.1.1", "cadquery-ocp": "7.9.3.1.1"},
            r"--no-deps cadquery-ocp==7\.9\.3\.1\.1$",
        ),
        (
            "build123d",
            ImportError("cannot import name 'X' from 'OCP'"),
            {"cadquery-ocp-novtk": "8.0.0"},
            r"found cadquery-ocp-novtk 8\.0\.0.*cadquery-ocp-novtk==7\.9\.3\.1\.1",
        ),
        (
            "OCP",
            ImportError("libGL.so.1: cannot open shared object file: No such file or directory"),
            {"cadquery-ocp": "7.9.3.1.1"},
            "apt-get install libgl1",
        ),
    ],
    ids=["half removed", "without VTK", "wrong version", "library of the system"],
)
def test_a_broken_installation_is_told_how_to_mend(name, error, installed, said):
    assert re.search(said, ocp.advice(name, error, installed), re.DOTALL)


@pytest.mark.parametrize(
    ("kernel", "fault"),
    [
        ("kernels.occt", ""),
        ("kernels.native", "raise ImportError('another version')"),
        ("export.step", "raise AttributeError('gone')"),
    ],
)
def test_a_broken_folder_ocp_becomes_one_error(tmp_path, kernel, fault):
    """An OCP in front of the real one: empty, or failing as it loads."""
    (tmp_path / "OCP").mkdir()
    (tmp_path / "OCP" / "__init__.py").write_text(fault)
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import unitcad.{kernel}"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    last = found.stderr.strip().splitlines()[-1]
    assert last.startswith("unitcad.errors.Missing: ")
    assert "pip install" in last


def test_loading_passes_other_errors_on():
    with pytest.raises(ZeroDivisionError), ocp.loading("OCP"):
        raise ZeroDivisionError
    with pytest.raises(UnitcadError), ocp.loading("OCP"):
        raise ImportError


def test_a_default_build_leaves_step_out_where_no_kernel_is(monkeypatch):
    """The formats asked for stay; only the default knows what is installed."""
    monkeypatch.setattr("unitcad.validation.defaults.find_spec", lambda name: None)
    assert load("embedded").output.formats == ("stl", "3mf")
    assert load("embedded", ["output.formats=['step']"]).output.formats == ("step",)
    monkeypatch.undo()
    assert load("embedded").output.formats == ("step", "stl", "3mf")


def test_show_uses_the_viewer_that_is_installed(monkeypatch):
    shown = []
    viewer = SimpleNamespace(show=lambda *objects, **options: shown.append((objects, options)))
    variant = unitcad.Variant.of("embedded")
    names = list(variant.bodies)
    installed = set()
    monkeypatch.setattr("unitcad.kernels.native.find_spec", lambda name: name in installed or None)
    with pytest.raises(UnitcadError, match=r"no viewer is installed: .* install ocp-vscode"):
        variant.show()
    installed.add("yacv_server")
    monkeypatch.setitem(sys.modules, "yacv_server", viewer)
    variant.show()
    assert shown[0][1] == {"names": [child.label for child in shown[0][0]]}
    assert sorted(shown[0][1]["names"]) == sorted(names)
    installed.add("ocp_vscode")  # before YACV: it has the tree
    monkeypatch.setitem(sys.modules, "ocp_vscode", viewer)
    variant.show()
    (assembly,) = shown[1][0]
    assert [child.label for child in assembly.children] == ["unit", "moulds"]
