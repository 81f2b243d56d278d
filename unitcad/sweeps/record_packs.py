"""Results in a shared store: a record of each variant, several in one pack, and the shared contents of a geometry.

A record has a variant's own files and the SHA-256 of those that it shares: about 3 kB, deflated, or 15 with an
estimate. The variants of one task make one pack: an object store charges by the request.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path

import msgspec

from unitcad import files
from unitcad.cache import Bundle, DiskStore, MissingContent, SharedStore, digest
from unitcad.errors import UnitcadError
from unitcad.json_text import json_bytes
from unitcad.pipeline.make import Product
from unitcad.pipeline.manifest import Manifest
from unitcad.pipeline.plan import code_version
from unitcad.pipeline.write import replacing, sync
from unitcad.sweeps.journal import RecordPlace

_INSIDE = re.compile(r"[^/\\:\0][^\\:\0]*")


class _Record(msgspec.Struct, frozen=True):
    own: dict[str, bytes]
    shared: dict[str, str]
    code: str


def pack(store: SharedStore, products: Sequence[Product]) -> list[RecordPlace]:
    """Write the records of some products as one pack; return the place of each. Raises OSError."""
    if not products:
        return []
    records = [
        zlib.compress(msgspec.msgpack.encode(_Record(product.own, product.shared, code_version())))
        for product in products
    ]
    name = store.keep(b"".join(records), kind="packs", anew=True)  # nobody else has it: don't ask
    places, start = [], 0
    for record in records:
        places.append(RecordPlace(pack=name, start=start, end=start + len(record), sha256=digest(record)))
        start += len(record)
    return places


def read_record(store: SharedStore, place: RecordPlace) -> tuple[Product, str]:
    """Return the product at a place, without its manifest as data, and the code that made it.

    Raises MissingContent if it is not there or damaged, UnitcadError for a record that names a file outside its
    folder, OSError if the store can't be reached.
    """
    packed = store.part(place.pack, place.start, place.end, place.sha256)
    record = msgspec.msgpack.decode(zlib.decompress(packed), type=_Record)
    for path in (*record.own, *record.shared):
        if not _INSIDE.fullmatch(path) or ".." in path.split("/"):
            raise UnitcadError(f"{store.address}: a record in pack {place.pack[:12]} names a file outside its folder")
    manifest: Manifest = msgspec.json.decode(record.own["manifest.json"])
    return Product(manifest, record.own, record.shared), record.code


def export(
    store: SharedStore,
    place: RecordPlace,
    folder: Path,
    cache: DiskStore,
    placing: Callable[[Path], AbstractContextManager[Path]] = replacing,
) -> None:
    """Make a variant's folder from its record; files that it shares are links to `cache`, which gets new contents.

    `placing` yields the fresh folder that takes the place of `folder`.
    Raises MissingContent for what the store lacks, UnitcadError for a folder that is none, OSError.
    """
    product, code = read_record(store, place)
    for sha256 in set(product.shared.values()):
        if not cache.has(sha256):
            cache.keep(store.content(sha256))
    with placing(folder) as fresh:
        product.place(fresh, cache)
        files.write_new(fresh / "timings.json", json_bytes({"code": code, "seconds": {}}))
    sync([folder])


def intact(store: SharedStore, place: RecordPlace, manifest: str) -> bool:
    """Compare the hash of everything that a variant's folder would contain; `manifest` is that of its manifest.json."""
    try:
        product, _ = read_record(store, place)
        if digest(product.own["manifest.json"]) != manifest:
            return False
        for path, listed in product.manifest["files"].items():
            content = product.own[path] if path in product.own else store.content(product.shared[path])
            if digest(content) != listed["sha256"]:
                return False
    except (MissingContent, KeyError):
        return False
    return True


def known_bundle(store: SharedStore, geometry: str) -> Bundle | None:
    """Return the bundle of a geometry that some worker has made, or None."""
    data = store.entry(_key(geometry))
    if data is None:
        return None
    store.note(data["sizes"])  # contents are written before their bundle
    return Bundle(data["data"], data["files"], data["sizes"])


def offer_bundle(store: SharedStore, geometry: str, bundle: Bundle, *, anew: bool = False) -> bool:
    """Write a geometry's bundle once its contents are there; False if another worker was first."""
    return store.enter(_key(geometry), vars(bundle), anew=anew)


@cache
def store_at(address: str) -> SharedStore:
    """Return the process's store at an address: it knows its own writes."""
    return SharedStore(address)


def _key(geometry: str) -> str:
    return digest(f"bundle {geometry}".encode())
