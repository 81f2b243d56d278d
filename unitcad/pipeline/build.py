"""Building a variant: a product worked out whole, then put in its place, beside what the folder has from before."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from unitcad import files
from unitcad.cache import MemoryStore, MissingContent, Store, digest
from unitcad.errors import UnitcadError
from unitcad.json_text import json_bytes
from unitcad.pipeline import folder as folders
from unitcad.pipeline.artifacts import FORMATS, OUTPUTS
from unitcad.pipeline.manifest_records import Manifest, failed_codes
from unitcad.pipeline.product import Product, checked_outputs, make, possible_outputs
from unitcad.pipeline.stages import Say, Stages, Take
from unitcad.pipeline.versions import code_version
from unitcad.spec import Spec, with_formats
from unitcad.spec.asked import Format

if TYPE_CHECKING:
    from unitcad.pipeline.beside import Beside

Maker = Callable[[Store, Stages], Product]
"""Makes a product whole, nothing written yet."""
TRIES = 5
"""How often a result is made when what it shares vanishes from the cache meanwhile."""


@dataclass(frozen=True)
class Built:
    """A built variant: its folder, its manifest, and the SHA-256 of manifest.json."""

    folder: Path
    manifest: Manifest
    sha256: str

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
    take: Take | None = None,
    beside: Beside | None = None,
    store: Store | None = None,
) -> Built:
    """Build a spec's variant into `out`/<slug>-<hash12>.

    `only` is a choice of OUTPUTS; without `check` mould checks and mesh checks are left out. Formats and outputs that
    the folder has from before are made again beside the new ones. What others have made already comes out of `store`;
    `take` gets what is made anew, while the rest is still being made. `beside` are processes that make STEP,
    estimate and pictures of the procedure beside the rest.
    Raises Refusal or UnitcadError before anything is written; a failed check is no exception, see `Built.ok`.
    """
    return build_subject(
        out,
        folders.subject(spec),
        possible_outputs(spec, checked_outputs(only)),
        spec.output.formats,
        check,
        lambda formats, outputs, checked: partial(make, with_formats(spec, formats), outputs, checked),
        Stages(say, take, beside),
        store,
    )


def build_subject(
    out: Path,
    subject: folders.Subject,
    only: Sequence[str],
    formats: Sequence[str],
    check: bool,
    maker: Callable[[tuple[Format, ...], tuple[str, ...], bool], Maker],
    stages: Stages,
    store: Store | None,
) -> Built:
    """Build a subject into its folder below `out`, beside what that has from before; `maker` gives what makes it.

    Raises as `build`.
    """
    if out.exists() and not out.is_dir():
        raise UnitcadError(f"{out}: is a file, not a folder; choose another with -o")
    folder = out / subject.folder_name
    store = store or MemoryStore()
    folders.clear_leftovers(out)
    while True:
        earlier = folders.earlier(folder, subject)
        wanted: tuple[Format, ...] = tuple(form for form in FORMATS if form in (*earlier.formats, *formats))
        made = maker(wanted, checked_outputs((*only, *earlier.outputs)), check or earlier.checked)
        try:
            return build_into(
                folder,
                made,
                store,
                stages,
                lambda there=earlier: folders.earlier(folder, subject) == there,
            )
        except _Changed:  # another build has put a result there meanwhile: what it has is made too
            continue


class _Changed(Exception):
    """A folder that holds something else than it did when the work began."""


def build_into(
    folder: Path,
    maker: Maker,
    store: Store,
    wanted: Stages,
    unchanged: Callable[[], bool] = lambda: True,
    placing: Callable[[Path], AbstractContextManager[Path]] = folders.replacing,
) -> Built:
    """Put what `maker` makes into a folder, in place of what it holds; files that the new result lacks stay.

    `wanted` shows the stages and takes the files; `placing` yields the fresh folder that takes its place. Raises
    _Changed where the folder is not `unchanged` any more.
    """
    for left in reversed(range(TRIES)):
        stages, before = replace(wanted, seconds={}), Counter(store.counts)
        try:
            product = maker(store, stages)
            timings = {
                "code": code_version(),
                "seconds": {stage: round(seconds, 4) for stage, seconds in stages.seconds.items()},
                "store": dict(sorted((store.counts - before).items())),
            }
            with placing(folder) as fresh:
                if not unchanged():
                    raise _Changed
                product.place(fresh, store)
                files.write_new(fresh / "timings.json", json_bytes(timings))
            return Built(folder, product.manifest, digest(product.own["manifest.json"]))
        except MissingContent:  # the cache is cleared meanwhile
            if not left:
                raise
    raise AssertionError
