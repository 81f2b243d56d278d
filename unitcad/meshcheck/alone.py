"""The command line of the check alone, `unitcad-check`: the options of `unitcad check` without Typer."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from types import NoneType
from typing import Any, NoReturn, get_args, get_origin, get_type_hints

from unitcad import __version__
from unitcad.errors import Refusal, UnitcadError
from unitcad.hook_words import HOOK, options_ended
from unitcad.meshcheck.arguments import Arguments, Option
from unitcad.meshcheck.rules.registry import explain
from unitcad.meshcheck.run import Tools, run
from unitcad.text import printable

_NAME = "unitcad-check"


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise UnitcadError(f"{message}; see {_NAME} --help")


def main(words: Sequence[str] | None = None) -> NoReturn:
    """Run the command and end the program with its exit code."""
    words = list(sys.argv[1:] if words is None else words)
    try:
        code = _run(words)
        sys.stdout.flush()
    except UnitcadError as error:
        code = 2
        _say(error, as_json="--json" in words)
    except BrokenPipeError:  # a reader such as head has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 1
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        code = 130
    sys.exit(code)


def _run(words: list[str]) -> int:
    parser, valued = _parser()
    if HOOK in words:
        words = options_ended(words, valued)
    given = Arguments(**vars((parser.parse_args if "--" in words else parser.parse_intermixed_args)(words)))
    if given.explain is not None:
        sys.stdout.write(explain(",".join(given.explain)) + "\n")
        return 0
    for name, option in _options().items():
        if option.whole and getattr(given, name) is not None:
            raise Refusal(option.names[0], getattr(given, name), f"needs the package unitcad, which has {option.whole}")
    return run(given, Tools())


def _options() -> dict[str, Option]:
    hints = get_type_hints(Arguments, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items()}


def _parser() -> tuple[_Parser, set[str]]:
    """Return the parser, and the options that take a value."""
    parser = _Parser(_NAME, description="Check mesh files as they are, before any repair.", allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"{_NAME} {__version__}")
    valued = set[str]()
    for name, kind in get_type_hints(Arguments).items():
        option = _options()[name]
        kinds = [one for one in get_args(kind) or (kind,) if one is not NoneType] if get_origin(kind) else [kind]
        more: dict[str, Any] = {"help": f"{option.help} Not in {_NAME}." if option.whole else option.help}
        more["default"] = getattr(Arguments, name)
        if not option.names:
            parser.add_argument(name, nargs="*", metavar="FILE", **more)
            continue
        names = option.names[0].split("/")
        if bool in kinds:
            parser.add_argument(names[0], *option.names[1:], dest=name, action="store_true", **more)
            if len(names) > 1:
                parser.add_argument(names[1], dest=name, action="store_false", help=argparse.SUPPRESS)
            continue
        valued.update(option.names)
        origin = next((get_origin(one) for one in kinds if get_origin(one)), None)
        if origin is list:
            more["action"] = "append"
        elif origin is tuple:
            more["nargs"], more["metavar"] = 2, tuple((option.metavar or "").split())
        else:
            more["type"] = _number(name, kinds[0], option)
        more.setdefault("metavar", option.metavar)
        parser.add_argument(*option.names, dest=name, **more)
    return parser, valued


def _number(name: str, kind: type, option: Option) -> Any:
    """Return the function that takes an option's word. It raises Refusal for a number that is none, or too small."""
    if kind is str:
        return str

    def take(word: str) -> Any:
        try:
            value = kind(word)
        except ValueError:
            unit = f" ({option.metavar})" if option.metavar != "N" else ""
            limit = f"takes a {'whole ' * (kind is int)}number{unit}, such as {getattr(Arguments, name) or 1}"
            raise Refusal(option.names[0], word, limit) from None
        if option.least is not None and not value >= option.least:
            raise Refusal(option.names[0], value, f"must be at least {option.least:g}", option.least)
        return value

    return take


def _say(error: UnitcadError, *, as_json: bool) -> None:
    """Print an error: a line for each fault, and an object for a program."""
    faults = (error, *error.others) if isinstance(error, Refusal) else (error,)
    for fault in faults:
        sys.stderr.write(f"error: {printable(str(fault)[:2000])}\n")
    if as_json:
        sys.stdout.write(json.dumps({"error": error.as_dict()}, indent=2) + "\n")


if __name__ == "__main__":
    main()
