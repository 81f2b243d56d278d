"""Records of a batch: its identity, an entry of its journal, its summary, its preview."""

from __future__ import annotations

from typing import Any

from msgspec import Struct, field

Values = dict[str, Any]
"""Values of one variant by dotted path of the spec, or by column of the table."""


class BatchHead(Struct, frozen=True, kw_only=True):
    """Identity of a batch, at the head of its journal and of its table; `batch` is a hash over all that decides it."""

    batch: str
    name: str
    mode: str = "product"
    bases: list[str] = []
    outputs: list[str] = []
    versions: dict[str, str] = {}


class RecordPlace(Struct, frozen=True):
    """Place of a variant's record in a store: bytes `start` to `end` of a pack, and their own SHA-256."""

    pack: str
    start: int
    end: int
    sha256: str


class JournalEntry(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Result of one variant; `same_as` is the index of an earlier, equal variant, whose result it shares.

    `values` are those that were swept, `row` those that came out; `manifest` is the SHA-256 of its manifest.json.
    `record` is if a store has its files.
    """

    index: int
    status: str = ""
    reason: str = ""
    folder: str = ""
    values: Values = {}
    row: Values = {}
    manifest: str = ""
    same_as: int | None = None
    record: RecordPlace | None = None


class Failure(Struct, frozen=True):
    """A variant that was refused, failed or broke a rule, and why."""

    index: int
    status: str
    reason: str
    folder: str = ""


class Summary(Struct):
    """Outcome of a batch: variants by outcome, geometries, seconds; `stopped` is the reason of an early end.

    `resumed` counts variants that an earlier run finished, and those that equal another one.
    """

    variants: int
    done: int = 0
    resumed: int = field(default=0, name="taken_up")
    reused: int = 0
    ok: int = 0
    failed: int = 0
    geometries: int = 0
    retried: int = 0
    seconds: float = 0.0
    stopped: str = ""
    failures: list[Failure] = []
    warnings: list[str] = []


class RefusedVariant(Struct, frozen=True):
    """A variant whose spec is refused, and why."""

    index: int
    reason: str


class Preview(Struct, frozen=True, kw_only=True):
    """Size of a batch that is not made; `exact`: whether variants, geometries and parts are counts."""

    variants: int
    geometries: int
    parts: int
    exact: bool
    files: int
    stored_mb: float
    linked_mb: float
    refused_count: int
    refused: list[RefusedVariant]
    warnings: list[str] = []
