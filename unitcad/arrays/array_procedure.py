"""How an array is cast: the procedure of its construction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from unitcad.arrays.patch_moulds import PatchMoulds
from unitcad.casting.procedure import Procedure


def array_procedure(
    moulds: PatchMoulds, layer_volumes_mm3: Sequence[float], printed_mm3: float, of_units: Mapping[str, Procedure]
) -> Procedure:
    """Return the procedure of an array's construction.

    layer_volumes_mm3: a volume a pour of the sheet's tools; printed_mm3: volume of these tools; of_units: the procedure
    of each distinct unit by its folder, read where units are cast apart.
    """
    way = moulds.construction
    if way.own_tails:
        from unitcad.arrays.pocket_procedure import pocket_procedure

        return pocket_procedure(moulds, layer_volumes_mm3[0], printed_mm3, of_units)
    if way.cast == "curved":
        from unitcad.arrays.curved_procedure import curved_procedure

        return curved_procedure(moulds, layer_volumes_mm3, printed_mm3)
    from unitcad.arrays.back_sheet_procedure import back_sheet_procedure

    return back_sheet_procedure(moulds, layer_volumes_mm3, printed_mm3)
