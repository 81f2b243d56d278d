"""unitcad material."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from unitcad import catalogue, files
from unitcad.catalogue import Material
from unitcad.cli.output import console, print_json, progress, warn
from unitcad.cli.shared_options import AsJson, finite
from unitcad.errors import Refusal, unknown_name
from unitcad.lab import material_files as written
from unitcad.lab.columns import declared
from unitcad.lab.dynamic import DynamicResult, evaluate_dynamic, read_dynamic
from unitcad.lab.readers import Layout
from unitcad.lab.tensile import Specimen, TensileResult, evaluate, read_curve
from unitcad.lab.units import COLUMN_UNITS
from unitcad.rooms import expect_none_but
from unitcad.spec import read_toml

_DELIMITERS = {"tab": "\t", "space": " "}
_LENGTH: dict[str, Any] = {"metavar": "MM", "min": 0.001, "max": 10000, "callback": finite}
_FROM_FILE = "Default: the file's header."


def material(
    curves: Annotated[
        list[Path] | None, typer.Argument(metavar="[FILE]...", help="Tensile curves, one a specimen.")
    ] = None,
    dma: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Storage and loss modulus over frequency. Default: no dynamic test."),
    ] = None,
    name: Annotated[str, typer.Option(metavar="NAME", help="Name of the entry. Default: the first file's name.")] = "",
    like: Annotated[
        str,
        typer.Option(
            metavar="SILICONE", help="Shipped silicone for the other values (unitcad list materials). Default: --name."
        ),
    ] = "",
    column: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY=COLUMN[:UNIT]",
            help="Column of a quantity by name or number, such as force=2:N. Quantities: "
            + ", ".join(COLUMN_UNITS)
            + ".",
        ),
    ] = None,
    delimiter: Annotated[
        str, typer.Option(metavar="SIGN", help="Delimiter of the columns: , ; tab or space. Default: as in the file.")
    ] = "",
    decimal: Annotated[
        str, typer.Option(metavar="SIGN", help="Decimal sign: . or a comma. Default: as in the file.")
    ] = "",
    skip_lines: Annotated[
        int,
        typer.Option(metavar="N", min=0, max=100_000, help="Lines to skip in each file, such as a table of results."),
    ] = 0,
    width_mm: Annotated[float | None, typer.Option(help=f"Width of the specimen. {_FROM_FILE}", **_LENGTH)] = None,
    thickness_mm: Annotated[
        float | None, typer.Option(help=f"Thickness of the specimen. {_FROM_FILE}", **_LENGTH)
    ] = None,
    gauge_mm: Annotated[
        float | None, typer.Option(help=f"Gauge length of the specimen. {_FROM_FILE}", **_LENGTH)
    ] = None,
    cell_n: Annotated[
        float | None,
        typer.Option(metavar="N", min=0.001, callback=finite, help="Full scale of the force cell. Default: not known."),
    ] = None,
    strain: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help="Strain of use in %. Default: amplitude over walls.")
    ] = "",
    amplitude_um: Annotated[
        float, typer.Option(metavar="UM", min=0.001, max=1e5, callback=finite, help="Amplitude of the motor.")
    ] = 300.0,
    wall_mm: Annotated[str, typer.Option(metavar="LOW:HIGH", help="Walls that the motor strains, in mm.")] = "1.25:2.5",
    frequency_hz: Annotated[
        float, typer.Option(metavar="HZ", min=1, max=5000, callback=finite, help="Frequency of the motor.")
    ] = 125.0,
    deformation: Annotated[
        str, typer.Option(metavar="KIND", help="Deformation of --dma: shear or tension. Default: as in the file.")
    ] = "",
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", metavar="DIR", help="Folder for material.toml, .json and charts. Default: only print."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Turn tensile curves into a silicone's table.

    The table is for a spec, [materials.NAME]; it has every usual method in addition to the default, with a range. --dma
    takes a dynamic test. A tensile test gives a quasi-static modulus, which the estimate uses if the spec says moduli =
    "quasi-static" under [estimate].
    """

    if not curves and dma is None:
        raise Refusal("FILES", None, "is required: a tensile curve or more, or --dma with a file")
    if deformation and dma is None:
        raise Refusal("--deformation", deformation, "says how --dma was measured, which is not given")
    if cell_n is not None and not curves:
        raise Refusal("--cell-n", cell_n, "belongs to tensile curves, of which none is given")
    for path in [*(curves or []), *([dma] if dma else [])]:
        if not path.exists():
            raise files.NotThere(path)
        if path.suffix == ".toml":
            expect_none_but("", read_toml(path), str(path), "FILE")
    given = declared(column or [])
    layout = Layout(_DELIMITERS.get(delimiter, delimiter), decimal, skip_lines)
    used = _strain(strain, amplitude_um, wall_mm)
    with progress("material") as stage:
        specimen = Specimen(width_mm, thickness_mm, gauge_mm, cell_n=cell_n)
        read = []
        for path in curves or []:
            stage(path.name)
            read.append(read_curve(path, given, specimen, layout))
            if cell_n is not None and read[-1].specimen.area is None:
                limit = f"needs the cross-section, which {path.name} does not give: --width-mm and --thickness-mm"
                raise Refusal("--cell-n", cell_n, limit)
        moduli = None
        if dma is not None:
            stage(dma.name)
            moduli = read_dynamic(dma, given, deformation, layout)
        shipped = catalogue.materials()
        named = name or _slug((curves or [dma])[0])  # type: ignore[arg-type]
        base = _base(like, named, shipped)
        tensile = evaluate(read, used, shipped[base]) if read else None
        ratio = float(shipped[base].poisson_ratio)
        dynamic = evaluate_dynamic(moduli, frequency_hz, ratio) if moduli else None
    entry = written.table(tensile, dynamic, base, frequency_hz)
    written.expect_loadable(named, entry)
    text = written.material_toml(named, entry, _comments(entry, shipped[base]))
    found = written.data(named, entry, tensile, dynamic, frequency_hz)
    if out is not None:
        contents = {
            "material.toml": text,
            "material.json": json.dumps(found, indent=1, allow_nan=False, ensure_ascii=False) + "\n",
        }
        if tensile:
            contents["tensile.svg"] = written.tensile_chart(named, tensile)
        if dynamic:
            factor = 2 * (1 + float(shipped[base].poisson_ratio)) if dynamic.curve.deformation == "shear" else 1.0
            contents["dynamic.svg"] = written.dynamic_chart(named, dynamic, factor)
        files.replace_all(out, {key: one.encode() for key, one in contents.items()}, "material.toml")
    if as_json:
        print_json({**found, **({"folder": str(out)} if out is not None else {})})
        return
    if tensile:
        _print_tensile(named, tensile, found["tensile"])
    if dynamic:
        _print_dynamic(dynamic)
    typer.echo(text, nl=False)
    if out is not None:
        typer.echo(str(out))


def _base(like: str, named: str, shipped: Mapping[str, Material]) -> str:
    """Return the shipped silicone that gives the values that no test measures."""
    if not like and named not in shipped:
        limit = f"is required: {named!r} is no shipped silicone, and a curve gives only a modulus"
        raise Refusal("--like", None, f"{limit}; known: {', '.join(shipped)}")
    base = like or named
    if base not in shipped:
        raise unknown_name("--like", base, shipped)
    return base


def _comments(entry: dict[str, Any], base: Material) -> tuple[str, ...]:
    lines = ["For a spec: paste it there and name the silicone in [[layers]]."]
    if "quasistatic_modulus_kpa" in entry:
        lines.append('A tensile test is quasi-static: the estimate uses it if the spec says moduli = "quasi-static"')
        lines.append("under [estimate]; it is no modulus at the motor's frequency.")
        if base.youngs_modulus_kpa and "youngs_modulus_kpa" not in entry:
            lines.append(
                f"Without that the estimate uses the modulus of {base.name}: {base.youngs_modulus_kpa.value:g} kPa."
            )
    return tuple(lines)


def _slug(path: Path) -> str:
    words = "".join(letter if letter.isalnum() else " " for letter in path.stem.lower()).split()
    return "-".join(words) or "material"


def _strain(strain: str, amplitude_um: float, wall_mm: str) -> tuple[float, float]:
    """Return the strain of use as fractions: as given in %, or the motor's amplitude over the walls."""
    if strain:
        low, high = _pair("--strain", strain, "12:24")
        used = low / 100, high / 100
    else:
        thin, thick = _pair("--wall-mm", wall_mm, "1.25:2.5")
        used = amplitude_um / 1e3 / thick, amplitude_um / 1e3 / thin
    if not 0.001 <= used[0] < used[1] <= 1.0:
        shown = f"{100 * used[0]:.4g}:{100 * used[1]:.4g}"
        raise Refusal("--strain", shown, "must rise, from 0.1 % or more to 100 % or less", "12:24")
    return used


def _pair(field: str, text: str, nearest: str) -> tuple[float, float]:
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError:
        raise Refusal(field, text, "needs two numbers LOW:HIGH", nearest) from None
    if not (math.isfinite(low) and math.isfinite(high) and 0 < low < high):
        raise Refusal(field, text, "needs LOW above 0 and below HIGH", nearest)
    return low, high


def _print_tensile(name: str, result: TensileResult, found: dict[str, Any]) -> None:

    screen = console()
    low, high = result.low / 1e3, result.high / 1e3
    screen.print(f"{name}: {result.value / 1e3:.4g} kPa ({low:.4g} to {high:.4g}), {result.method}", soft_wrap=True)
    screen.print(f"  {found['quasistatic']}", soft_wrap=True)
    table = Table("method", "kPa", "by specimen", "remark")
    for row in result.rows:
        value = "-" if row.value is None else f"{row.value / 1e3:.4g}"
        each = " ".join("-" if one is None else f"{one / 1e3:.4g}" for one in row.by_specimen[:8])
        table.add_row(row.method, value, each if len(row.by_specimen) > 1 else "", row.reason)
    screen.print(table)
    screen.print(
        f"  range: the methods that could be defended differ by {result.spread:.3g}; "
        f"specimens {_percent(result.scatter)}, cross-section {_percent(result.geometry)}",
        soft_wrap=True,
    )
    for one in result.warnings:
        warn(f"warning: {one.code}: {one.message}")


def _percent(half_width: float | None) -> str:
    return "not known" if half_width is None else f"+- {100 * half_width:.2g} %"


def _print_dynamic(result: DynamicResult) -> None:

    screen = console()
    screen.print(
        f"fractional Kelvin-Voigt: E0 {result.static / 1e3:.4g} kPa, tau {result.tau * 1e6:.4g} us, n {result.n:.4g}; "
        f"misfit {100 * result.residual:.2g} %",
        soft_wrap=True,
    )
    screen.print(
        f"  at {result.frequency_hz:g} Hz: storage {result.storage / 1e3:.4g} kPa +- {100 * result.error:.2g} %, "
        f"loss factor {result.loss_factor:.3g} +- {100 * result.loss_error:.2g} %",
        soft_wrap=True,
    )
    if result.extrapolated:
        tested = "too few points to test that"
        if result.held_out_error is not None:
            tested = f"the lower half of the span predicts the upper one within {100 * result.held_out_error:.2g} %"
        low, high = result.curve.frequency[0], result.curve.frequency[-1]
        warn(f"warning: extrapolated: measured from {low:g} to {high:g} Hz; {tested}")
    for one in result.warnings:
        warn(f"warning: {one.code}: {one.message}")
