"""The files of an array's common circuit, for whoever draws its copper, cuts it or places the motors."""

from __future__ import annotations

from unitcad.arrays.array import Array
from unitcad.arrays.circuit.circuit_dxf import circuit_dxf
from unitcad.arrays.circuit.circuit_svg import circuit_svg
from unitcad.arrays.circuit.kicad_board import kicad_board
from unitcad.arrays.circuit.outline import outline
from unitcad.arrays.circuit.pad_table import pad_table
from unitcad.arrays.circuit.wiring import wiring
from unitcad.arrays.construction import construction_of
from unitcad.errors import Missing

DXF = "circuit.dxf"


def has_circuit(array: Array) -> bool:
    """Tell whether one circuit joins all motors: where the units have no tails of their own."""
    return not construction_of(array.construction, array.cast).own_tails


def circuit_files(array: Array) -> tuple[dict[str, bytes], dict[str, str]]:
    """Return the files by their names, and why one was left out: DXF needs ezdxf. Raises Refusal as `outline`."""
    if not has_circuit(array):
        return {}, {}
    laid = wiring(array)
    drawn = outline(array, laid)
    files = {
        "circuit.svg": circuit_svg(laid, drawn).encode(),
        "circuit.kicad_pcb": kicad_board(laid, drawn),
        "circuit-pads.csv": pad_table(array, laid),
    }
    try:
        return {**files, DXF: circuit_dxf(laid, drawn)}, {}
    except Missing as missing:
        return files, {DXF: str(missing)}
