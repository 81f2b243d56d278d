"""Speed as ratios in one run: the default template's set against plain CadQuery, plain build123d and bare manifold3d.

The scripts lie in benchmarks/, beside other benchmarks, which are run too; so this suite needs a clone.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.measures import mesh_volume
from benchmarks.accuracy.result import Promise, Result, Say, Summary, Table, shown
from unitcad.accuracy.measurements import Timing, interleaved, timing
from unitcad.api.variant import Variant
from unitcad.errors import UnitcadError
from unitcad.validation import default_template, load

ROOT = Path(__file__).parents[2]
SCRIPTS = {
    "unitcad, geometry only": "unitcad_set.py",
    "plain CadQuery": "plain_cadquery.py",
    "plain build123d": "plain_build123d.py",
    "bare manifold3d": "bare_manifold.py",
}
OURS, CADQUERY, BUILD123D, BARE = SCRIPTS
FULL = "unitcad build, the whole command"
BARE_STEP = "bare OCCT, the same STEP"
OTHERS = (("bench_check.py",), ("bench_attenuation.py",), ("bench_batch.py", "--rounds", "3", "--sizes", "100,1000"))
"""Other scripts of benchmarks/ with their options."""


def run(quick: bool, say: Say) -> Result:
    """Time the set cold and warm, STL and STEP; then run the other benchmarks."""
    folder = ROOT / "benchmarks" / default_template()
    rounds, warm = (1, 1) if quick else (7, 5)
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch)
        lengths = out / "lengths.json"
        _call(folder / "lengths.py", lengths)
        errors = {}
        for name, script in SCRIPTS.items():
            say(f"volumes of {name}")
            _call(folder / script, lengths, out / name, "stl")
            errors[name] = _volume_error(out / name)
        tables = [_volume_table(errors)]

        def scripts(formats: str) -> list[str]:
            return [name for name in SCRIPTS if name != BARE or formats == "stl"]  # manifold3d has no B-rep for STEP

        def cold(formats: str) -> dict[str, Timing]:
            say(f"cold, {formats}")
            calls: dict[str, Callable[[], object]] = {
                name: partial(_call, folder / SCRIPTS[name], lengths, out / name, formats) for name in scripts(formats)
            }
            calls[FULL] = partial(_build, out / f"build-{formats}", "stl" if formats == "stl" else "step,stl")
            return interleaved(calls, rounds, warm=not quick)

        def warmed(formats: str) -> dict[str, Timing]:
            say(f"warm, {formats}")
            return {n: _warm(folder / SCRIPTS[n], lengths, out / n, formats, warm) for n in scripts(formats)}

        cold_stl, cold_step, warm_stl, warm_step = cold("stl"), cold("both"), warmed("stl"), warmed("both")
        say("the default command")
        whole = whole_command(folder, lengths, out, rounds)
        say("small commands")
        whole.append(small_commands(out / OURS / "base.stl", rounds))
    warm_title = "The same, {}, warm: the library is loaded, geometry made anew"
    tables += [
        _time_table(f"The {default_template()} set, parameters to STL, cold processes", cold_stl, CADQUERY),
        _time_table("The same with STEP, cold processes", cold_step, CADQUERY),
        _time_table(warm_title.format("STL"), warm_stl, CADQUERY),
        _time_table(warm_title.format("STL and STEP"), warm_step, CADQUERY),
        _aims(cold_stl, cold_step, warm_step),
        *whole,
    ]
    failed: list[str] = []
    for command in () if quick else OTHERS:
        script = " ".join(command)
        say(script)
        try:
            tables.append(_printed(command))
        except UnitcadError as error:  # keep what the others measured
            say(str(error))
            failed.append(script)
            tables.append(Table(f"python benchmarks/{script}", ("failed",), ((str(error),),)))
    worst = {name: max(map(abs, of_part.values())) for name, of_part in errors.items()}
    share = {name: worst[name] / worst[OURS] for name in SCRIPTS if name != OURS}
    return Result(
        suite="speed",
        title="Speed",
        text=(
            f"Ten bodies of the {default_template()} template with its moulds: two layers, motor, circuit, base, "
            "two cups, tongue, filament and blade. The plain scripts draw the same parts as a user would, from "
            "the same lengths, with one boolean after the other. The angle of their STL is chosen so that the "
            "largest volume error is near that of unitcad's meshes. Cold: a new process each, taken "
            "in turn. Warm times come from one process a script, so they are not interleaved. The benchmarks of "
            "checks, estimates and batches follow as printed."
        ),
        tables=tuple(tables),
        promises=(
            Promise("benchmarks that failed", len(failed), 0),
            Promise("largest relative volume error of a part by any method", max(worst.values()), 1e-4),
            *(
                Promise(f"{name}: largest volume error over unitcad's, or the other way round", max(s, 1 / s), 2.5)
                for name, s in share.items()
            ),
        ),
        measured=machine("manifold3d", "cadquery", "build123d", "cadquery-ocp"),
        summary=summary(cold_stl, cold_step, max(worst.values())),
    )


def whole_command(folder: Path, lengths: Path, out: Path, rounds: int) -> list[Table]:
    """Time the default command, with all that it makes, beside the bare kernels; return the tables with their aims."""
    formats = load(default_template()).output.formats
    others = ",".join(form for form in formats if form != "step")
    step = interleaved(
        {
            FULL: partial(_build, out / "whole", ",".join(formats)),
            BARE_STEP: partial(_call, folder / "bare_occt.py", lengths, out / BARE_STEP, "step"),
        },
        rounds,
    )
    mesh = interleaved(
        {
            FULL: partial(_build, out / "whole-mesh", others),
            BARE: partial(_call, folder / SCRIPTS[BARE], lengths, out / BARE, "stl"),
        },
        rounds,
    )
    what = "unit, moulds, drawings, procedure with its pictures, checks, estimate and page"
    rows = []
    for made, times, peer, aim in (("with STEP", step, BARE_STEP, 1.25), ("without STEP", mesh, BARE, 4.3)):
        ratio = times[FULL].median / times[peer].median
        rows.append((made, str(times[FULL]), peer, str(times[peer]), ratio, aim, "yes" if ratio <= aim else "no"))
    head = ("default build", "time", "beside", "time", "ratio of medians", "aim, at most", "met")
    return [Table(f"The whole default command, cold: {what}", head, tuple(rows))]


def small_commands(stl: Path, rounds: int) -> Table:
    """Time commands without geometry, cold, beside the imports that they can't do without; return the aims' table."""
    check, scipy = "import numpy", "import numpy, scipy.special"
    asked = (
        (("--help",), scipy, 1.5),
        (("list",), scipy, 1.5),
        (("estimate", default_template()), scipy, 2.5),
        (("check", str(stl)), check, 1.5),
    )
    calls = {peer: partial(_python, "-c", peer) for peer in (check, scipy)}
    times = interleaved(calls | {words[0]: partial(_python, "-m", "unitcad", *words) for words, _, _ in asked}, rounds)
    rows = []
    for words, peer, aim in asked:
        ratio = times[words[0]].median / times[peer].median
        shown_words = " ".join(("unitcad", words[0], *(["a small STL"] if words[0] == "check" else words[1:])))
        rows.append(
            (shown_words, str(times[words[0]]), peer, str(times[peer]), ratio, aim, "yes" if ratio <= aim else "no")
        )
    head = ("command", "time", "beside", "time", "ratio of medians", "aim, at most", "met")
    return Table("Small commands, cold", head, tuple(rows))


def summary(stl: dict[str, Timing], step: dict[str, Timing], worst: float) -> Summary:
    """Return what the set costs in cold processes, as STL and with STEP."""
    picks = [
        (
            f"the {default_template()} set: {formats}, cold",
            f"{shown(worst)} of a volume",
            f"unitcad, geometry only: {times[OURS]}; plain CadQuery {times[CADQUERY].median / times[OURS].median:.3g} "
            "times as long",
        )
        for formats, times in (("STL", stl), ("STL and STEP", step))
    ]
    return Summary(tuple(picks), f"a part's volume is off by {shown(worst)}")


def _call(script: Path, *arguments: object) -> str:
    """Run a script in a process of its own; its standard output. Raises UnitcadError if it fails."""
    command = [sys.executable, str(script), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=_installed())
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["nothing on standard error"])[-1]
        raise UnitcadError(f"{script.name} ended with {done.returncode}: {last}")
    return done.stdout


def _build(out: Path, formats: str) -> None:
    _python("-m", "unitcad", "build", default_template(), "--formats", formats, "-o", str(out))


def _python(*words: str) -> None:
    subprocess.run([sys.executable, *words], capture_output=True, check=True, env=_installed())


def _installed() -> dict[str, str]:
    """Return the environment, with bytecode kept as an installed package has it: a clone may run without any."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def _warm(script: Path, lengths: Path, out: Path, formats: str, runs: int) -> Timing:
    return timing([float(line) for line in _call(script, lengths, out, formats, runs).split()])


def _volume_error(folder: Path) -> dict[str, float]:
    """Return the relative volume error of every STL in a folder against OCCT's volume of the same tree."""
    import trimesh

    from benchmarks.accuracy.brep_measures import measure
    from unitcad.kernels import occt

    variant = Variant.of(default_template())
    bodies = (*variant.unit, *variant.plan.tools)
    errors = {}
    for body, solid in zip(bodies, occt.solids([body.shape for body in bodies]), strict=True):
        mesh = trimesh.load_mesh(folder / f"{body.name}.stl", process=False)
        volume = mesh_volume(mesh.vertices, mesh.faces)[0]
        errors[body.name] = volume / measure(solid).volume - 1
    return errors


def _volume_table(errors: dict[str, dict[str, float]]) -> Table:
    names = list(next(iter(errors.values())))
    rows = tuple((name, *(errors[way][name] for way in errors)) for name in names)
    return Table(
        "Volume of each STL against OCCT's exact volume of unitcad's tree, relative",
        ("part", *errors),
        rows,
        "All four work with lengths on the grid of 1/1024 mm: what differs is tessellation.",
    )


def _time_table(title: str, times: dict[str, Timing], base: str) -> Table:
    rows = tuple((name, str(time), times[base].median / time.median) for name, time in times.items())
    return Table(title, ("method", "time", f"times faster than {base}"), rows)


def _aims(cold: dict[str, Timing], step: dict[str, Timing], step_warm: dict[str, Timing]) -> Table:
    """Tabulate the ratios of the medians beside their aims. Times are never promises: CI does not look at them."""

    def row(what: str, times: dict[str, Timing], peer: str, wanted: float) -> tuple:
        ratio = times[peer].median / times[OURS].median
        return f"{what}: times faster than {peer}", ratio, f"at least {wanted:g}", "yes" if ratio >= wanted else "no"

    share = cold[OURS].median / cold[BARE].median
    return Table(
        "What is aimed at, geometry only",
        ("ratio of medians", "measured", "aim", "met"),
        (
            row("STL, cold", cold, CADQUERY, 8),
            (f"STL, cold: time over that of {BARE}", share, "at most 2", "yes" if share <= 2 else "no"),
            row("STL and STEP, cold", step, CADQUERY, 1),
            row("STL and STEP, warm", step_warm, CADQUERY, 2.5),
        ),
    )


def _printed(command: tuple[str, ...]) -> Table:
    """Return what another benchmark prints, unchanged."""
    printed = _call(ROOT / "benchmarks" / command[0], *command[1:])
    lines = tuple((line.rstrip(),) for line in printed.splitlines() if line.strip())
    return Table(f"python benchmarks/{' '.join(command)}", (), lines)
