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
from unitcad.errors import UnitcadError
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
    except (NotADirectoryError, FileExistsError) as error:
        failed, code = in_the_way(Path(error.filename or "")), 2
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        failed, code = UnitcadError(f"{place}{error.strerror or error}"), 2
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
