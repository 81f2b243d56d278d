"""Content kept under a key, so that each distinct piece of work is done once.

A key is a hash of all that the work reads. It names either data (JSON) or the SHA-256 of a file's content; equal
contents are kept once. `MemoryStore` keeps them for one build, `DiskStore` for all who share a folder:

    <root>/unitcad-cache          marks the folder as a cache of unitcad
    <root>/data/ab/<key>          checksum, newline, JSON
    <root>/files/ab/<key>         checksum, newline, JSON {"sha256", "size"}
    <root>/content/ab/<sha256>    the bytes, read-only, since results are hard links to them
    <root>/unitcad-cache.lock     locked while a store opens, and while one process collects
    <root>/locks/<key>            locked by the process that makes the entry
    <root>/locks/open-<id>        locked by each process that has the cache open
    <root>/tmp/                   files being written
"""

from unitcad.cache.disk import DEFAULT_LIMIT_MB, DiskStore, Usage, collect, default_root, held, is_free, usage
from unitcad.cache.store import MemoryStore, MissingContent, Store, digest

__all__ = [
    "DEFAULT_LIMIT_MB",
    "DiskStore",
    "MemoryStore",
    "MissingContent",
    "Store",
    "Usage",
    "collect",
    "default_root",
    "digest",
    "held",
    "is_free",
    "usage",
]
