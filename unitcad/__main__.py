"""python -m unitcad."""

import sys

if not sys.flags.safe_path:
    del sys.path[0]  # where the command runs: what lies there is not ours to import

from unitcad.cli import main

main()
