"""The near end of workers that don't share our disk: what they hand back is kept, and put in place."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from unitcad.batch import task as tasks
from unitcad.batch.task import VariantOutcome
from unitcad.cache import Bundle, DiskStore, digest
from unitcad.files import write_new
from unitcad.pipeline.folder import replacing, sync
from unitcad.pipeline.versions import code_version


class Receiver:
    """Keeps what comes back in a store: contents once each, and by geometry what a worker need not make again."""

    def __init__(self, out: Path, store: DiskStore) -> None:
        self.out, self.store = out, store

    def known(self, geometry: str) -> Bundle | None:
        """What is here of a geometry, or None where any of it is missing."""
        found = self.store.peek(_key(geometry))
        if found is None or not all(map(self.store.has, found["files"].values())):
            return None
        return Bundle(found["data"], found["files"], found["sizes"])

    def place(self, outcome: VariantOutcome, geometry: str) -> VariantOutcome:
        """Put a variant's files into its folder; the outcome without them. Raises OSError."""
        assert outcome.product is not None
        try:
            for content in outcome.contents.values():
                self.store.keep(content)
            if outcome.bundle and all(map(self.store.has, outcome.bundle.files.values())):
                self.store.forget(_key(geometry))
                self.store.data(_key(geometry), lambda: vars(outcome.bundle))
            folder = self.out / outcome.folder
            timings = {"code": code_version(), "seconds": {"all": round(outcome.seconds, 4)}}
            with replacing(folder) as fresh:
                outcome.product.place(fresh, self.store)
                write_new(fresh / "timings.json", (json.dumps(timings) + "\n").encode())
            sync([folder])
        except OSError:
            raise
        except Exception as error:
            return tasks.failure(outcome.index, error)
        return replace(outcome, product=None, contents={}, bundle=None)


def _key(geometry: str) -> str:
    return digest(f"remote {geometry}".encode())
