"""The size of a batch, without making it."""

from __future__ import annotations

import zlib

from unitcad.cache import MemoryStore
from unitcad.errors import UnitcadError
from unitcad.pipeline.make import Progress, Subject
from unitcad.pipeline.plan import body_key, checked_outputs, groups
from unitcad.pipeline.subjects import subject
from unitcad.sweeps.batch_options import BatchOptions
from unitcad.sweeps.batch_records import Preview, RefusedVariant
from unitcad.sweeps.insensitive_keys import swept_estimate
from unitcad.sweeps.insensitive_keys import warnings as insensitive_warnings
from unitcad.sweeps.result_folders import folders_wanted
from unitcad.sweeps.results import tables_of
from unitcad.sweeps.run import NEXT, counted
from unitcad.sweeps.sweep import Sweep

LOOKED_AT = 20_000
"""Variants whose geometry is worked out; of a larger sweep the rest is estimated in proportion."""
DRAWN, BUILT = 24, 2
"""Geometries whose parts are counted, and geometries that are made to measure their bytes."""
MOST_REFUSED = 20
ROW_BYTES = {"csv": 100, "json": 300, "parquet": 8}
"""Of a variant in a table, about: as in tables of estimates with two swept values."""


def preview(sweep: Sweep, options: BatchOptions) -> Preview:
    """Count variants, distinct geometries and parts, files and megabytes: of a shard its own, if one is asked for.

    Every counted variant is validated; `refused` has the first refusals. Raises UnitcadError
    if all are.
    """
    only = checked_outputs(options.only)
    whole = counted(sweep, options.limit)
    indices = options.shard.indices(whole) if options.shard else range(whole)
    count = len(indices)
    looked = min(count, LOOKED_AT)
    geometries: dict[str, Subject] = {}
    refused: list[RefusedVariant] = []
    accepted = 0
    for index in indices[:looked]:
        try:
            variant = subject(sweep.spec(index))
        except UnitcadError as error:
            refused.append(RefusedVariant(index, sweep.faults(index, error)))
            continue
        accepted += 1
        geometries.setdefault(variant.key(only, options.check), variant)
    if refused and not accepted:
        raise UnitcadError(f"every variant is refused, the first: {refused[0].reason}")
    share = count / max(looked, 1)
    tables = tables_of(count, options.tables)
    spread = list(geometries.values())
    drawn = spread[:: max(1, len(spread) // DRAWN)][:DRAWN]
    per_drawn = _distinct_parts(drawn, only)
    number, variants = len(geometries) * share, accepted * share
    if only == ("estimate",) and not sweep.of_compounds:
        files, stored, linked = 0.0, 0.0, 0.0
    else:
        weighed = [_weight(variant, only) for variant in drawn[:: max(1, len(drawn) // BUILT)][:BUILT]]
        shared, own, packed, contents, each = (sum(w[i] for w in weighed) / max(1, len(weighed)) for i in range(5))
        linked = (shared + own) * variants
        if folders_wanted(options, count):
            files, stored = each * variants, shared * number + own * variants
        else:  # a store's: the shared contents of a geometry, and packs of its records
            files, stored = (contents + 1) * number + variants / NEXT, shared * number + packed * variants
    rows = sum(ROW_BYTES[name] for name in tables) * count
    return Preview(
        variants=count,
        geometries=round(number),
        parts=round(per_drawn * number / max(1, len(drawn))),
        exact=looked == count and len(drawn) == len(geometries),
        files=round(files) + len(tables),
        stored_mb=round((stored + rows) / 1e6, 3),
        linked_mb=round((linked + rows) / 1e6, 3),
        refused_count=round(len(refused) * share),
        refused=refused[:MOST_REFUSED],
        warnings=insensitive_warnings(swept_estimate(sweep, whole)) if "estimate" in only else [],
    )


def _distinct_parts(variants: list[Subject], only: tuple[str, ...]) -> int:
    """Count the different bodies of these variants."""
    keys = set()
    for variant in variants:
        moulds = variant.moulds
        for group in groups(moulds, variant.outputs(only)):
            keys |= {body_key(moulds, body, "record") for body in group.bodies}
    return len(keys)


def _weight(variant: Subject, only: tuple[str, ...]) -> tuple[int, int, int, int, int]:
    """Return (bytes shared, its own, its own deflated, contents, files) of a variant made in memory, without checks."""
    store = MemoryStore()
    product = variant.make(only, False, store, Progress())
    shared = {sha: len(store.content(sha)) for sha in product.shared.values()}
    own = sum(map(len, product.own.values()))
    packed = len(zlib.compress(b"".join(product.own.values())))
    return sum(shared.values()), own, packed, len(shared), len(product.shared) + len(product.own) + 1
