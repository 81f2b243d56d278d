"""PrusaSlicer, headless, as an independent reader of our files."""

import os
import re
import shutil
import subprocess

import pytest

PROGRAM = shutil.which("prusa-slicer")
MARKS = [pytest.mark.slicer, pytest.mark.skipif(PROGRAM is None, reason="PrusaSlicer is not installed")]
_REPAIRS = re.compile(r"^(?:degenerate_facets|edges_fixed|facets_removed|facets_reversed|backwards_edges)\s*=", re.M)


def run(*arguments):
    """Run it and return its output; it ends at once if the user's locale is not installed, and C always is."""
    command = [PROGRAM, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, timeout=300, env={**os.environ, "LC_ALL": "C"})
    return (done.stdout + done.stderr).decode("utf-8", "replace")


def needs_repair(path):
    """Whether it finds anything to repair in a mesh file; fast, nothing is sliced."""
    output = run("--info", path)
    assert "manifold" in output, output[-200:]
    return "manifold = yes" not in output or bool(_REPAIRS.search(output))


def print_minutes(path, printer, code):
    """Slice an STL into the file `code` with the slicer's defaults and a printer's layers; return its time."""
    layer = f"{float(printer.layer_mm):g}"
    nozzle = ("--nozzle-diameter", f"{float(printer.nozzle_mm):g}")
    run("--export-gcode", "--output", code, *nozzle, "--layer-height", layer, "--first-layer-height", layer, path)
    text = value(code.read_text("utf-8", "replace"), "estimated printing time (normal mode)")
    parts = re.findall(r"(\d+)([dhms])", text)
    return sum(int(number) * {"d": 1440, "h": 60, "m": 1, "s": 1 / 60}[unit] for number, unit in parts)


def value(code, name):
    """A value that the text of a G-code states."""
    return re.search(rf"^; {re.escape(name)} = (.+)$", code, re.M)[1].strip()
