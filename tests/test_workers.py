"""Work in other processes: each call has its own end, and nothing is left when the parent ends, however it ends."""

import contextlib
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path

import psutil
import pytest
import worker_acts as acts
from process_trees import left

from unitcad import workers
from unitcad.errors import Refusal
from unitcad.workers import NoWorker, Pool, TimedOut, WorkerEnded

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
linux = pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")


@pytest.fixture(scope="module")
def pool():
    with Pool(1) as one:
        yield one


def test_a_worker_answers_one_call_after_the_other(pool):
    assert pool.submit(acts.pid).result() == pool.submit(acts.pid).result() != os.getpid()
    assert [call.result() for call in [pool.submit(acts.chatter, n) for n in range(20)]] == list(range(20))


def test_a_function_by_its_name(pool):
    assert pool.submit("worker_acts:chatter", 3).result() == 3
    with pytest.raises(AttributeError):
        pool.submit("worker_acts:nothing").result()


def test_values_arrive_in_order_and_before_the_result(pool):
    told = []
    assert pool.submit(acts.chatter, 1000, heard=told.append).result() == 1000
    assert told == list(range(1000))


def test_an_error_of_the_caller_s_listener_ends_its_own_call_only(pool):
    def listener(value):
        raise KeyError(value)

    with pytest.raises(KeyError):
        pool.submit(acts.chatter, 100, heard=listener).result()
    assert pool.submit(acts.chatter, 2).result() == 2


@posix
@pytest.mark.parametrize(
    ("act", "error", "said"),
    [
        (acts.boom, ValueError, "boom"),
        (acts.refuse, Refusal, "wall_mm = 9: is too thick; nearest accepted: 2"),
        (acts.unpicklable, RuntimeError, "Local: a"),
        (acts.leave, SystemExit, "3"),
        (acts.die, WorkerEnded, "the worker died (SIGSEGV)"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_errors_and_crashes_reach_the_caller_of_that_call_alone(pool, act, error, said):
    failed, next_call = pool.submit(act), pool.submit(acts.chatter, 1)
    with pytest.raises(error) as raised:
        failed.result()
    assert str(raised.value) == said
    assert next_call.result() == 1


@posix
@pytest.mark.parametrize("act", [acts.sleep, acts.hold_lock], ids=["Python", "C with the interpreter's lock"])
def test_a_late_answer_ends_its_worker(pool, act):
    with pytest.raises(TimedOut, match=r"timed out after 0\.3 s"):
        pool.submit(act, 60, seconds=0.3).result(timeout=20)
    assert pool.submit(acts.chatter, 1).result() == 1


@posix
def test_a_limit_within_a_worker_holds_in_c_code(pool):
    with pytest.raises(TimedOut):
        pool.submit(acts.limited, 0.3).result(timeout=20)


def test_a_limit_of_time_ends_with_its_call(pool):
    first = pool.submit(acts.sleep, 0.1, seconds=0.5).result()
    assert pool.submit(acts.sleep, 0.8).result() == first


@linux
def test_a_call_that_needs_more_memory_than_its_worker_may_have_fails_alone():
    with Pool(1, memory=1 << 30) as pool:
        first = pool.submit(acts.pid).result()
        with pytest.raises(MemoryError):
            pool.submit(acts.fill, 2 << 30).result()
        assert pool.submit(acts.pid).result() != first  # the memory of the failed call is gone with its worker


def test_a_call_is_taken_back_or_stopped(pool):
    running = pool.submit(acts.sleep, 60)
    waiting, behind = pool.submit(acts.pid), pool.submit(acts.chatter, 1)
    while not running.running():
        time.sleep(0.01)
    assert waiting.cancel()
    assert not running.cancel()
    running.stop()
    with pytest.raises(WorkerEnded, match="the worker was stopped"):
        running.result()
    assert behind.result() == 1
    over, kept = pool.submit(acts.pid), pool.submit(acts.sleep, 0.3)
    worker = over.result()
    over.stop()  # its worker already answers the next call
    assert kept.result() == worker


@posix
def test_a_worker_that_died_while_it_was_idle_is_replaced(pool):
    os.kill(pool.submit(acts.pid).result(), signal.SIGKILL)
    time.sleep(0.3)
    assert pool.submit(acts.chatter, 1).result() == 1


def test_a_lost_call_is_made_here():
    with Pool(1) as pool:
        running = pool.submit(acts.sleep, 60)
        while not running.running():
            time.sleep(0.01)
        assert pool.submit(acts.pid).result_or(os.getpid) == os.getpid()  # not begun yet
        running.stop()
        assert running.result_or(os.getpid, wait=True) == os.getpid()
        assert pool.submit(acts.pid).result_or(os.getpid, wait=True) != os.getpid()


def test_the_end_of_a_pool_ends_all_its_calls():
    with Pool(1) as pool:
        running, waiting, late = pool.submit(acts.sleep, 60), pool.submit(acts.pid), list[object]()

        def submit_again(call):
            with pytest.raises(NoWorker):
                pool.submit(acts.pid)
            late.append(call)

        waiting.add_done_callback(submit_again)
        while not running.running():
            time.sleep(0.01)
    with pytest.raises(WorkerEnded, match="was stopped"):
        running.result()
    assert waiting.cancelled()
    assert late == [waiting]


# No start:


@linux
def test_a_start_that_fails_raises_at_each_call_and_recovers():
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with Pool(3) as pool:
        first = [pool.submit(acts.sleep, 0.5) for _ in range(3)]
        for number in {call.result() for call in first}:
            os.kill(number, signal.SIGKILL)
        time.sleep(1.5)  # the pool takes the dead ones in, on a machine under load too
        resource.setrlimit(resource.RLIMIT_NOFILE, (len(os.listdir("/proc/self/fd")) // 2, hard))
        try:
            calls = [pool.submit(acts.pid) for _ in range(6)]
            failed = [call.exception(timeout=20) for call in calls]
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        assert {type(error) for error in failed} == {NoWorker}
        assert "a worker process cannot start: " in str(failed[0])
        assert pool.submit(acts.chatter, 1).result(timeout=20) == 1


@pytest.mark.parametrize("load", ["no_such_module", "numpy"])
def test_a_module_that_cannot_load_is_named_at_each_call(load):
    if load == "numpy" and sys.platform != "linux":
        pytest.skip("limits of Linux")
    with Pool(2, load=(load,), memory=30 << 20 if load == "numpy" else None) as pool:
        for call in [pool.submit(acts.pid) for _ in range(3)]:
            with pytest.raises(NoWorker, match="a worker process cannot start: "):
                call.result(timeout=60)


# Programs:


@posix
def test_a_program_s_output_and_exit_code():
    done = workers.run(["sh", "-c", "cat; echo no >&2; exit 7"], content=b"x" * 1_000_000)
    assert (done.returncode, done.stdout, done.stderr) == (7, b"x" * 1_000_000, b"no\n")
    with pytest.raises(FileNotFoundError):
        workers.run(["no-such-program"])
    with pytest.raises(TimedOut):
        workers.run(["sleep", "600"], seconds=0.3)
    assert workers.run([sys.executable, "-c", "import os; os.abort()"]).returncode == -signal.SIGABRT


def test_a_program_s_lines_arrive_cut_to_a_length_and_end_nothing(pool):
    code = "import sys; print('a' * 200000); print('b'); print('c' * 70000, file=sys.stderr, end='')"
    lines = []
    call = pool.submit(workers.run_here, [sys.executable, "-c", code], lines=True, heard=lines.append)
    assert call.result().returncode == 0
    assert sorted(lines) == [("err", "c" * 4000), ("out", "a" * 4000), ("out", "b")]


@posix
def test_a_program_that_is_stopped_with_grace_may_end_by_itself(pool):
    code = "import time\ntry:\n print('up', flush=True); time.sleep(60)\nexcept KeyboardInterrupt: print('bye')"
    lines, up = list[str](), threading.Event()

    def listener(line):
        lines.append(line[1])
        up.set()

    call = pool.submit(workers.run_here, [sys.executable, "-c", code], lines=True, heard=listener)
    assert up.wait(20)
    call.stop(20)
    assert call.result(timeout=20).returncode == 0
    assert lines == ["up", "bye"]


# Orphans:

BODIES = {
    "C with the interpreter's lock": "call = pool.submit(acts.hold_lock, 100)",
    "Python": "call = pool.submit(acts.sleep, 100)",
    "idle": "pool.submit(acts.pid).result()",
    "program with a child": "call = pool.submit(workers.run_here, ['sh', '-c', "
    '\'trap "" TERM INT; (trap "" TERM INT; sleep 100) & sleep 100\'])',
    "nested pool": "call = pool.submit(acts.nested)",
}
ENDS = {"kill": signal.SIGKILL, "terminate": signal.SIGTERM, "interrupt": signal.SIGINT, "kill the worker": None}


@linux
@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("body", BODIES)
def test_nothing_is_left_however_the_parent_or_the_worker_ends(body, end):
    code = f"""
import sys, time
sys.path.insert(0, {str(Path(__file__).parent)!r})
import worker_acts as acts
from unitcad import workers
with workers.Pool() as pool:
    {BODIES[body]}
    time.sleep(0.4)
    print("up", flush=True)
    time.sleep(30)
"""
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        assert parent.stdout
        assert parent.stdout.readline() == b"up\n"
        least, by = {"program with a child": 3, "nested pool": 3}.get(body, 1), time.monotonic() + 20
        while len(below := psutil.Process(parent.pid).children(recursive=True)) < least:
            assert time.monotonic() < by
        if (number := ENDS[end]) is None:
            psutil.Process(parent.pid).children()[0].kill()
        else:
            parent.send_signal(number)
        assert left(below) == []
    finally:
        parent.kill()
        parent.communicate()


# All at random:


def _storm(seed, count):
    """Kill workers at random while calls of all kinds run, are cancelled and stopped."""
    choose = random.Random(seed)
    acts_of = {
        "pid": (acts.pid,),
        "sleep": (acts.sleep, 0.01),
        "boom": (acts.boom,),
        "die": (acts.die,),
        "late": (acts.sleep, 5),
        "held": (acts.hold_lock, 5),
        "limited": (acts.limited, 0.05),
        "refuse": (acts.refuse,),
    }
    ended, over, others = Counter[str](), threading.Event(), psutil.Process().children(recursive=True)
    with Pool(4, memory=2 << 30) as pool:
        begun = time.monotonic()
        pool.submit(acts.pid).result(timeout=60)
        pause = max(0.1, time.monotonic() - begun)  # a machine under load starts workers slowly

        def kill():
            while not over.wait(choose.random() * pause):
                with contextlib.suppress(OSError, IndexError):
                    os.kill(choose.choice(pool.pids), signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        calls = []
        for _ in range(count):
            kind = choose.choice(list(acts_of))
            call = pool.submit(*acts_of[kind], seconds=0.05 if kind in ("late", "held") else None)
            calls.append((kind, call))
            if (luck := choose.random()) < 0.1:
                call.cancel()
            elif luck < 0.2:
                threading.Timer(choose.random() * 0.05, call.stop).start()
        expected = {"pid": int, "sleep": int, "boom": ValueError, "refuse": Refusal}
        for kind, call in calls:
            try:
                value = call.result(timeout=60)
                assert isinstance(value, expected[kind])
                ended["right"] += 1
            except (workers.NoWorker, WorkerEnded) as error:
                ended[type(error).__name__] += 1
            except (ValueError, Refusal) as error:
                assert type(error) is expected[kind]
                ended["right"] += 1
            except BaseException as error:
                assert type(error).__name__ == "CancelledError"
                ended["cancelled"] += 1
        over.set()
        killer.join()
        for _ in range(8):
            assert pool.submit(acts.chatter, 1).result(timeout=60) == 1
    assert ended.total() == count
    assert ended["right"] > 0  # how many depends on the machine's load
    assert set(psutil.Process().children(recursive=True)) <= set(others)


@posix
def test_no_call_is_lost_under_random_kills_and_stops():
    _storm(seed=11, count=40)


@posix
@pytest.mark.long
@pytest.mark.parametrize("seed", range(5))
def test_no_call_is_lost_under_600_random_kills_and_stops(seed):
    _storm(seed, count=600)
