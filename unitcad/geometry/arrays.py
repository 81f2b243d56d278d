"""What an array holds; numpy's own generic types make every sum and mask a union that a type checker cannot follow."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

Floats = NDArray[Any]
Ints = NDArray[Any]
Bools = NDArray[Any]
