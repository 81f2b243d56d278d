"""Lines of a job, of any length: they end nothing, and the page keeps their beginning."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path

from running import serving

from unitcad.validation import templates


def test_a_line_of_70_000_characters_ends_neither_its_job_nor_the_next_one(tmp_path: Path) -> None:
    text = templates()["single-embedded"].read_text("utf-8")
    name = "x" * 70_000
    long = re.sub('material = "[^"]*"', f'material = "{name}"', text)
    with serving(tmp_path) as own:
        lines = []
        for spec in (long + f'\n[materials.{name}]\nlike = "ecoflex-00-30"\n', text):
            status, content, _ = own.send("/build", {"text": spec + "\n[output]\nformats = []\n"})
            assert status == 200, content[:200]
            state, end = json.loads(content), time.monotonic() + 60
            while not state["ended"]:
                assert time.monotonic() < end, "the job does not end"
                time.sleep(0.05)
                state = json.loads(own.send(f"/job/{state['job']}")[1])
            assert state["code"] == 0, state
            lines += state["lines"]
    assert max(map(len, lines)) == 4000
