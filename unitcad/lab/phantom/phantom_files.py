"""A phantom's folder: printable pieces, procedure, bench sheet, tissue entry, expected response; checked as meshes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from unitcad import files
from unitcad.attenuation.edge.estimates import rounded
from unitcad.casting.bill import to_csv
from unitcad.catalogue import printers
from unitcad.export import printing, svg, threemf
from unitcad.export.chart import Series, chart
from unitcad.export.printing import print_ready
from unitcad.export.raster import Surface, draw
from unitcad.kernels.mesh import arrays, bounds, realise
from unitcad.lab.phantom import SEGMENTS, PhantomSet, bench, printed, tissue_table
from unitcad.meshcheck import Options, check_file
from unitcad.shape.body import Body
from unitcad.text import toml, toml_key

APART_MM = 14.0
"""Between two pieces of the box taken apart."""
FINISHED = "casting.md"
"""The file that is put in place last: a folder that has it is whole."""


def contents(phantom: PhantomSet, stage: Callable[[str], None] = lambda name: None) -> dict[str, bytes]:
    """Return the files of a phantom's folder by their names, the pieces as STL and one 3MF."""
    found: dict[str, bytes] = {}
    parts = []
    for body in printed(phantom.tools):
        stage(body.name)
        ready = print_ready(*arrays(realise(body.shape, SEGMENTS)), body.upside_down)
        found[f"moulds/{body.name}.stl"] = printing.stl(*ready, body.name)
        parts.append(threemf.MeshPart(body.name, body.colour, *ready))
    bed = float(phantom.printer.bed_x_mm), float(phantom.printer.bed_y_mm)
    found["moulds/moulds.3mf"] = threemf.content(parts, bed)
    stage("pages")
    # The box filled, cut through the pegs of one side and, of the lid, nothing: frames, layers and plate.
    shown = [body for body in phantom.tools if body.kind in ("base", "frame") or body.made == "cut"]
    regions = svg.cut([*shown, *phantom.layers], SEGMENTS)
    texts = {
        "section.svg": svg.section(regions, title=f"Phantom {phantom.table.name}: box and layers", ground=""),
        "response.svg": _response_chart(phantom),
        "response.json": json.dumps(rounded(asdict(phantom.expected)), indent=1, allow_nan=False) + "\n",
        "tissue.toml": tissue_toml(phantom),
        "casting.json": json.dumps(rounded(casting_data(phantom)), indent=1, allow_nan=False, ensure_ascii=False)
        + "\n",
        "bom.csv": to_csv(tuple(bench.bill(phantom))),
        "sheet.md": bench.sheet_markdown(phantom),
        FINISHED: bench.casting_markdown(phantom),
    }
    return {**found, **{name: text.encode() for name, text in texts.items()}}


def box_picture(phantom: PhantomSet) -> bytes:
    """Draw the box taken apart as a PNG file."""
    shown = [body for body in phantom.tools if body.kind != "blade"]

    def place(body: Body) -> tuple[float, bool]:
        """Return a body's place in the stack: its top's height, but the tray's foot, and a layer after its frame."""
        _, _, low, _, _, high = bounds(realise(body.shape, SEGMENTS))
        return (low if body.kind in ("base", "holder") else high, body.kind == "layer")

    bodies = sorted([*shown, *phantom.layers], key=place)
    parts, height = [], 0.0
    for body in bodies:
        vertices, faces = arrays(realise(body.shape, SEGMENTS))
        low, high = vertices[:, 2].min(), vertices[:, 2].max()
        parts.append(Surface(vertices + np.array([0.0, 0.0, height - low]), faces, body.colour, body.name))
        height += (high - low) + APART_MM
    return draw(parts, (1.0, -2.0, 0.7), (1200, 900))


def tissue_toml(phantom: PhantomSet) -> str:
    """Return [tissue.NAME] for a spec, which chooses it by estimate.tissue."""
    name = toml_key(f"phantom-{phantom.table.name}")
    lines = [
        "# For a spec: paste it there, and choose it:",
        "# [estimate]",
        f'# tissue = "phantom-{phantom.table.name}"',
    ]
    for layer, table in tissue_table(phantom).items():
        lines += ["", f"[tissue.{name}.{toml_key(layer)}]", *(f"{key} = {toml(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def casting_data(phantom: PhantomSet) -> dict[str, Any]:
    """Return recipe, pours and lengths as JSON-ready data."""
    return {
        "name": phantom.table.name,
        "inside_mm": phantom.inside_mm,
        "printer": phantom.printer.name,
        "pours": [asdict(pour) for pour in bench.pours(phantom)],
        "recipes": [
            {
                "layer": layer.name,
                "silicone": one.silicone.name,
                "thinner_pct": one.thinner_pct,
                "modulus_kpa": one.modulus_kpa,
                "low_kpa": one.low_kpa,
                "high_kpa": one.high_kpa,
                "density_g_cm3": one.density_g_cm3,
                "source": one.source,
                "loss_factor": list(one.loss),
            }
            for layer, one in zip(phantom.table.layers, phantom.recipes, strict=True)
        ],
        "bill": [asdict(item) for item in bench.bill(phantom)],
    }


def write(folder: Path, found: Mapping[str, bytes], printer: str) -> list[str]:
    """Write the files into a folder, then check the meshes there; return the findings that are errors, as lines.

    All are written under another name first; the procedure is put in place last. Raises OSError if that fails.
    """
    files.replace_all(folder, found, FINISHED)
    meshes = sorted(str(folder / name) for name in found if name.endswith((".stl", ".3mf")))
    options = Options(printer=printers()[printer])
    return [
        f"{Path(path).name}: {finding.code} {finding.message}"
        for path in meshes
        for finding in check_file(path, options).findings
        if finding.severity == "error"
    ]


def _response_chart(phantom: PhantomSet) -> str:
    e = phantom.expected
    series = [
        Series("expected", e.distances_mm, e.value),
        Series("low", e.distances_mm, e.low, dashed=True),
        Series("high", e.distances_mm, e.high, dashed=True),
        Series("the forearm template", e.distances_mm, e.forearm),
    ]
    title = (
        f"Phantom {phantom.table.name} at {phantom.table.frequency_hz:g} Hz: |u_z| over its value at the unit's edge"
    )
    return chart(series, title, "distance from the unit's edge, mm", "|u_z| / |u_z| at the edge", log_y=True)
