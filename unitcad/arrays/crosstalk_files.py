"""The crosstalk files of an array: the data, the table of pairs, a heat map by each target, the map of the patch."""

from __future__ import annotations

import json
from typing import Any

from unitcad.arrays.array import Array
from unitcad.arrays.crosstalk_maps import heat_map_svg, patch_map_svg
from unitcad.arrays.crosstalk_matrix import crosstalk
from unitcad.arrays.crosstalk_table import crosstalk_csv
from unitcad.shape import Profile

JSON = "crosstalk.json"


def crosstalk_files(
    array: Array, circuit: Profile | None = None, data: dict[str, Any] | None = None
) -> dict[str, bytes]:
    """Return the files by their names; `circuit` is drawn on the patch, `data` what `crosstalk` gave, if it is known.

    Raises Refusal for units without an estimate.
    """
    data = data or crosstalk(array)
    return {
        JSON: (json.dumps(data, indent=1, allow_nan=False) + "\n").encode(),
        "crosstalk.csv": crosstalk_csv(array),
        "crosstalk.svg": heat_map_svg(data).encode(),
        "crosstalk-edge.svg": heat_map_svg(data, target="nearest_edge").encode(),
        "crosstalk-patch.svg": patch_map_svg(array, data, circuit).encode(),
    }
