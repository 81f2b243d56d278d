"""Builds of many instances: facts are those of the meshes placed one by one, within bounds on time and number."""

import time

import numpy as np
import pytest
from shapes import CUBE_CORNERS, CUBE_FACES, finding, mesh_xml, model_xml, package

from unitcad.meshcheck import Limits, Options, check_bytes


def build(matrices):
    rows = (" ".join(f"{value:.17g}" for value in matrix.ravel()) for matrix in matrices)
    items = "".join(f'<item objectid="1" transform="{row}"/>' for row in rows)
    return f"<build>{items}</build>"


def test_facts_are_those_of_the_meshes_placed_one_by_one(judge):
    rng = np.random.default_rng(5)
    linear = [np.eye(3), np.diag([2.0, 1.0, 0.5]), np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=(3, 3))]
    matrices = [np.vstack([linear[i % 4], [40.0 * i, rng.normal(), -40.0 * i]]) for i in range(40)]
    facts = judge(package(model_xml(build=build(matrices), attributes='unit="inch"')), "a.3mf").facts
    placed = [(CUBE_CORNERS * 10 @ m[:3] + m[3]) * 25.4 for m in matrices]
    corners = np.concatenate([points[CUBE_FACES] for points in placed])
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert facts.area_mm2 == pytest.approx(areas.sum() / 2, rel=1e-12)
    assert facts.volume_mm3 == pytest.approx(sum(abs(np.linalg.det(m[:3])) for m in matrices) * 254**3, rel=1e-12)
    assert np.allclose(facts.bbox_mm, [np.min(placed, axis=(0, 1)), np.max(placed, axis=(0, 1))], rtol=1e-12)
    assert facts.triangles == 480


def test_every_instance_that_is_too_far_or_mirrors_is_said(judge):
    shift = [np.vstack([np.eye(3), [x, 0, 0]]) for x in (0, 1e6, 20, 2e6)]
    report = judge(package(model_xml(build=build(shift))), "a.3mf")
    assert finding(report, "V002").count == 2
    mirrored = [np.vstack([np.diag([-1.0, 1, 1]), [30.0 * i, 0, 0]]) for i in range(3)]
    report = judge(package(model_xml(build=build(mirrored))), "a.3mf")
    assert finding(report, "P015").count == 3


@pytest.mark.parametrize("items", [1001, 600])
def test_instances_beyond_the_limit_end_the_check(items):
    """Counted as they are read (1001 items), or once expanded (600 items of an object with one component)."""
    whole = '<object id="1"><components><component objectid="2"/></components></object>'
    build = "<build>" + '<item objectid="1"/>' * items + "</build>"
    content = package(model_xml(f'<object id="2">{mesh_xml()}</object>{whole}', build))
    report = check_bytes(content, "a.3mf", Options(limits=Limits(max_instances=1000)))
    said = finding(report, "F011").message
    assert "1000" in said
    assert "instances" in said
    assert Limits().max_instances == 100_000


def test_a_huge_expansion_is_said_in_few_digits(judge):
    rows = "".join(
        f'<object id="{i}"><components>' + f'<component objectid="{i - 1}"/>' * 100 + "</components></object>"
        for i in range(2, 60)
    )
    content = package(model_xml(f'<object id="1">{mesh_xml()}</object>{rows}', '<build><item objectid="59"/></build>'))
    said = finding(judge(content, "a.3mf"), "P009").message
    assert said == "more than 1e117 faces in more than 1e116 instances, more than --max-faces 10000000"


def test_depth_is_counted_over_what_was_visited_before(judge):
    chain = "".join(
        f'<object id="{i}"><components><component objectid="{i - 1}"/></components></object>' for i in range(2, 82)
    )
    for items, code in ((("41", "60"), None), (("41", "81"), "P009"), (("81",), "P009")):
        built = "".join(f'<item objectid="{item}"/>' for item in items)
        content = package(model_xml(f'<object id="1">{mesh_xml()}</object>{chain}', f"<build>{built}</build>"))
        report = judge(content, "a.3mf")
        assert [found.code for found in report.findings if found.code != "G002"] == ([code] if code else []), items


def test_a_printers_rules_are_applied_once_to_instances_that_differ_by_their_place_on_the_bed(judge, monkeypatch):
    from unitcad.meshcheck import builds

    thin = mesh_xml(CUBE_CORNERS * [20, 0.2, 20])
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    matrices = [np.vstack([linear, [20.0 * k, 5.0 * k, 0]]) for k in range(4) for linear in (np.eye(3), turn)]

    def findings(of):
        content = package(model_xml(f'<object id="1">{thin}</object>', build=build(of)))
        return {
            item.code: item for item in judge(content, "a.3mf", printer="fdm-0.4").findings if item.code.startswith("D")
        }

    single = [findings([matrix]) for matrix in matrices]
    calls = []
    real = builds.check_on_bed
    monkeypatch.setattr(builds, "check_on_bed", lambda *given: calls.append(1) or real(*given))
    found = findings(matrices)
    assert len(calls) == 2
    assert set(found) == set(single[0]) >= {"D001"}
    assert found["D001"].count == sum(item["D001"].count for item in single)
    places = [np.array(single[k % 2]["D001"].locations[0].xyz) + matrices[k][3] for k in range(len(matrices))]
    shown = [place.xyz for place in found["D001"].locations]
    assert np.allclose(shown, places[: len(shown)])


def test_many_instances_of_one_object_are_cheap(judge):
    eye = np.eye(3)
    spread = [np.vstack([eye, [20.0 * (i % 100), 20.0 * (i // 100), 0]]) for i in range(20_000)]
    content = package(model_xml(build=build(spread)))
    begin = time.process_time()
    report = judge(content, "a.3mf")
    assert time.process_time() - begin < 3  # 0.9 s on two cores at 2.5 GHz; 4 s when each instance is measured
    assert report.facts.shells == 20_000
