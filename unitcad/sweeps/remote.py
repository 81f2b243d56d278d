"""The caller's side of remote workers, which don't share its disk: it keeps their results and puts them in place."""

from __future__ import annotations

import json
from dataclasses import replace

from unitcad.cache import Bundle, digest
from unitcad.files import write_new
from unitcad.pipeline.plan import code_version
from unitcad.pipeline.write import replacing, sync
from unitcad.sweeps import task as tasks
from unitcad.sweeps.destination import Folders
from unitcad.sweeps.task import Task, VariantOutcome


class Receiver(Folders):
    """Folders of the results of remote workers: each content once, and the reusable files of each geometry."""

    def task(self, task: Task) -> Task:
        return replace(task, known=self.known(task.geometry))

    def known(self, geometry: str) -> Bundle | None:
        """Return the bundle of a geometry, or None if any of it is missing."""
        bundle = self.store.peek(_key(geometry))
        if bundle is None or not all(map(self.store.has, bundle["files"].values())):
            return None
        return Bundle(bundle["data"], bundle["files"], bundle["sizes"])

    def take(self, outcome: VariantOutcome, geometry: str) -> VariantOutcome:
        """Put a variant's files into its folder; return the outcome without them. Raises OSError."""
        if outcome.product is None:
            return outcome
        try:
            for content in outcome.contents.values():
                self.store.keep(content)
            if outcome.bundle and all(map(self.store.has, outcome.bundle.files.values())):
                self.store.forget(_key(geometry))
                with self.store.entry(_key(geometry)) as entry:
                    entry.data = vars(outcome.bundle)
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
