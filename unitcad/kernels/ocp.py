"""Loading of OCP, the Python binding of OCCT: a failure becomes one error that tells how to fix it.

Two wheels fill the same folder OCP: cadquery-ocp (with VTK, for cadquery) and cadquery-ocp-novtk (for STEP and
build123d). The one unpacked last overwrites the other, and removing either breaks both. Both of the version below,
installed together, serve both libraries.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import shlex
from collections.abc import Iterator

from unitcad.errors import Missing
from unitcad.extras import install_command, pip_install

WHEEL_VERSION = "7.9.3.1.1"
WHEELS = ("cadquery-ocp", "cadquery-ocp-novtk")


@contextlib.contextmanager
def loading(library: str) -> Iterator[None]:
    """Run the imports of `library` (OCP, build123d or cadquery). Raises Missing if they fail."""
    try:
        yield
    except (ImportError, AttributeError) as error:
        raise Missing(advice(library, error, installed_wheels())) from error


def installed_wheels() -> dict[str, str]:
    """Return the version by name of every installed wheel that fills the folder OCP."""
    versions = {}
    for name in WHEELS:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[name] = importlib.metadata.version(name)
    return versions


def advice(library: str, error: Exception, wheels: dict[str, str]) -> str:
    """Return the advice for an import of `library` that failed with `error`, given the installed OCP wheels."""
    missing = isinstance(error, ModuleNotFoundError) and (error.name or "").split(".")[0] == library
    extra = "step" if library == "OCP" else library
    if missing and (not wheels or library != "OCP"):
        without = "; build without STEP (--formats stl,3mf), or install it" if library == "OCP" else ""
        return f"{library} is not installed{without}: {install_command(extra)}"
    if ".so" in str(error) and "cannot open shared object" in str(error):
        return f"{library} lacks a library of the system: {error}. On Debian: apt-get install libgl1"
    have = ", ".join(f"{name} {version}" for name, version in sorted(wheels.items())) or "no wheel of it"
    wanted = sorted(wheels) or ["cadquery-ocp" if library == "cadquery" else "cadquery-ocp-novtk"]
    if library == "cadquery" and "cadquery-ocp" not in wanted:
        wanted = ["cadquery-ocp", *wanted]
    # cadquery needs the wheel with VTK, which serves build123d as well: it is unpacked last.
    install = shlex.join([*pip_install(), "--force-reinstall", "--no-deps"])
    fix = "; ".join(f"{install} {name}=={WHEEL_VERSION}" for name in reversed(wanted))
    return (
        f"{library} does not load ({type(error).__name__}: {error}). The folder OCP is broken or of another version:"
        f" found {have}. Fix it with: {fix}"
    )
