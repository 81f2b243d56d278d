"""What `unitcad measure` writes: measured.toml, measure.json, charts and a page. The same input, the same bytes."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.lab.campaign import plain_data
from unitcad.lab.measured_charts import charts_of
from unitcad.lab.measured_page import page
from unitcad.lab.measuring import Measured
from unitcad.spec.toml import text_of

MEASURED = "measured.toml"
OURS = re.compile(r"measured\.toml|measure\.(json|html)|record-\d+-(time|periods|spectrum)\.svg|decay-\d+\.svg")
"""Names of the files that a run writes, and removes where a former run left more of them."""


def write(result: Measured, folder: Path) -> None:
    """Write all files of a result into a folder, in place of a former run's; measured.toml last. Raises OSError."""
    charts = charts_of(result)
    texts = {
        "measure.json": json.dumps(as_data(result), indent=1, allow_nan=False) + "\n",
        **charts,
        "measure.html": page(result, charts),
        MEASURED: text_of(measured_table(result)),
    }
    files.replace_all(folder, {name: text.encode() for name, text in texts.items()}, MEASURED, OURS)


def measured_table(result: Measured) -> dict[str, Any]:
    """Return measured.toml's data: a level per unit, place and chain, and the hash of every record behind them."""
    campaign = result.campaign
    units = {unit.name: unit for unit in campaign.unit}
    levels = []
    for one in result.levels:
        unit = units[one.unit]
        source = {"spec": unit.spec} if unit.spec else {"cast": unit.cast} if unit.cast else {}
        source |= {"cavity": unit.cavity} if unit.cavity else {}
        levels.append(
            {
                "unit": one.unit,
                **source,
                "distance_mm": one.distance_mm,
                "value": _short(one.level.value),
                "low": _short(one.level.low),
                "high": _short(one.level.high),
                "status": "measured",
                "chain": one.chain,
                "frequency_hz": _short(one.frequency_hz),
                "repeats": list(one.level.repeats),
                "scatter": _short(one.level.scatter),
            }
        )
    records = [
        {"unit": unit, "place": record.role, "file": record.file, "sha256": record.sha256, "usable": record.usable}
        for unit, several in result.records.items()
        for record in several
    ]
    specs = [{"file": name, "sha256": found} for name, found in result.specs.items()]
    assumed = {"assumed": result.assumed} if result.assumed else {}
    return {
        "name": campaign.name, "status": "measured", "chain": campaign.chain.use[0], "interval": 0.95, **assumed,
        "level": levels, "record": records, "source": specs,
    }  # fmt: skip


def as_data(result: Measured) -> dict[str, Any]:
    """Return everything as JSON-ready data."""
    hertz = result.campaign.chain.mains_hz
    return {
        "campaign": plain_data(result.campaign),
        "levels": measured_table(result)["level"],
        "records": [
            {"unit": unit, **record.as_dict()} for unit, several in result.records.items() for record in several
        ],
        "findings": [finding.as_dict() for finding in result.findings],
        "assumed": result.assumed,
        "mains_of_blank": _mains(result.mains, hertz),
        "mains_of_blank_motor": _mains(result.motor_mains, hertz),
    }


def _mains(blank: tuple[tuple[int, float], ...], hertz: float) -> list[dict[str, float]]:
    return [{"hz": order * hertz, "amplitude": _short(value)} for order, value in blank]


def lines(result: Measured) -> list[str]:
    """Return the levels and the records as lines for a person."""
    out = []
    for one in result.levels:
        place = "edge" if one.distance_mm == 0 else f"{one.distance_mm:g} mm"
        value = f"{one.level.value:.3f} ({one.level.low:.3f} to {one.level.high:.3f})"
        out.append(f"{one.unit}, {place}, {one.chain}: {value} of the motor's amplitude, {one.frequency_hz:.1f} Hz")
    for unit, several in result.records.items():
        for r in several:
            if not r.frequency_hz:
                out.append(f"  {unit}, {r.role}, {r.file}: not used, no line")
                continue
            gain = "".join(f", filters of {name} pass {value:.3f}" for name, value in r.gains.items())
            ratio = f", {r.ratio:.4f} of the motor" if r.ratio is not None else ""
            size = f"{r.amplitude_um:.4g} +- {2 * r.u_um:.2g} um" if r.usable else f"not used, {r.amplitude_um:.4g} um"
            out.append(
                f"  {unit}, {r.role}, {r.file}: {size}{ratio}, "
                f"{r.frequency_hz:.2f} Hz over {r.steady_s:.3g} s of {r.length_s:.3g} s, "
                f"drift {r.drift:.2%}, signal to noise {r.snr:.3g}{gain}"
            )
    for chain in result.chains:
        if chain.assumed:
            out.append(f"  chain {chain.name}, assumed: {chain.assumed_text}")
    return out


def _short(value: float) -> float:
    return float(f"{value:.6g}")
