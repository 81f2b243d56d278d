"""Long studies: a job's patience is of processor time, and what ends one job leaves the others as they are."""

import os
import signal
import time

import pytest

from unitcad.accuracy import survey
from unitcad.accuracy.survey import in_order

PATIENCE = 0.3


def _job(name):
    if name == "dies":
        os._exit(3)
    start = time.process_time()
    time.sleep(2 * PATIENCE if name == "waits" else 0.0)
    while time.process_time() - start < {"computes": 100.0, "almost": 0.6 * PATIENCE}.get(name, 0.0):
        pass
    return name


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer of processor time")
def test_a_job_that_gets_little_of_the_processor_is_no_hung_one():
    """One waits for longer than the patience, as on a loaded machine, two share a worker, one never ends, one dies."""
    jobs = ["quick", "waits", "almost", "computes", "almost", "almost", "dies", "quick"]
    found = list(in_order(_job, jobs, PATIENCE, lambda job: f"late: {job}"))
    assert found == ["quick", "waits", "almost", "late: computes", "almost", "almost", "late: dies", "quick"]


def test_a_job_that_waits_for_ever_ends_by_the_clock(monkeypatch):
    monkeypatch.setattr(survey, "_WAITING", 1)
    assert list(in_order(time.sleep, [100.0], 0.1, lambda job: f"late: {job}")) == ["late: 100.0"]


def test_few_jobs_stay_in_this_process():
    assert list(in_order(lambda job: job + os.getpid(), [1, 2], 1.0, str, serial=2)) == [
        1 + os.getpid(),
        2 + os.getpid(),
    ]
