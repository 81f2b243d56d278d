"""The files of `unitcad material`: the table for a spec, everything as JSON, a chart of curves and fits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from unitcad.attenuation.edge.estimates import rounded
from unitcad.attenuation.layered import FractionalKelvinVoigt
from unitcad.catalogue import MaterialEntry, materials
from unitcad.export.chart import Series, chart
from unitcad.lab.dynamic import DynamicResult
from unitcad.lab.tensile import TensileResult, quasistatic
from unitcad.spec import convert
from unitcad.text import some, toml, toml_key

_SHOWN_TO = 1.2
"""Strain up to which the chart shows a curve."""


def table(tensile: TensileResult | None, dynamic: DynamicResult | None, like: str, hertz: float) -> dict[str, Any]:
    """Return the entry [materials.NAME] of a spec; `hertz` is the motor's frequency."""
    entry: dict[str, Any] = {"like": like}
    if tensile:
        source = f"{some((curve.name for curve in tensile.curves), 3)}; {quasistatic(tensile, hertz)}"
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

    def kpa(value: float | None) -> float | None:
        return None if value is None else value / 1e3

    def warnings(result: TensileResult | DynamicResult) -> list[dict[str, str]]:
        return [asdict(one) for one in result.warnings]

    if tensile:
        found["tensile"] = {
            "quasistatic": quasistatic(tensile, hertz),
            "value_kpa": kpa(tensile.value), "low_kpa": kpa(tensile.low), "high_kpa": kpa(tensile.high),
            "method": tensile.method,
            "strain_of_use": tensile.used,
            "uncertainty": {
                "methods_factor": tensile.spread, "scatter_of_specimens": tensile.scatter,
                "cross_section": tensile.geometry,
            },
            "methods": [
                {
                    "method": row.method, "value_kpa": kpa(row.value),
                    "by_specimen_kpa": list(map(kpa, row.by_specimen)),
                    "defensible": row.defensible, "reason": row.reason,
                }
                for row in tensile.rows
            ],
            "warnings": warnings(tensile),
            "files": [{"name": curve.name, "sha256": curve.sha256} for curve in tensile.curves],
        }  # fmt: skip
    if dynamic:
        curve = dynamic.curve
        found["dynamic"] = {
            "law": "E0 (1 + (i w tau)^n)",
            "static_kpa": kpa(dynamic.static), "tau_s": dynamic.tau, "n": dynamic.n, "residual": dynamic.residual,
            "measured_hz": [float(curve.frequency[0]), float(curve.frequency[-1])],
            "frequency_hz": dynamic.frequency_hz,
            "storage_kpa": kpa(dynamic.storage), "loss_factor": dynamic.loss_factor,
            "error": dynamic.error, "loss_factor_error": dynamic.loss_error, "fit_error": dynamic.fit_error,
            "extrapolated": dynamic.extrapolated, "upper_half_predicted_error": dynamic.held_out_error,
            "warnings": warnings(dynamic),
            "files": [{"name": curve.name, "sha256": curve.sha256}],
        }  # fmt: skip
    return rounded(found, 6)


def tensile_chart(name: str, result: TensileResult) -> str:
    """Draw the curves, the fitted toe up to a little beyond 100 %."""
    series = []
    for curve in result.curves:
        kept = curve.strain <= _SHOWN_TO
        series.append(Series(curve.name, 100 * curve.strain[kept], curve.stress[kept] / 1e3, points=True))
    if toe := result.toes[0]:
        strain = np.linspace(toe.origin, result.used[1] + max(toe.origin, 0.0), 60)
        series.append(Series("start, origin fitted", 100 * strain, toe.stress(strain) / 1e3))
    low, high = (100 * end for end in result.used)
    title = f"{name}: nominal stress, quasi-static; shaded: the strain of use"
    return chart(series, title, "engineering strain, %", "nominal stress, kPa", shaded=(low, high))


def dynamic_chart(name: str, result: DynamicResult, factor: float) -> str:
    """Draw storage and loss with the law, on to the motor's frequency; `factor` makes shear moduli Young's."""

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
