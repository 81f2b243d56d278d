"""What `unitcad material` writes: the table for a spec, everything as JSON, a chart of curves and fits."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from unitcad import files
from unitcad.attenuation.edge.estimates import rounded
from unitcad.catalogue import MaterialEntry, materials
from unitcad.errors import UnitcadError
from unitcad.export.chart import Series, chart
from unitcad.lab.dynamic_test import DynamicResult
from unitcad.lab.tensile_result import TensileResult, quasistatic
from unitcad.text import toml, toml_key

_NAMED = 3
"""Files that a source names; of further ones it gives the count."""
_SHOWN_TO = 1.2
"""Strain up to which the chart shows a curve, beyond the fits' 100 %."""


def table(tensile: TensileResult | None, dynamic: DynamicResult | None, like: str, hertz: float) -> dict[str, Any]:
    """Return the entry [materials.NAME] of a spec; `hertz` is the motor's frequency."""
    entry: dict[str, Any] = {"like": like}
    if tensile:
        source = f"{_named([curve.name for curve in tensile.curves])}; {quasistatic(tensile, hertz)}"
        entry["quasistatic_modulus_kpa"] = _value(
            tensile.value / 1e3, tensile.low / 1e3, tensile.high / 1e3, tensile.method, source
        )
        at_100 = next(row for row in tensile.rows if row.method.startswith("secant at 100 %"))
        if at_100.value is not None and at_100.value > 0:
            widened = float(np.exp(np.hypot(tensile.scatter or 0.0, tensile.geometry)))
            entry["modulus_100pct_kpa"] = _value(
                at_100.value / 1e3, at_100.value / widened / 1e3, at_100.value * widened / 1e3, at_100.method, source
            )
    if dynamic:
        entry.update(_dynamic(dynamic))
    return entry


def expect_loadable(name: str, entry: Mapping[str, Any]) -> None:
    """Hold the entry to the catalogue's own types and limits, as a spec would. Raises Refusal."""
    from unitcad.spec import convert

    materials({name: convert(dict(entry), MaterialEntry, f"materials.{name}")})


def material_toml(name: str, entry: Mapping[str, Any], comments: tuple[str, ...]) -> str:
    """Return the table as TOML, after comments; it may be pasted into a spec."""
    lines = [*(f"# {comment}" for comment in comments), "", f"[materials.{toml_key(name)}]"]
    return "\n".join([*lines, *(f"{key} = {toml(value)}" for key, value in entry.items())]) + "\n"


def data(
    name: str, entry: Mapping[str, Any], tensile: TensileResult | None, dynamic: DynamicResult | None, hertz: float
) -> dict[str, Any]:
    """Return everything as JSON-ready data; moduli in kPa, strains as fractions."""
    found: dict[str, Any] = {"material": name, "table": dict(entry)}
    if tensile:
        found["tensile"] = {
            "quasistatic": quasistatic(tensile, hertz),
            "value_kpa": tensile.value / 1e3,
            "low_kpa": tensile.low / 1e3,
            "high_kpa": tensile.high / 1e3,
            "method": tensile.method,
            "strain_of_use": list(tensile.used),
            "uncertainty": {
                "methods_factor": tensile.spread,
                "scatter_of_specimens": tensile.scatter,
                "cross_section": tensile.geometry,
            },
            "methods": [
                {
                    "method": row.method,
                    "value_kpa": None if row.value is None else row.value / 1e3,
                    "by_specimen_kpa": [None if one is None else one / 1e3 for one in row.by_specimen],
                    "defensible": row.defensible,
                    "reason": row.reason,
                }
                for row in tensile.rows
            ],
            "fits": [
                {
                    "file": curve.name,
                    "law": one.method,
                    "constants": dict(one.fit.constants),
                    "residual": one.fit.residual,
                }
                for curve, methods in zip(tensile.curves, tensile.by_curve, strict=True)
                for one in methods
                if one.fit
            ],
            "warnings": [{"code": one.code, "message": one.message} for one in tensile.warnings],
            "files": [{"name": curve.name, "sha256": curve.sha256} for curve in tensile.curves],
        }
    if dynamic:
        found["dynamic"] = {
            "law": "E0 (1 + (i w tau)^n)",
            "static_kpa": dynamic.static / 1e3,
            "tau_s": dynamic.tau,
            "n": dynamic.n,
            "residual": dynamic.residual,
            "measured_hz": [float(dynamic.curve.frequency[0]), float(dynamic.curve.frequency[-1])],
            "frequency_hz": dynamic.frequency_hz,
            "storage_kpa": dynamic.storage / 1e3,
            "loss_factor": dynamic.loss_factor,
            "error": dynamic.error,
            "loss_factor_error": dynamic.loss_error,
            "fit_error": dynamic.fit_error,
            "extrapolated": dynamic.extrapolated,
            "upper_half_predicted_error": dynamic.held_out_error,
            "warnings": [{"code": one.code, "message": one.message} for one in dynamic.warnings],
            "files": [{"name": dynamic.curve.name, "sha256": dynamic.curve.sha256}],
        }
    return rounded(found)


def tensile_chart(name: str, result: TensileResult) -> str:
    """Draw the curves, the fitted toe and the first specimen's laws, up to a little beyond the fits."""
    series = []
    for curve in result.curves:
        kept = curve.strain <= _SHOWN_TO
        series.append(Series(curve.name, 100 * curve.strain[kept], curve.stress[kept] / 1e3, points=True))
    if toe := result.toes[0]:
        strain = np.linspace(toe.origin, result.used[1] + max(toe.origin, 0.0), 60)
        series.append(Series("start, origin fitted", 100 * strain, toe.stress(strain) / 1e3))
    laws = [one for one in result.by_curve[0] if one.fit and one.fit.up_to <= _SHOWN_TO]
    for i, one in enumerate(laws):
        if one.fit:
            strain = np.linspace(0.0, one.fit.up_to, 100)
            dashed = bool(one.fit.unstable)
            width = 1.8 * (len(laws) - i)  # laws that agree lie on each other: each shows beside the next
            label = one.method + (", unstable" if dashed else "")
            series.append(Series(label, 100 * strain, one.fit.stress(strain) / 1e3, dashed=dashed, width=width))
    low, high = (100 * end for end in result.used)
    title = f"{name}: nominal stress, quasi-static; shaded: the strain of use"
    return chart(series, title, "engineering strain, %", "nominal stress, kPa", shaded=(low, high))


def dynamic_chart(name: str, result: DynamicResult, factor: float) -> str:
    """Draw storage and loss with the law, on to the motor's frequency; `factor` makes shear moduli Young's."""
    from unitcad.attenuation.layered.rheology import FractionalKelvinVoigt

    curve, law = result.curve, FractionalKelvinVoigt(result.tau, result.n)
    ends = min(curve.frequency[0], result.frequency_hz), max(curve.frequency[-1], result.frequency_hz)
    hertz = np.geomspace(*ends, 120)
    modulus = [law.complex_shear(result.static, 2 * np.pi * float(one)) for one in hertz]
    series = [
        Series("storage", curve.frequency, factor * curve.storage / 1e3, points=True),
        Series("loss", curve.frequency, factor * curve.loss / 1e3, points=True),
        Series("storage, fractional Kelvin-Voigt", hertz, [one.real / 1e3 for one in modulus]),
        Series("loss, fractional Kelvin-Voigt", hertz, [one.imag / 1e3 for one in modulus]),
    ]
    title = f"{name}: Young's modulus over frequency{'; shaded: extrapolated' if result.extrapolated else ''}"
    nearest = curve.frequency[-1] if result.frequency_hz > curve.frequency[-1] else curve.frequency[0]
    low, high = sorted((float(nearest), result.frequency_hz))
    shaded = (low, high) if result.extrapolated else None
    return chart(series, title, "frequency, Hz", "modulus, kPa", log_x=True, log_y=True, shaded=shaded)


def write(folder: Path, contents: Mapping[str, str]) -> None:
    """Write all files, or none: each is written under another name first. Raises UnitcadError where that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with files.scratch(folder) as fresh:
            for name, text in contents.items():
                files.write_new(fresh / name, text.encode())
            for name in contents:
                (fresh / name).replace(folder / name)
    except OSError as error:
        raise UnitcadError(f"{folder}: {error.strerror or error}") from None


def json_text(found: Mapping[str, Any]) -> str:
    """Return the data as the text of a JSON file."""
    return json.dumps(found, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _dynamic(result: DynamicResult) -> dict[str, Any]:
    low, high = (float(np.exp(sign * result.error)) for sign in (-1, 1))
    narrow, wide = (float(np.exp(sign * result.loss_error)) for sign in (-1, 1))
    ends = result.curve.frequency[0], result.curve.frequency[-1]
    way = "extrapolated from" if result.extrapolated else "within"
    source = f"{result.curve.name}, {result.frequency_hz:g} Hz, {way} {ends[0]:g} to {ends[1]:g} Hz"
    method = "storage modulus of a fractional Kelvin-Voigt law"
    storage, loss = result.storage / 1e3, result.loss_factor
    rest = {"status": "measured", "source": source, "method": "fractional Kelvin-Voigt law"}
    return {
        "youngs_modulus_kpa": _value(storage, storage * low, storage * high, method, source),
        "loss_factor": _value(loss, loss * narrow, loss * wide, "loss over storage of the same law", source),
        "fractional_mu0_kpa": {"value": _four(result.static / 3e3), **rest},
        "fractional_tau_us": {"value": _four(result.tau * 1e6), **rest},
        "fractional_n": {"value": _four(result.n), **rest},
    }


def _value(value: float, low: float, high: float, method: str, source: str) -> dict[str, Any]:
    return {
        "value": _four(value),
        "low": _four(low),
        "high": _four(high),
        "status": "measured",
        "method": method,
        "source": source[:500],
    }


def _four(value: float) -> float:
    return float(f"{value:.4g}")


def _named(names: list[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")
