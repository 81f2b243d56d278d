"""Building a variant: a product worked out whole, then put in its place, beside what the folder has from before."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from unitcad import files
from unitcad.cache import MemoryStore, MissingContent, Store
from unitcad.errors import UnitcadError
from unitcad.pipeline import folder as folders
from unitcad.pipeline.artifacts import FORMATS, OUTPUTS
from unitcad.pipeline.json_text import json_bytes
from unitcad.pipeline.manifest_records import Manifest, failed_codes
from unitcad.pipeline.product import checked_outputs, make, possible_outputs
from unitcad.pipeline.stages import Say, Stages
from unitcad.pipeline.versions import code_version
from unitcad.spec import Spec, with_formats

TRIES = 5
"""How often a result is made when what it shares vanishes from the cache meanwhile."""


@dataclass(frozen=True)
class Built:
    """A built variant: its folder and its manifest."""

    folder: Path
    manifest: Manifest

    @property
    def ok(self) -> bool:
        """Whether every mould check passed, and every mesh rule that makes an error."""
        return not failed_codes(self.manifest)


def build(
    spec: Spec,
    out: Path = Path("out"),
    *,
    only: Sequence[str] = OUTPUTS,
    check: bool = True,
    say: Say = lambda message: None,
    store: Store | None = None,
) -> Built:
    """Build a spec's variant into `out`/<slug>-<hash12>.

    `only` is a choice of OUTPUTS; without `check` mould checks and mesh checks are left out. Formats and outputs that
    the folder has from before are made again beside the new ones. What others have made already comes out of `store`.
    Raises Refusal or UnitcadError before anything is written; a failed check is no exception, see `Built.ok`.
    """
    only = possible_outputs(spec, checked_outputs(only))
    if out.exists() and not out.is_dir():
        raise UnitcadError(f"{out}: is a file, not a folder; choose another with -o")
    folder = out / folders.folder_name(spec)
    store = store or MemoryStore()
    folders.clear_leftovers(out)
    while True:
        earlier = folders.earlier(folder, spec)
        wanted = _of_formats(spec, (*earlier.formats, *spec.output.formats))
        outputs = checked_outputs((*only, *earlier.outputs))
        try:
            return build_into(
                folder, wanted, only=outputs, check=check or earlier.checked, store=store, say=say, earlier=earlier
            )
        except _Changed:  # another build has put a result there meanwhile: what it has is made too
            continue


class _Changed(Exception):
    """A folder that holds something else than it did when the work began."""


def build_into(
    folder: Path,
    spec: Spec,
    *,
    only: Sequence[str],
    check: bool,
    store: Store,
    say: Say = lambda message: None,
    earlier: folders.Earlier | None = None,
) -> Built:
    """Build into a folder, in place of what it holds; files of the old result that the new one lacks stay.

    Raises _Changed where the folder does not hold `earlier` any more.
    """
    for left in reversed(range(TRIES)):
        stages, before = Stages(say), Counter(store.counts)
        try:
            product = make(spec, only, check, store, stages)
            timings = {
                "code": code_version(),
                "seconds": {stage: round(seconds, 4) for stage, seconds in stages.seconds.items()},
                "store": dict(sorted((store.counts - before).items())),
            }
            with folders.replacing(folder) as fresh:
                if earlier is not None and folders.earlier(folder, spec) != earlier:
                    raise _Changed
                product.place(fresh, store)
                files.write_new(fresh / "timings.json", json_bytes(timings))
            return Built(folder, product.manifest)
        except MissingContent:  # the cache is cleared meanwhile
            if not left:
                raise
    raise AssertionError


def _of_formats(spec: Spec, wanted: Sequence[str]) -> Spec:
    return with_formats(spec, tuple(form for form in FORMATS if form in wanted))
