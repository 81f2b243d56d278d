"""A custom design: a function in a file that a spec names, from a spec to a shape tree or to several by name."""

from __future__ import annotations

import re
import types
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, get_args

from unitcad.designs.design import Design
from unitcad.designs.dimensions import Dimensions, concentric, wire_exit
from unitcad.errors import UnitcadError
from unitcad.files import names_device
from unitcad.shape import ProfileError, Shape
from unitcad.spec import Spec
from unitcad.spec.custom_code import expect_allowed, function_of

_NAME = re.compile(r"[a-z][a-z0-9-]{0,31}")


def custom(name: str) -> Design:
    """Return the design of that name, "file.py:function": the spec's own text draws its layers."""
    return Design(name=name, about="custom", layers=_layers, dimensions=_dimensions)


def _dimensions(spec: Spec) -> Dimensions:
    height = spec.motor.thickness_mm
    return concentric(spec, height, wire_exit(spec, height))


def _layers(spec: Spec, dims: Dimensions) -> dict[str, Shape]:
    """Return what the spec's function draws, by name: a single tree is "layer1".

    Raises UnitcadError, with the line in the file, where the function raises or returns anything else, and where its
    code is not allowed to run.
    """
    source = spec.design_source or ""
    expect_allowed(spec.design, source)
    function = _function(spec.design, source)
    try:
        made = function(spec)
    except (Exception, SystemExit) as error:
        raise _failed(spec.design, error) from None
    if isinstance(made, get_args(Shape)):
        made = {"layer1": made}
    if not isinstance(made, Mapping) or not made:
        raise UnitcadError(f"design {spec.design}: returns a {type(made).__name__}, not a shape tree or shapes by name")
    for name, shape in made.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise UnitcadError(f"design {spec.design}: {name!r} is no name for a body (a letter, then a-z 0-9 -)")
        if names_device(name):
            raise UnitcadError(f"design {spec.design}: {name!r} is no name for a body: on Windows it is a device")
        if not isinstance(shape, get_args(Shape)):
            raise UnitcadError(f"design {spec.design}: {name} is a {type(shape).__name__}, not a shape tree")
    return dict(made)


@lru_cache(maxsize=16)
def _function(design: str, source: str) -> Any:
    module = types.ModuleType("unitcad_custom_design")
    try:
        exec(compile(source, design.rpartition(":")[0], "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        raise _failed(design, error) from None
    function = module.__dict__.get(function_of(design))
    if not callable(function):
        names = [name for name, value in vars(module).items() if isinstance(value, types.FunctionType)]
        raise UnitcadError(
            f"design {design}: the file has no such function; it has {', '.join(sorted(names)) or 'none'}"
        )
    return function


def _failed(design: str, error: BaseException) -> UnitcadError:
    """Return the error with its line in the design's file."""
    file, line, trace = design.rpartition(":")[0], getattr(error, "lineno", None), error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    where = f" (line {line})" if line else ""
    if isinstance(error, SystemExit):
        text = "ends the program (SystemExit); it must return a shape tree, or raise an error that says what is wrong"
    elif isinstance(error, ProfileError):
        text = str(error)
    else:
        text = f"{type(error).__name__}: {error}" if str(error) else f"{type(error).__name__} without a message"
    return UnitcadError(f"design {design}{where}: {text}")
