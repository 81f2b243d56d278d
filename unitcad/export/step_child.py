"""The process that writes STEP files for `step_process`: it loads OCCT first, then answers requests one by one."""

from __future__ import annotations

import os
import pickle
import sys

from unitcad.children import end_with_parent
from unitcad.errors import UnitcadError


def main() -> None:
    """Answer each (bodies, name) with the file, or with the sentence of an error, until there are no more requests."""
    end_with_parent()
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # OCCT's own words are no answers
    from unitcad.export import step

    requests = sys.stdin.buffer
    while True:
        try:
            bodies, name = pickle.load(requests)
        except EOFError:
            return
        try:
            answer = step.content(bodies, name)
        except UnitcadError as error:
            answer = str(error)
        pickle.dump(answer, answers)
        answers.flush()


if __name__ == "__main__":
    main()
