"""Building an array into its folder, by the machinery that builds a variant."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from unitcad.arrays.array import Array
from unitcad.arrays.array_file import array_hash, array_of, with_formats
from unitcad.cache import Store
from unitcad.pipeline.artifacts import OUTPUTS
from unitcad.pipeline.build import Built, build_subject
from unitcad.pipeline.folder import ARRAY, Subject
from unitcad.pipeline.product import checked_outputs
from unitcad.pipeline.stages import Say, Stages, Take

if TYPE_CHECKING:
    from unitcad.pipeline.beside import Beside


def build_array(
    array: Array,
    out: Path = Path("out"),
    *,
    only: Sequence[str] = OUTPUTS,
    check: bool = True,
    say: Say = lambda message: None,
    take: Take | None = None,
    beside: Beside | None = None,
    store: Store | None = None,
) -> Built:
    """Build an array into `out`/<slug>-<hash12>: units, patch, tools, circuit, crosstalk and procedure.

    Arguments, refusals and what is kept from before are those of `unitcad.pipeline.build.build`.
    """
    from unitcad.pipeline.array_product import make_array

    return build_subject(
        out,
        array_subject(array),
        checked_outputs(only),
        array.unit.output.formats,
        check,
        lambda formats, outputs, checked: partial(make_array, with_formats(array, formats), outputs, checked),
        Stages(say, take, beside),
        store,
    )


def array_subject(array: Array) -> Subject:
    """Return an array as the subject of a result."""
    return Subject("array", array.name, array_hash(array), ARRAY, _there)


def _there(data: dict[str, Any]) -> tuple[str, tuple[str, ...]]:
    there = array_of(data)
    return array_hash(there), tuple(there.unit.output.formats)
