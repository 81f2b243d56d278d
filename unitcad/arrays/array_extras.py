"""The files that an array has beside its units, patch and tools: circuit and crosstalk."""

from __future__ import annotations

from collections.abc import Sequence

from unitcad.arrays.array import Array
from unitcad.arrays.circuit.circuit_files import circuit_files, has_circuit
from unitcad.arrays.circuit.outline import circuit_body, outline
from unitcad.arrays.crosstalk_files import JSON, crosstalk_files
from unitcad.errors import Missing, Refusal

CROSSTALK = JSON
STEP = "circuit.step"


def extras(array: Array, only: Sequence[str]) -> tuple[dict[str, bytes], dict[str, str]]:
    """Return circuit and crosstalk files by their paths, as the outputs `only` ask for, and why one was left out.

    Raises Refusal for a circuit that does not fit.
    """
    files: dict[str, bytes] = {}
    lacking: dict[str, str] = {}
    if "unit" in only:
        files, lacking = circuit_files(array)
        if files and "step" in array.unit.output.formats:
            try:
                from unitcad.export.step import content

                files[STEP] = content([circuit_body(array)], "circuit")
            except Missing as missing:
                lacking[STEP] = str(missing)
    if "estimate" in only:
        try:
            files |= crosstalk_files(array, outline(array) if has_circuit(array) else None)
        except Refusal as refusal:
            lacking[CROSSTALK] = str(refusal)
    return files, lacking
