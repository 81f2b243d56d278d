"""Arrays: many units on one silicone sheet, with the sheet's moulds, their circuit and their crosstalk."""

from unitcad.arrays.array import Array
from unitcad.arrays.array_file import load_array

__all__ = ["Array", "load_array"]
