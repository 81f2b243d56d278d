"""A file whose time runs out: everything that was found by then is reported, with F011 beside it."""

import numpy as np
import pytest
from shapes import CUBE_CORNERS, CUBE_FACES, finding, mesh_xml, model_xml, package, stl

from unitcad.catalogue import printers
from unitcad.geometry import boxes
from unitcad.meshcheck import check_bytes
from unitcad.meshcheck.findings import Facts
from unitcad.meshcheck.geometry import crossings
from unitcad.meshcheck.rules.f_file import Deadline, OutOfTime, Unreadable
from unitcad.meshcheck.rules.inspection import Options


def _open_and_crossing():
    """A cube without one face, and beside it twelve bars, each of which pierces a cube."""
    corners, faces = [CUBE_CORNERS * 10], [CUBE_FACES[1:]]
    for k in range(12):
        at = np.array([20.0 * (k + 1), 0, 0])
        for box in (CUBE_CORNERS * 10 + at, CUBE_CORNERS * [2, 2, 20] + [4, 4, -5] + at):
            faces.append(CUBE_FACES + 8 * len(corners))
            corners.append(box)
    return np.concatenate(corners), np.concatenate(faces)


def _stl():
    points, faces = _open_and_crossing()
    return stl(points[faces])


def _threemf():
    points, faces = _open_and_crossing()
    objects = f'<object id="1">{mesh_xml()}</object><object id="2">{mesh_xml(points, faces)}</object>'
    return package(model_xml(objects, '<build><item objectid="1"/><item objectid="2"/></build>'))


@pytest.fixture
def stopped(monkeypatch):
    """Judge `data` with a clock that runs out at its n-th look."""
    monkeypatch.setattr(crossings, "_BLOCK", 100)
    monkeypatch.setattr(boxes, "_STEP_BITS", 4)
    monkeypatch.setattr(boxes, "_STEP", 16)

    def judge(data, name, looks, options):
        left = looks

        def tick(clock):
            nonlocal left
            left -= 1
            if left < 0:
                raise OutOfTime(clock.seconds)

        monkeypatch.setattr(Deadline, "tick", tick)
        return check_bytes(data, name, options)

    return judge


@pytest.mark.parametrize("name", ["a.stl", "a.3mf"])
@pytest.mark.parametrize("printer", [False, True], ids=["mesh rules", "and a printer's"])
def test_what_was_found_is_reported_and_never_lost_again(name, printer, stopped):
    data = _stl() if name == "a.stl" else _threemf()
    options = Options(printer=printers()["fdm-0.4"] if printer else None)
    whole = {item.code: item for item in stopped(data, name, 10**9, options).findings}
    assert {"T001", "G001"} <= set(whole)
    reached = {}
    crossings, looks = [0], 0
    while True:
        report = stopped(data, name, looks, options)
        if not report.has("F011"):
            break
        assert report.verdict == "error"
        found = {item.code: item for item in report.findings}
        for code in set(found) - {"F011"}:
            reached.setdefault(code, looks)
            assert found[code].count <= whole[code].count
            assert found[code].severity == whole[code].severity
        assert all(code in found for code in reached)
        crossings.append(found["G001"].count if "G001" in found else 0)
        looks += 1 if crossings[-1] < whole["G001"].count else 1 + looks // 12  # every look while they are counted
    assert {"T001", "G001"} <= set(reached)
    assert crossings == sorted(crossings)
    assert len(set(crossings)) > 3  # crossings are counted as far as they were looked for
    assert report.findings == tuple(whole.values())


def test_facts_that_were_known_are_reported(stopped):
    whole = stopped(_stl(), "a.stl", 10**9, Options())
    assert stopped(_stl(), "a.stl", 0, Options()).facts == Facts()
    known = [stopped(_stl(), "a.stl", looks, Options()).facts for looks in range(2, 20)]
    assert all(facts.bbox_mm == whole.facts.bbox_mm for facts in known)
    assert known[-1].area_mm2 == whole.facts.area_mm2


def test_filters_drop_what_was_found_but_not_the_limit(stopped):
    report = stopped(_stl(), "a.stl", 30, Options(ignore=("T", "F", "G")))
    assert [item.code for item in report.findings] == ["F011"]


def test_no_memory_ends_as_a_limit_with_the_rest(monkeypatch):
    def fails(*_):
        raise MemoryError

    monkeypatch.setattr(crossings, "_decide", fails)
    report = check_bytes(_stl(), "a.stl")
    assert report.has("F011")
    assert report.has("T001")
    assert "out of memory" in finding(report, "F011").message


def test_the_alarm_of_code_that_never_looks_at_the_clock(monkeypatch, tmp_path):
    import signal
    import time

    from unitcad.meshcheck import file_checks
    from unitcad.meshcheck.rules import g_shells
    from unitcad.meshcheck.rules.f_file import Limits

    if not hasattr(signal, "setitimer"):
        pytest.skip("no interval timer")
    monkeypatch.setattr(file_checks, "_GRACE", 0.1)
    monkeypatch.setattr(g_shells, "check_mesh", lambda *_: time.sleep(60))
    path = tmp_path / "a.stl"
    path.write_bytes(_stl())
    report = file_checks.check_guarded(str(path), Options(limits=Limits(seconds=1.0)))
    assert {"F011", "T001", "G001"} <= {item.code for item in report.findings}
    assert finding(report, "F011").message == "not finished within --timeout 1 s"
    with pytest.raises(Unreadable), file_checks._alarm(0.01):
        time.sleep(60)
