"""The command line as a person runs it, in the test's own process."""

import io
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout

from unitcad.cli import main


def unitcad(*words, cwd=None):
    """Run the command line; return its exit code and what it printed."""
    out, err, argv = io.StringIO(), io.StringIO(), sys.argv
    sys.argv = ["unitcad", *map(str, words)]
    code = 0
    try:
        with redirect_stdout(out), redirect_stderr(err), chdir(cwd or "."):
            main()
    except SystemExit as stop:
        code = stop.code or 0
    finally:
        sys.argv = argv
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())
