"""python -m unitcad."""

from unitcad.cli import main

main()
