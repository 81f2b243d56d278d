"""What hangs on wavenumbers, radii and loads alone, kept for the last of them: most calls have the same radii."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, TypeVar

import numpy as np

_MOST_BYTES = 500_000
"""Of a result that is kept, with the arrays that it is of."""
_RESULTS = 16
"""Kept of each function: 8 MB at most."""

Made = TypeVar("Made", bound=tuple[Any, ...])


def kept(make: Callable[..., Made]) -> Callable[..., Made]:
    """Return a function of arrays and hashable values that keeps its last small results: tuples, arrays read-only."""
    results: dict[Hashable, Made] = {}

    @wraps(make)
    def found(*arguments: Any) -> Made:
        key = tuple(
            [(one.tobytes(), one.shape, one.dtype.char) if isinstance(one, np.ndarray) else one for one in arguments]
        )
        result = results.pop(key, None)
        if result is not None:
            results[key] = result  # the last one now
            return result
        result = make(*arguments)
        own = [one for one in result if isinstance(one, np.ndarray)]
        for array in own:
            array.flags.writeable = False
        arrays = (*own, *(one for one in arguments if isinstance(one, np.ndarray)))
        if sum(array.nbytes for array in arrays) <= _MOST_BYTES:
            results[key] = result
            for oldest in list(results)[:-_RESULTS]:
                results.pop(oldest, None)
        return result

    return found
