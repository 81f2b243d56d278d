"""The JSON Schema of an array file: the layout's keys are those of one of the kinds."""

from __future__ import annotations

from typing import Any

import msgspec

from unitcad.arrays.array_tables import AskedArray
from unitcad.arrays.layouts import layouts


def schema() -> dict[str, Any]:
    """Return the JSON Schema of `AskedArray`; its layout is one of the kinds, each with its own keys."""
    document = msgspec.json.schema(AskedArray)
    kinds = [kind.table for kind in layouts().values()]
    tables, definitions = msgspec.json.schema_components(kinds, ref_template="#/$defs/{name}")
    for table in definitions.values():
        table["required"] = ["kind", *table.get("required", ())]
    defs = {**document["$defs"], **definitions}
    array = dict(defs["AskedArray"])
    about = array["properties"]["layout"].get("description", "")
    array["properties"] = {**array["properties"], "layout": {"description": about, "oneOf": list(tables)}}
    return {**document, "$defs": {**defs, "AskedArray": array}}
