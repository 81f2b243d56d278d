"""unitcad check: the run of a check on the command line, with the catalogue's printers, pictures and progress."""

from __future__ import annotations

import inspect
import sys
from functools import partial
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import typer

from unitcad import catalogue
from unitcad.cli.output import progress
from unitcad.documents import read_toml
from unitcad.errors import Refusal
from unitcad.meshcheck import compare, file_checks
from unitcad.meshcheck.arguments import Arguments, Option
from unitcad.meshcheck.rules.inspection import Options
from unitcad.meshcheck.rules.registry import explain as explanation
from unitcad.meshcheck.run import Tools, run
from unitcad.rooms import expect_none_but, load


def check(**given: Any) -> None:
    """Check mesh files as they are, before any repair.

    Reads STL, 3MF, OBJ, PLY and OFF, and STEP if an extra with a B-rep kernel is installed.
    """
    arguments = Arguments(**given)
    if arguments.explain is not None:
        sys.stdout.write(_explained([part.strip() for part in ",".join(arguments.explain).split(",")]) + "\n")
        return
    if arguments.repair is not None:
        _repair(arguments.files or [], arguments.repair)
        return
    raise typer.Exit(run(arguments, _TOOLS))


def _repair(names: list[str], target: str) -> None:
    """Write a closed copy of a file, and say how far it is from the file. Raises Refusal."""
    if len(names) != 1 or not Path(names[0]).is_file():
        raise Refusal("--repair", target, "takes one mesh file: unitcad check FILE --repair OUT.stl")
    from unitcad.pipeline.repair import repair  # loads manifold3d

    far = repair(Path(names[0]), Path(target), Options())
    sys.stdout.write(f"{target}: closed copy of {names[0]}, at most {far:.3g} mm off its surface\n")


def _signature() -> inspect.Signature:
    """Return the parameters of the command, with help as Typer reads it."""
    parameters = []
    for name, hint in get_type_hints(Arguments, include_extras=True).items():
        kind, option = get_args(hint)
        parameters.append(
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=getattr(Arguments, name),
                annotation=Annotated[kind, _typer(option)],
            )
        )
    return inspect.Signature(parameters, return_annotation=None)


def _typer(option: Option) -> Any:
    if not option.names:
        return typer.Argument(metavar=option.metavar, help=option.help, show_default=False)
    return typer.Option(*option.names, metavar=option.metavar, help=option.help, min=option.least)


check.__signature__ = _signature()  # type: ignore[attr-defined]
check.__annotations__ = {name: one.annotation for name, one in _signature().parameters.items()}


def _pictures(folder: Path) -> tuple[file_checks.Then, compare.Draw]:
    from unitcad.export import finding_pictures  # loads Pillow

    return partial(finding_pictures.write, folder), partial(finding_pictures.versions, folder)


def _expect_mesh(name: str) -> None:
    """Raise Refusal for a TOML file of ours, with the command that takes it."""
    if name.endswith(".toml") and Path(name).is_file():
        expect_none_but("", read_toml(Path(name)), name, "FILE")


_TOOLS = Tools(
    lambda field, name: catalogue.choose(field, name, catalogue.printers()),
    catalogue.printers,
    _pictures,
    _expect_mesh,
    lambda: progress("check"),
)


def _explained(codes: list[str]) -> str:
    """Explain codes; those of mould checks begin with C. Raises Refusal for an unknown one."""
    moulds = [code.upper() for code in codes if code[:1].upper() == "C"]
    meshes = [code for code in codes if code.upper() not in moulds]
    texts = [load("unitcad.checks:explain")(code) for code in moulds]
    return "\n\n".join([*texts, *([explanation(",".join(meshes))] if meshes else [])])
