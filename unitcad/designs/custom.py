"""A custom design: a `Design`, or a function from a spec to its cast layers, in a file that a spec names."""

from __future__ import annotations

import re
import types
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, get_args

from unitcad.designs.design import Design, Tooling
from unitcad.designs.dimensions import Dimensions, concentric, wire_exit
from unitcad.errors import Refusal, UnitcadError
from unitcad.files import names_device
from unitcad.shape import ProfileError, Shape, cut
from unitcad.spec import Spec
from unitcad.spec.custom_code import is_allowed, is_body_file, name_in_file
from unitcad.text import some

_NAME = re.compile(r"[a-z][a-z0-9-]{0,31}")


def custom(name: str, source: str) -> Design:
    """Return the design of that name, "file.py:NAME", in the text of its file.

    Raises UnitcadError, with the line in the file, for a text that can't run and for a NAME that is nothing of the
    kind. Code that is not allowed to run is not run: such a design has defaults, and refuses to draw its layers.
    """
    if is_body_file(name):
        return Design(name, "bodies of a file", layers=lambda *_: _of_file(name, source), dimensions=_dimensions)
    if is_allowed(name, source):
        return _design(name, source)

    def refuse(spec: Spec, dims: Dimensions) -> dict[str, Shape]:
        raise UnitcadError(f"design {name}: this command runs its code only with --allow-code; read it first")

    return Design(name=name, about="custom", layers=refuse, dimensions=_dimensions)


@lru_cache(maxsize=16)
def _design(name: str, source: str) -> Design:
    """Return the text's value of this name, each of its functions with errors that name the line."""
    held = _run(name, source)
    if isinstance(held, Design):
        design = replace(held, name=name)
    elif callable(held):

        def layers(spec: Spec, dims: Dimensions) -> Mapping[str, Shape]:
            made: Any = held(spec)
            return {"layer1": made} if isinstance(made, get_args(Shape)) else made

        design = Design(name=name, about="custom", layers=layers, dimensions=_dimensions)
    else:
        raise UnitcadError(f"design {name}: is a {type(held).__name__}, not a function or a Design")
    _check_values(design)
    functions = {field: getattr(design, field) for field in _EXPECTED if callable(getattr(design, field))}
    return replace(design, **{field: _with_checks(name, field, function) for field, function in functions.items()})


def _run(name: str, source: str) -> Any:
    """Run the text and return its value of this name."""
    module = types.ModuleType("unitcad_custom_design")
    try:
        exec(compile(source, name.rpartition(":")[0], "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        raise _error_at_line(name, error) from None
    known, wanted = vars(module), name_in_file(name)
    if wanted in known:
        return known[wanted]
    own = [key for key, value in known.items() if isinstance(value, types.FunctionType | Design)]
    there = some(sorted(own)) or "none"
    raise UnitcadError(f"design {name}: the file has no such function or Design; it has {there}")


@lru_cache(maxsize=16)
def _of_file(name: str, source: str) -> Mapping[str, Shape]:
    """Return the bodies of a file; space that layers share belongs to the earlier one."""

    from unitcad.spec.body_file import bodies_in  # numpy and the mesh rules: most specs do without

    held = bodies_in(name, source)
    cast = [key for key in (f"layer{i + 1}" for i in range(len(held))) if key in held]
    return held | {key: cut(held[key], [held[other] for other in cast[:i]]) for i, key in enumerate(cast)}


def _dimensions(spec: Spec) -> Dimensions:
    height = spec.motor.thickness_mm
    return concentric(spec, height, wire_exit(spec, height))


def _check_values(design: Design) -> None:
    """Raise UnitcadError for a field of a Design with a wrong value."""
    ways = ("concentric", "complement")
    if not callable(design.tooling) and design.tooling not in ways:
        raise UnitcadError(f"design {design.name}: tooling is {design.tooling!r}, not a function or one of {ways}")
    if not (isinstance(design.laid_in, int) and design.laid_in >= 0):
        raise UnitcadError(f"design {design.name}: laid_in is {design.laid_in!r}, not the number of a pour")
    if design.opens not in ("above", "below"):
        raise UnitcadError(f"design {design.name}: opens is {design.opens!r}, not 'above' or 'below'")


def _with_checks(name: str, field: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a design's function with its errors as one sentence and its result looked at.

    A Refusal is the design's own word on a value of the spec and passes as it is.
    """

    def call(*given: Any) -> Any:
        try:
            made = function(*given)
            fault = _EXPECTED[field](made)
        except Refusal:
            raise
        except (Exception, SystemExit) as error:
            raise _error_at_line(name, error) from None
        if field == "dimensions" and not fault:
            counts, wanted = (len(made.radii), len(made.heights)), len(given[0].layers)
            if counts != (wanted, wanted):
                fault = f"dimensions has {counts[0]} radii and {counts[1]} heights, not {wanted} each"
        if fault:
            raise UnitcadError(f"design {name}: {fault}")
        return dict(made) if field == "layers" else made

    return call


def _wrong_shapes(made: Any) -> str:
    if not isinstance(made, Mapping) or not made:
        return f"returns a {type(made).__name__}, not a shape tree or shapes by name"
    for name, shape in made.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            return f"{name!r} is no name for a body (a letter, then a-z 0-9 -)"
        if names_device(name):
            return f"{name!r} is no name for a body: on Windows it is a device"
        if not isinstance(shape, get_args(Shape)):
            return f"{name} is a {type(shape).__name__}, not a shape tree"
    return ""


def _wrong_texts(field: str, many: int = 0) -> Callable[[Any], str]:
    """Return a check of a list of sentences, or of tuples of `many` texts."""

    def fault(made: Any) -> str:
        items = made if isinstance(made, list | tuple) else [None]
        flat = [text for item in items for text in (item if many and isinstance(item, list | tuple) else [item])]
        whole = all(isinstance(text, str) for text in flat) and len(flat) == len(items) * max(many, 1)
        return "" if whole else f"{field} does not return a list of {'pairs of texts' if many else 'sentences'}"

    return fault


def _wrong_kind(field: str, kind: type | types.UnionType, word: str) -> Callable[[Any], str]:
    return lambda made: "" if isinstance(made, kind) else f"{field} returns a {type(made).__name__}, not {word}"


_EXPECTED: dict[str, Callable[[Any], str]] = {
    "layers": _wrong_shapes,
    "dimensions": _wrong_kind("dimensions", Dimensions, "Dimensions"),
    "limits": lambda made: "",
    "advice": _wrong_texts("advice"),
    "pad_radius": _wrong_kind("pad_radius", int | float, "a number"),
    "tooling": _wrong_kind("tooling", Tooling, "a Tooling"),
    "assembly": lambda made: _wrong_texts("assembly")(
        [getattr(each, "text", each) for each in made] if isinstance(made, list | tuple) else made
    ),
    "skipped": _wrong_texts("skipped", many=2),
}
"""For each function of a Design, a check of its result: the fault as text, "" for none."""


def _error_at_line(design: str, error: BaseException) -> UnitcadError:
    """Return the error with its line in the design's file."""
    file, line, trace = design.rpartition(":")[0], getattr(error, "lineno", None), error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    where = f" (line {line})" if line else ""
    if isinstance(error, SystemExit):
        text = "ends the program (SystemExit); it must return a shape tree, or raise an error that names the problem"
    elif isinstance(error, ProfileError):
        text = str(error)
    else:
        text = f"{type(error).__name__}: {error}" if str(error) else f"{type(error).__name__} without a message"
    return UnitcadError(f"design {design}{where}: {text}")
