"""The command line. Each command parses, calls one function, prints; what is heavy is imported inside it.

Exit 0 done; 1 a finding or a failed variant; 2 a wrong argument, option or input; 130 interrupted. No traceback reaches
a user.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from typing import Any, NoReturn

from unitcad.cli.output import form_of, say_error, speak_anywhere, warn
from unitcad.errors import UnitcadError
from unitcad.heap import seek_cycles_seldom

INTERRUPTED = 130


def __getattr__(name: str) -> Any:
    """Return `app`, the whole command line. Raises AttributeError for any other name."""
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from unitcad.cli.command_line import application

    globals()[name] = application()
    return globals()[name]


def _run(words: list[str]) -> int:
    """Run the command of the program's arguments; return its exit code."""
    names = words[1:] if words[:1] == ["check"] else []
    plain = sys.platform != "win32"  # there the parser expands wildcards
    if plain and names and not any(name.startswith("-") for name in names):
        # Names of files alone need no parser, which takes longer to load than a small mesh takes to check.
        from unitcad.cli.check_run import Asked, run

        return run(Asked(files=names))
    from unitcad.cli import command_line

    return command_line.run(words)


def _interrupt_behind(error: BaseException | None) -> bool:
    """Return whether Ctrl-C led to this error: Python 3.11 makes a RuntimeError of it while a class is made."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


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
        code = _run(sys.argv[1:])
        if code == INTERRUPTED:
            _leave_interrupted()
        sys.exit(code)
    except UnitcadError as error:
        say_error(error, form)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        _leave_interrupted()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        say_error(UnitcadError(f"{place}{error.strerror or error}"), form)
        sys.exit(2)
    except MemoryError:
        say_error(UnitcadError("out of memory"), form)
        sys.exit(1)
    except Exception as error:
        if _interrupt_behind(error):
            _leave_interrupted()
        if os.environ.get("UNITCAD_TRACEBACK"):
            raise
        say_error(
            UnitcadError(f"internal error: {type(error).__name__}: {error} (a bug; UNITCAD_TRACEBACK=1 shows where)"),
            form,
        )
        sys.exit(1)


def program() -> NoReturn:
    """Run `main` as a process that has nothing else to do; it ends without taking its modules apart.

    That would be a tenth of the time that a small mesh takes to check.
    """
    seek_cycles_seldom()
    try:
        main()
    except SystemExit as left:
        # Workers end with this process, and so do the threads that wait for them.
        if isinstance(left.code, int) and all(one.daemon for one in threading.enumerate()[1:]):
            with contextlib.suppress(OSError):  # Python's own end meets it again, and says so
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(left.code)
        raise
