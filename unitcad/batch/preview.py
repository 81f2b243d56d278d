"""The size of a batch, without making it."""

from __future__ import annotations

from unitcad.arrays.array import Array
from unitcad.arrays.patch_moulds import patch_moulds
from unitcad.batch.batch_options import BatchOptions
from unitcad.batch.batch_records import Preview, RefusedVariant
from unitcad.batch.run import counted
from unitcad.batch.sweep import Sweep
from unitcad.batch.unread_keys import swept_estimate
from unitcad.batch.unread_keys import warnings as unread_warnings
from unitcad.cache import MemoryStore
from unitcad.errors import UnitcadError
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.bodies import body_key, groups
from unitcad.pipeline.product import checked_outputs
from unitcad.pipeline.stages import Stages
from unitcad.pipeline.subjects import Made, key_of, outputs_of, product_of

LOOKED_AT = 20_000
"""Variants whose geometry is worked out; of a larger sweep the rest is estimated in proportion."""
DRAWN, BUILT = 24, 2
"""Geometries whose parts are counted, and geometries that are made to measure their bytes."""
MOST_REFUSED = 20


def preview(sweep: Sweep, options: BatchOptions) -> Preview:
    """Count variants, distinct geometries and parts, files and megabytes.

    Every variant that is looked at is validated; `refused` holds the first ones that are refused. Raises UnitcadError
    where all are.
    """
    only = checked_outputs(options.only)
    count = counted(sweep, options.limit)
    looked = min(count, LOOKED_AT)
    geometries: dict[str, Made] = {}
    refused: list[RefusedVariant] = []
    accepted = 0
    for index in range(looked):
        try:
            spec = sweep.spec(index)
        except UnitcadError as error:
            refused.append(RefusedVariant(index, sweep.faults(index, error)))
            continue
        accepted += 1
        geometries.setdefault(key_of(spec, only, options.check), spec)
    if refused and not accepted:
        raise UnitcadError(f"every variant is refused, the first: {refused[0].reason}")
    share = count / looked
    spread = list(geometries.values())
    drawn = spread[:: max(1, len(spread) // DRAWN)][:DRAWN]
    per_drawn = _distinct_parts(drawn, only)
    weighed = [_weight(spec, only) for spec in drawn[:: max(1, len(drawn) // BUILT)][:BUILT]]
    shared, own, files = (sum(w[i] for w in weighed) / max(1, len(weighed)) for i in range(3))
    number, variants = len(geometries) * share, accepted * share
    return Preview(
        variants=count,
        geometries=round(number),
        parts=round(per_drawn * number / max(1, len(drawn))),
        exact=looked == count and len(drawn) == len(geometries),
        files=round(files * variants),
        stored_mb=round((shared * number + own * variants) / 1e6, 3),
        linked_mb=round((shared + own) * variants / 1e6, 3),
        refused_count=round(len(refused) * share),
        refused=refused[:MOST_REFUSED],
        warnings=unread_warnings(swept_estimate(sweep, count)) if "estimate" in only else [],
    )


def _distinct_parts(specs: list[Made], only: tuple[str, ...]) -> int:
    """Count the different bodies of these specs."""
    keys = set()
    for spec in specs:
        moulds = patch_moulds(spec) if isinstance(spec, Array) else MouldSet(spec)
        for group in groups(moulds, outputs_of(spec, only)):
            keys |= {body_key(moulds, body, "record") for body in group.bodies}
    return len(keys)


def _weight(spec: Made, only: tuple[str, ...]) -> tuple[int, int, int]:
    """Return (bytes shared, bytes of its own, files) of one variant, made in memory without checks."""
    store = MemoryStore()
    product = product_of(spec, only, False, store, Stages())
    shared = {sha: len(store.content(sha)) for sha in product.shared.values()}
    own = sum(map(len, product.own.values()))
    return sum(shared.values()), own, len(product.shared) + len(product.own) + 1
