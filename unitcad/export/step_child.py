"""The process that writes STEP files for `step_process`: it loads OCCT first, then answers requests one by one."""

from __future__ import annotations

import pickle

from unitcad.children import end_with_parent, message_pipes
from unitcad.errors import UnitcadError


def main() -> None:
    """Answer each (bodies, name) with the file, or with the sentence of an error, until there are no more requests."""
    end_with_parent()
    requests, answers = message_pipes()
    from unitcad.export import step

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
