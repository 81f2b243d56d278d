"""A result's page as the live page opens it: its links give its files, and nothing else of the server."""

from pathlib import Path

import pytest
from live import Live
from running import serving

DOWNLOADED = ("base.stl", "unit.step")
SHOWN = {"bench.html": "Mould set", "casting.md": "# ", "spec.toml": "diameter_mm", "estimate.json": "{"}


@pytest.fixture(scope="module")
def built(browser, tmp_path_factory):
    """A server and the page of what was built on it."""
    with serving(tmp_path_factory.mktemp("built")) as own:
        visit = Live(browser, own)
        visit.page.click("text=Build this")
        visit.page.wait_for_selector('.job[data-ended="true"]', timeout=120_000)
        with visit.context.expect_page() as opened:
            visit.page.click("text=Open its page")
        opened.value.wait_for_selector("html[data-ready=yes]", timeout=60_000)
        yield own, opened.value, opened.value.url
        visit.close()


@pytest.fixture
def page(built):
    """The result's page, as it was opened first."""
    _, page, address = built
    if page.url != address:
        page.goto(address)
        page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
    return page


def test_files_are_downloaded_by_a_click(page, tmp_path):
    for name in DOWNLOADED:
        with page.expect_download() as under_way:
            page.locator("#files").get_by_role("link", name=name, exact=True).first.click()
        under_way.value.save_as(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000


def test_files_are_shown_by_a_click(page):
    back = page.url
    for name, held in SHOWN.items():
        page.get_by_role("link", name=name, exact=True).first.click()
        page.wait_for_url(f"**/{name}")
        assert held in page.inner_text("body"), name
        assert page.evaluate("() => window.origin") == "null"
        page.goto(back)
        page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="bench.html", exact=True).first.click(modifiers=["Control"])
    opened.value.wait_for_load_state()
    assert "Mould set" in opened.value.inner_text("body")
    opened.value.close()


REACHED = """async ([base, own]) => {
  const reached = [];
  for (const path of ["/", "/ask", own, own.replace("report.html", "spec.toml")]) {
    for (const mode of ["cors", "no-cors"]) {
      for (const credentials of ["include", "omit"]) {
        const method = path === "/ask" ? "POST" : "GET";
        try {
          const answer = await fetch(base + path, { mode, credentials, method });
          if (await answer.text()) reached.push([path, mode]);
        } catch { /* refused */ }
      }
    }
  }
  try { reached.push(document.cookie, sessionStorage.length); } catch { /* refused */ }
  return reached;
}"""


def test_its_scripts_reach_nothing(built, page):
    """The page's own policy is left out, as a hostile page would have none."""
    own = built[0]
    folder = next((Path(f"/proc/{own.process.pid}/cwd").resolve() / "out").glob("encapsulating-*"))
    (folder / "hostile.html").write_text("<!doctype html><title>hostile</title><p>hostile</p>")
    address = page.url.replace("report.html", "hostile.html")
    other = page.context.new_page()
    other.goto(address)
    assert other.inner_text("p") == "hostile"
    assert other.evaluate(REACHED, [own.base, page.url.removeprefix(own.base)]) == []
    other.set_content(f'<iframe src="{address}"></iframe><img src="{page.url}">')
    other.wait_for_timeout(300)
    assert all("hostile" not in frame.content() for frame in other.frames[1:])
    other.close()
