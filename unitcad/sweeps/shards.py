"""Shards of a sweep: consecutive parts with a parent and a journal each; and the options of a batch's run.

<out>/store                   the store of all shards, unless another one is named
<out>/shard-03-of-16/         a batch of its own, and shard.json, which names the whole
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from unitcad import files
from unitcad.cache import DEFAULT_LIMIT_MB, absolute
from unitcad.errors import UnitcadError, WrongArgument
from unitcad.pipeline.write import STORE
from unitcad.spec.raw import OUTPUTS
from unitcad.sweeps.destination import resolve_address
from unitcad.sweeps.journal import SHARDS, BatchHead, batch_in
from unitcad.sweeps.sweep import Sweep
from unitcad.text import some

RECORD = "shard.json"
MOST_SHARDS = 9999
_SHARD = re.compile(r"(\d{1,9})/(\d{1,9})")
_FOLDER = re.compile(r"shard-\d+-of-\d+")


@dataclass(frozen=True)
class Shard:
    """Part `number` (from 1 on) of `of` parts of a sweep."""

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    @property
    def folder(self) -> str:
        """Name of the shard's folder below the batch's."""
        width = len(str(self.of))
        return f"shard-{self.number:0{width}}-of-{self.of}"

    def indices(self, count: int) -> range:
        """Return the indices of its variants, of `count`: as many in each shard as in the others, or one less."""
        return range(count * (self.number - 1) // self.of, count * self.number // self.of)


def shard_of(text: str) -> Shard:
    """Return the shard of a text such as "3/16". Raises WrongArgument."""
    found = _SHARD.fullmatch(text.strip())
    if not found:
        raise WrongArgument("shard", text, "needs a number of all shards, as in 3/16", "1/2")
    number, of = int(found[1]), int(found[2])
    if not 1 <= of <= MOST_SHARDS:
        raise WrongArgument("shard", text, f"needs 1 to {MOST_SHARDS} shards", f"1/{min(max(of, 1), MOST_SHARDS)}")
    if not 1 <= number <= of:
        raise WrongArgument(
            "shard", text, f"the shards of {of} are numbered 1 to {of}", f"{min(max(number, 1), of)}/{of}"
        )
    return Shard(number, of)


class ShardRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Content of shard.json: which part of which batch it is. `variants` are all of the batch's, `head` is its head."""

    number: int
    of: int
    variants: int
    head: BatchHead
    shard_head: BatchHead
    code: str
    store: str
    sweep: Sweep

    @property
    def indices(self) -> range:
        """Return the indices of the shard's variants."""
        return Shard(self.number, self.of).indices(self.variants)


def write_shard(folder: Path, record: ShardRecord) -> None:
    """Write a shard's record into its folder. Raises OSError."""
    files.write(folder / RECORD, msgspec.json.encode(record) + b"\n")


def shard_folders(out: Path) -> list[Path]:
    """List the shards' folders below a batch's folder."""
    return sorted(path for path in out.glob(SHARDS) if _FOLDER.fullmatch(path.name) and path.is_dir())


def store_of(out: Path, shard: Shard, batch: str, variants: int, asked: str | None) -> str:
    """Return the address of the store of all shards in `out`: the one `asked` for, the shard's or the others', or new.

    Refuses early what a merge would refuse: raises UnitcadError if `out` has another batch than this one of so many
    variants, shards of another number, or shards with another store.
    """
    held = batch_in(out)
    if held not in (None, batch):
        raise UnitcadError(f"{out}: has another batch, so shards can not be merged there; choose another with -o")
    kept, own = None, out / shard.folder
    if asked is None and (begun := _record(own)) is not None:
        asked = resolve_address(own, begun.store)
    for other in shard_folders(out):
        of = int(other.name.rpartition("-")[2])
        if of != shard.of:
            raise UnitcadError(
                f"{out}: has shards of {of} ({other.name}), with which one of {shard.of} can't be merged; go on with "
                f"--shard K/{of}, or choose another folder with -o"
            )
        if other == own or (record := _record(other)) is None:
            continue
        if (record.head.batch, record.variants) != (batch, variants):
            raise UnitcadError(
                f"{out}: {other.name} is of another batch (sweep, --set, --only, --no-check or --limit), so this shard "
                "can't be merged with it; run it as that one was, or choose another folder with -o"
            )
        kept = resolve_address(other, record.store)
        if asked is not None and absolute(asked) != kept:
            raise UnitcadError(
                f"{out}: {other.name} has its results in the store {kept}, so this shard can't have them in "
                f"{asked}; leave --store out, or choose another folder with -o"
            )
    return asked or kept or str((out / STORE).absolute())


def _record(folder: Path) -> ShardRecord | None:
    """Return a shard's record; None if there is none yet, or a damaged one, which a merge names."""
    try:
        return _read(folder)
    except (UnitcadError, msgspec.MsgspecError):
        return None


def _read(folder: Path) -> ShardRecord:
    content = files.read(folder / RECORD, largest=files.LARGEST_TABLE, links=False)
    return msgspec.json.decode(content, type=ShardRecord)


def read_shards(folders: Sequence[Path]) -> list[tuple[Path, ShardRecord]]:
    """Return the records of all shards of one batch, in order.

    Raises UnitcadError if one is missing, there twice, or of another batch.
    """
    if not folders:
        raise UnitcadError("SHARD...: is required: folders of shards, or their common parent; see unitcad batch --help")
    records: dict[int, tuple[Path, ShardRecord]] = {}
    for folder in folders:
        try:
            record = _read(folder)
        except files.NotThere:
            why = f"is not a shard of a batch (no {RECORD})" if folder.is_dir() else "no such folder"
            raise UnitcadError(f"{folder}: {why}") from None
        except msgspec.MsgspecError as error:
            raise UnitcadError(
                f"{folder / RECORD}: damaged: {error}; the shard's own command writes it again"
            ) from None
        first_folder, first = next(iter(records.values()), (folder, record))
        if (record.head.batch, record.of, record.variants) != (first.head.batch, first.of, first.variants):
            raise UnitcadError(
                f"{folder}: is a shard of another batch than {first_folder} (sweep, options or number of shards); "
                "name the folders of the shards to merge, or remove the wrong one and run that shard again"
            )
        if record.code != first.code:
            raise UnitcadError(f"{folder}: was made by unitcad {record.code}, {first_folder} by {first.code}")
        if record.number in records:
            raise UnitcadError(f"{folder}: is shard {record.number}/{record.of}, as is {records[record.number][0]}")
        records[record.number] = folder, record
    of = next(iter(records.values()))[1].of
    missing = [number for number in range(1, of + 1) if number not in records]
    if missing:
        named = some((f"{number}/{of}" for number in missing), 5)
        are = "is" if len(missing) == 1 else "are"
        them = "it" if len(missing) == 1 else "them"
        raise UnitcadError(f"{len(missing)} of {of} shards {are} missing: {named}; run {them} with --shard, then merge")
    return [records[number] for number in sorted(records)]


@dataclass(frozen=True)
class BatchOptions:
    """Options of a run.

    `timeout` in seconds a variant; `limit` variants at most; `cache_mb` kept at the end; `verify` compares the hashes
    of finished variants, not only their sizes. `store` is the address (a folder, s3://bucket/path)
    of a store that workers write to; with `folders` each variant also has its folder, with None if there are few.
    `tables` are names of results.TABLES, None chooses by the number of variants. `shard` is a part of the sweep.
    Raises WrongArgument for an address that is no store's.
    """

    only: Sequence[str] = OUTPUTS
    check: bool = True
    keep_going: bool = False
    timeout: float | None = None
    limit: int | None = None
    cache: Path | None = None
    cache_mb: float = DEFAULT_LIMIT_MB
    verify: bool = False
    store: str | None = None
    folders: bool | None = None
    tables: Sequence[str] | None = None
    shard: Shard | None = None

    def __post_init__(self) -> None:
        if self.store is not None:
            absolute(self.store)
