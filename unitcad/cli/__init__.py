"""The command line. Each command parses, calls one function, prints.

Exit 0 done; 1 a finding or a failed variant; 2 a wrong argument, option or input; 130 interrupted. No traceback reaches
a user.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import NoReturn

from unitcad.cli import command_line
from unitcad.cli.command_line import app
from unitcad.cli.output import form_of, say_error, speak_anywhere, warn
from unitcad.errors import Refusal, UnitcadError
from unitcad.files import in_the_way

__all__ = ["app", "main"]

INTERRUPTED = 130


def _interrupt_behind(error: BaseException | None) -> bool:
    """Return whether Ctrl-C led to this error: Python 3.11 makes a RuntimeError of it while a class is made."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _lacks_memory(error: BaseException) -> bool:
    """Return whether a compiled library that found no memory raised this error."""
    # CPython raises SystemError if C code says that it failed and sets no exception, or the reverse.
    said = {SystemError: ("exception set", "setting an exception"), ImportError: ("failed to map segment",)}
    return any(part in str(error) for part in said.get(type(error), ()))


def _of_the_system(error: OSError) -> UnitcadError:
    """Return a system's error as one line: of the option whose folder or file the place is in."""
    if isinstance(error, NotADirectoryError | FileExistsError):
        return in_the_way(Path(error.filename or ""))
    place, why = error.filename, error.strerror or str(error)
    for option, out in command_line.out_of(sys.argv[1:]):
        there, here = Path(os.path.abspath(str(place))), Path(os.path.abspath(out))
        if place and (there.is_relative_to(here) or here.is_relative_to(there)):
            what = "" if here.is_relative_to(there) else f"{there.relative_to(here)} in it "
            return Refusal(option, out, f"{what}can't be written: {why[:1].lower()}{why[1:]}")
    return UnitcadError(f"{place}: {why}" if place else why)


def _leave_interrupted() -> NoReturn:
    """Say so and leave with exit code 130."""
    warn("interrupted")
    # Where Ctrl-C met an exec of text, as in a dataclass, Python ends itself by the signal unless another exec follows.
    exec("")
    sys.exit(INTERRUPTED)


def main() -> NoReturn:
    """Entry point of `unitcad`: run a command, turn every error into one line and an exit code."""
    form = form_of(sys.argv)
    speak_anywhere()
    try:
        code = command_line.run(sys.argv[1:])
        if code == INTERRUPTED:
            _leave_interrupted()
        sys.exit(code)
    except UnitcadError as error:
        failed, code = error, error.exit_code
    except KeyboardInterrupt:
        _leave_interrupted()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        failed, code = _of_the_system(error), 2
    except MemoryError:
        failed, code = UnitcadError("out of memory"), 1
    except Exception as error:
        if _interrupt_behind(error):
            _leave_interrupted()
        if os.environ.get("UNITCAD_TRACEBACK"):
            raise
        text = f"internal error: {type(error).__name__}: {error} (a bug; UNITCAD_TRACEBACK=1 shows where)"
        failed, code = UnitcadError(f"out of memory: {error}" if _lacks_memory(error) else text), 1
    say_error(failed, form)
    sys.exit(code)
