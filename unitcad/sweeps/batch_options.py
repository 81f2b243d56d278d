"""Options of a batch's run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from unitcad.cache import DEFAULT_LIMIT_MB, absolute
from unitcad.spec.raw import OUTPUTS
from unitcad.sweeps.shards import Shard


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
