"""unitcad material: the table for a spec, everything as JSON, a chart of the tensile curves."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from unitcad import catalogue, files
from unitcad.catalogue import Material, MaterialEntry, choose
from unitcad.cli.output import print_indented, print_json, progress, warn
from unitcad.cli.shared_options import AsJson, finite
from unitcad.cli.tables import console, print_table
from unitcad.documents import read_toml
from unitcad.errors import Refusal
from unitcad.export.chart import Series, chart
from unitcad.json_text import rounded
from unitcad.lab.material import (
    DynamicResult,
    Specimen,
    TensileResult,
    evaluate,
    evaluate_dynamic,
    parse_column,
    quasistatic,
    read_curve,
    read_dynamic,
)
from unitcad.lab.readers import Layout
from unitcad.lab.units import COLUMN_UNITS
from unitcad.rooms import expect_none_but
from unitcad.spec import convert
from unitcad.text import some, toml, toml_key

_SHOWN_TO = 1.2
"""Strain up to which the chart shows a curve."""


def entry_of(tensile: TensileResult | None, dynamic: DynamicResult | None, like: str, hertz: float) -> dict[str, Any]:
    """Return the entry [materials.NAME] of a spec; `hertz` is the motor's frequency."""
    entry: dict[str, Any] = {"like": like}
    if tensile:
        source = f"{some((curve.name for curve in tensile.curves), 3)}; {quasistatic(tensile, hertz)}"
        entry["quasistatic_modulus_kpa"] = _value(
            tensile.value / 1e3, tensile.low / 1e3, tensile.high / 1e3, tensile.method, source
        )
        at_100 = next(row for row in tensile.rows if row.method.startswith("secant at 100 %"))
        if at_100.value is not None and at_100.value > 0:
            widened = float(np.exp(np.hypot(np.hypot(tensile.scatter or 0.0, tensile.geometry), tensile.start)))
            entry["modulus_100pct_kpa"] = _value(
                at_100.value / 1e3, at_100.value / widened / 1e3, at_100.value * widened / 1e3, at_100.method, source
            )
    if dynamic:
        entry.update(_dynamic(dynamic))
    return entry


def material_toml(name: str, entry: Mapping[str, Any], comments: tuple[str, ...]) -> str:
    """Return the table as TOML, after comments; it may be pasted into a spec."""
    lines = [*(f"# {comment}" for comment in comments), "", f"[materials.{toml_key(name)}]"]
    return "\n".join([*lines, *(f"{key} = {toml(value)}" for key, value in entry.items())]) + "\n"


def as_data(
    name: str, entry: Mapping[str, Any], tensile: TensileResult | None, dynamic: DynamicResult | None, hertz: float
) -> dict[str, Any]:
    """Return everything as JSON-ready data; moduli in kPa, strains as fractions."""
    found: dict[str, Any] = {"material": name, "table": dict(entry)}
    if tensile:
        found["tensile"] = {
            "quasistatic": quasistatic(tensile, hertz),
            "methods_factor": tensile.spread, "scatter_of_specimens": tensile.scatter,
            "cross_section": tensile.geometry, "toe": tensile.start,
            "methods": [
                {
                    "method": row.method, "value_kpa": _kpa(row.value),
                    "by_specimen_kpa": list(map(_kpa, row.by_specimen)),
                    "defensible": row.defensible, "reason": row.reason,
                }
                for row in tensile.rows
            ],
            "warnings": list(tensile.warnings),
            "files": [
                {
                    "name": curve.name, "sha256": curve.sha256,
                    "slack": toe.origin if toe else None, "offset_kpa": toe.offset / 1e3 if toe else None,
                }
                for curve, toe in zip(tensile.curves, tensile.toes, strict=True)
            ],
        }  # fmt: skip
    if dynamic:
        found["dynamic"] = {
            "law": "E0 (1 + (i w tau)^n)", "residual": dynamic.residual,
            "error": dynamic.error, "loss_factor_error": dynamic.loss_error, "fit_error": dynamic.fit_error,
            "extrapolated": dynamic.extrapolated, "upper_half_predicted_error": dynamic.held_out_error,
            "warnings": list(dynamic.warnings),
            "files": [{"name": dynamic.curve.name, "sha256": dynamic.curve.sha256}],
        }  # fmt: skip
    return rounded(found, 6)


def _kpa(pascals: float | None) -> float | None:
    return None if pascals is None else pascals / 1e3


def tensile_chart(name: str, result: TensileResult) -> str:
    """Draw the curves, the fitted toe up to a little beyond 100 %."""
    series = []
    for curve in result.curves:
        kept = curve.strain <= _SHOWN_TO
        series.append(Series(curve.name, 100 * curve.strain[kept], curve.stress[kept] / 1e3, points=True))
    if toe := result.toes[0]:
        strain = np.linspace(toe.origin, result.used[1] + max(toe.origin, 0.0), 60)
        series.append(Series("start, slack and offset fitted", 100 * strain, toe.stress(strain) / 1e3))
    low, high = (100 * end for end in result.used)
    title = f"{name}: nominal stress, quasi-static; shaded: the strain of use"
    return chart(series, title, "engineering strain, %", "nominal stress, kPa", shaded=(low, high))


def _dynamic(result: DynamicResult) -> dict[str, Any]:
    ends = result.curve.frequency[0], result.curve.frequency[-1]
    way = "extrapolated from" if result.extrapolated else "within"
    source = f"{result.curve.name}, {result.frequency_hz:g} Hz, {way} {ends[0]:g} to {ends[1]:g} Hz"
    law = {"status": "measured", "source": source, "method": "fractional Kelvin-Voigt law"}

    def ranged(value: float, error: float, method: str) -> dict[str, Any]:
        return _value(value, value * float(np.exp(-error)), value * float(np.exp(error)), method, source)

    constants = {"mu0_kpa": result.static / 3e3, "tau_us": result.tau * 1e6, "n": result.n}
    return {
        "youngs_modulus_kpa": ranged(
            result.storage / 1e3, result.error, "storage modulus of a fractional Kelvin-Voigt law"
        ),
        "loss_factor": ranged(result.loss_factor, result.loss_error, "loss over storage of the same law"),
        **{f"fractional_{name}": {"value": rounded(value, 4), **law} for name, value in constants.items()},
    }


def _value(value: float, low: float, high: float, method: str, source: str) -> dict[str, Any]:
    ends = rounded({"value": value, "low": low, "high": high}, 4)
    return {**ends, "status": "measured", "method": method, "source": source[:500]}


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
    strain: Annotated[str, typer.Option(metavar="LOW:HIGH", help="Strain of use in %.")] = "12:24",
    frequency_hz: Annotated[
        float, typer.Option(metavar="HZ", min=1, max=5000, callback=finite, help="Frequency of the motor.")
    ] = 125.0,
    deformation: Annotated[
        str, typer.Option(metavar="KIND", help="Deformation of --dma: shear or tension. Default: as in the file.")
    ] = "",
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", metavar="DIR", help="Folder for material.toml, .json and tensile.svg. Default: only print."
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
    paths = [*(curves or []), *([dma] if dma else [])]
    for path in paths:
        if not path.exists():
            raise files.NotThere(path)
        if path.suffix == ".toml":
            expect_none_but("", read_toml(path), str(path), "FILE")
    given = parse_column(column or [])
    layout = Layout(_DELIMITERS.get(delimiter, delimiter), decimal, skip_lines)
    used = _strain(strain)
    with progress("material") as stage:
        specimen = Specimen(width_mm, thickness_mm, gauge_mm)
        read = []
        for path in curves or []:
            stage(path.name)
            read.append(read_curve(path, given, specimen, layout))
        moduli = None
        if dma is not None:
            stage(dma.name)
            moduli = read_dynamic(dma, given, deformation, layout)
        shipped = catalogue.materials()
        words = "".join(letter if letter.isalnum() else " " for letter in paths[0].stem.lower()).split()
        named = name or "-".join(words) or "material"
        if not like and named not in shipped:
            limit = f"is required: {named!r} is no shipped silicone, and a curve gives only a modulus"
            raise Refusal("--like", None, f"{limit}; known: {', '.join(shipped)}")
        base = choose("--like", like or named, shipped)
        tensile = evaluate(read, used, base) if read else None
        ratio = float(base.poisson_ratio)
        dynamic = evaluate_dynamic(moduli, frequency_hz, ratio) if moduli else None
    entry = entry_of(tensile, dynamic, base.name, frequency_hz)
    # The catalogue's own types and limits hold it, as in a spec.
    catalogue.materials({named: convert(entry, MaterialEntry, f"materials.{named}")})
    text = material_toml(named, entry, _comments(entry, base))
    found = as_data(named, entry, tensile, dynamic, frequency_hz)
    if out is not None:
        contents = {
            "material.toml": text,
            "material.json": json.dumps(found, indent=1, allow_nan=False, ensure_ascii=False) + "\n",
        }
        if tensile:
            contents["tensile.svg"] = tensile_chart(named, tensile)
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


def _strain(text: str) -> tuple[float, float]:
    """Return the strain of use as fractions, as given in %."""
    try:
        low, high = (float(part) / 100 for part in text.split(":"))
    except ValueError:
        raise Refusal("--strain", text, "needs two numbers LOW:HIGH", "12:24") from None
    if not 0.001 <= low < high <= 1.0:
        raise Refusal("--strain", text, "must rise, from 0.1 % or more to 100 % or less", "12:24")
    return low, high


def _print_tensile(name: str, result: TensileResult, found: dict[str, Any]) -> None:

    screen = console()
    low, high = result.low / 1e3, result.high / 1e3
    screen.print(f"{name}: {result.value / 1e3:.4g} kPa ({low:.4g} to {high:.4g}), {result.method}", soft_wrap=True)
    print_indented(found["quasistatic"])
    rows = []
    for row in result.rows:
        value, *each = ("-" if one is None else f"{one / 1e3:.4g}" for one in (row.value, *row.by_specimen[:8]))
        by_specimen = " ".join(each) if len(row.by_specimen) > 1 else ""
        rows.append({"method": row.method, "kPa": value, "by specimen": by_specimen, "remark": row.reason})
    print_table(rows)
    scatter = "not known" if result.scatter is None else f"+- {100 * result.scatter:.2g} %"
    print_indented(
        f"range: the methods that could be defended differ by {result.spread:.3g}; "
        f"specimens {scatter}, toe +- {100 * result.start:.2g} %, cross-section +- {100 * result.geometry:.2g} %"
    )
    for one in result.warnings:
        warn(f"warning: {one}")


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
        warn(f"warning: {one}")
