"""Shards of a sweep: consecutive variants, for the job arrays of a cluster's scheduler.

Every shard writes the variants' folders into the batch's folder, and a journal of its own. At its end it merges all
journals and writes the tables of what is finished, so the last shard leaves the same files as one batch would.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from unitcad.errors import WrongArgument

_MOST = 9999


@dataclass(frozen=True)
class Shard:
    """Part `number` (from 1 on) of `of` parts of a sweep."""

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number}-of-{self.of}"

    def indices(self, count: int) -> range:
        """Return the indices of its variants, of `count`; the shards' numbers of variants differ by one at most."""
        return range(count * (self.number - 1) // self.of, count * self.number // self.of)


def shard_of(text: str) -> Shard:
    """Return the shard of a text such as "3/16". Raises WrongArgument."""
    found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip())
    if not found:
        raise WrongArgument("shard", text, "needs the number of a shard and that of all, as in 3/16", "1/2")
    number, of = int(found[1]), int(found[2])
    if not 1 <= of <= _MOST:
        raise WrongArgument("shard", text, f"needs 1 to {_MOST} shards", f"1/{min(max(of, 1), _MOST)}")
    if not 1 <= number <= of:
        raise WrongArgument("shard", text, f"shards of {of} have numbers 1 to {of}", f"{min(max(number, 1), of)}/{of}")
    return Shard(number, of)
