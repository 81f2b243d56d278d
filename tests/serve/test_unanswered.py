"""What the page shows of a question that has no answer: in time, at all, or none but an overtaken one's."""

import json

from live import WALL, Live


def fulfil(visit, answer):
    """Answer questions in the server's place where `answer`, given one, has something: a status and a message."""

    def handle(route):
        given = answer(route.request.post_data_json)
        if given == "never":
            return
        if given:
            route.fulfill(status=given[0], content_type="application/json", body=json.dumps(given[1]))
        else:
            route.continue_()

    visit.page.route("**/ask", handle)


def test_a_time_limit_is_not_told_as_a_refusal(browser, server):
    visit, late = Live(browser, server), {"moulds": "not judged: it took more than 60 s"}
    late["estimate"] = "not estimated: it took more than 30 s"
    fulfil(
        visit, lambda ask: ask["what"] in late and (500, {"faults": [{"message": late[ask["what"]]}], "again": True})
    )
    visit.page.fill(WALL, "1.3")
    visit.until(lambda: visit.state == "moulds not judged")
    visit.settled()
    assert "took more than 60 s" in visit.page.inner_text("#faults")
    assert "took more than 30 s" in visit.page.inner_text("#estimated")
    assert "no moulds" not in visit.page.inner_text("#page")
    late.clear()
    visit.pressed(visit.page.locator("#faults").get_by_role("button", name="Try again"))
    assert "checks: " in visit.state
    assert visit.page.inner_text("#faults") == ""
    visit.console.clear()  # the 500s
    visit.close()


def test_a_fault_of_the_server_leaves_paler_figures_and_a_button(browser, server):
    visit, ended = Live(browser, server), [True]
    fault = {"faults": [{"message": "the worker ended: out of memory, or a fault in a kernel"}], "again": True}
    fulfil(visit, lambda ask: ask["what"] == "unit" and ended and (500, fault))
    visit.page.fill(WALL, "1.3")
    visit.until(lambda: "worker ended" in visit.state)
    visit.settled()
    assert visit.page.get_attribute("#page", "data-stale") == "true"
    paler = "(one) => getComputedStyle(document.querySelector(one)).opacity"
    assert [visit.page.evaluate(paler, one) for one in ("#figures", "#glance", "#estimated")] == ["0.55"] * 3
    ended.clear()
    visit.pressed(visit.page.locator("#faults").get_by_role("button", name="Try again"))
    assert "checks: " in visit.state
    assert "wall_mm = 1.3" in visit.page.input_value("#text")
    assert visit.page.evaluate(paler, "#figures") == "1"
    visit.console.clear()
    visit.close()
