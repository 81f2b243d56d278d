"""The public names of `unitcad.attenuation`: lazy, with an example that runs; its files import in one direction."""

import ast
import doctest
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import unitcad
from unitcad import attenuation
from unitcad.attenuation.layered import medium
from unitcad.attenuation.layered.stack import Stack

PACKAGE = Path(unitcad.__file__).parent


def test_public_names_are_loaded_on_first_use_and_without_cad():
    lines = [
        "import sys, unitcad.attenuation as a",
        "assert 'numpy' not in sys.modules",
        "assert issubclass(a.LayeredMedium, object) and a.Layer and a.HalfSpace and a.Point and a.Response",
        "assert not {'OCP', 'build123d', 'cadquery', 'manifold3d', 'trimesh', 'unitcad.spec'} & set(sys.modules)",
        "assert all(hasattr(a, name) for name in a.__all__) and set(a.__all__) <= set(dir(a))",
    ]
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="Laier"):
        _ = attenuation.Laier


def test_the_example_of_the_docstring_runs():
    assert doctest.testmod(medium).attempted == 6
    assert doctest.testmod(medium).failed == 0


def test_a_stack_with_a_loss_has_it_in_every_body():
    some = attenuation.LayeredMedium(
        [attenuation.Layer(1e-3, 1000, 1e5, 0.4), attenuation.Layer(0.0, 1000, 1e3, 0.4, attenuation.KelvinVoigt(1.0))],
        attenuation.HalfSpace(1000, 1e4, 0.4),
    )
    assert {m.shear.imag / m.shear.real for m in some.with_loss(0.25).materials(785.0)} == {0.25}
    assert isinstance(some, Stack)
    assert some.without_empty_layers().layers == some.layers[:1]


@pytest.mark.parametrize("room", ["attenuation", "accuracy"])
def test_no_file_imports_one_that_imports_it(room: str):
    """Lazy imports and those for types count too."""
    names = {
        ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts): file
        for file in (PACKAGE / room).rglob("*.py")
        if file.name != "__init__.py"
    }
    imports = {name: _imported(file) & set(names) for name, file in names.items()}
    assert len(list(TopologicalSorter(imports).static_order())) == len(names)


def _imported(file: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found
