"""Debian's Chromium, driven by Playwright."""

import contextlib
import io
import shutil
from pathlib import Path

import numpy as np
from PIL import Image

FLAGS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


LISTEN = """
  window.clickable = [];
  const listen = EventTarget.prototype.addEventListener;
  EventTarget.prototype.addEventListener = function (type, ...rest) {
    if (type === "click") window.clickable.push(this);
    return listen.call(this, type, ...rest);
  };
"""
"""Keeps a list of what listens to clicks."""


def executable():
    """Where Chromium is, or None."""
    return shutil.which("chromium")


@contextlib.contextmanager
def browser():
    """A running browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, launched(playwright.chromium) as running:
        yield running


@contextlib.contextmanager
def launched(kind, *flags):
    """A browser of a kind (`running.browser_type` is one) with more flags."""
    running = kind.launch(executable_path=executable(), args=[*FLAGS, *flags])
    try:
        yield running
    finally:
        running.close()


class Visit:
    """A page opened from a file or at an address: what it said on the console, what it asked for, what it threw."""

    def __init__(
        self,
        running,
        at,
        width=1280,
        height=900,
        dark=False,
        fragment="",
        script="",
    ):
        scheme = "dark" if dark else "light"
        self.context = running.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, reduced_motion="reduce"
        )
        if script:
            self.context.add_init_script(script)
        self.page = self.context.new_page()
        self.console = []
        self.requests = []
        self.errors = []
        self.page.on("console", lambda message: self.console.append(f"{message.type}: {message.text}"))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        address = at.resolve().as_uri() if isinstance(at, Path) else at
        self.page.goto(address + (f"#{fragment}" if fragment else ""))
        self.page.wait_for_selector("html[data-ready=yes]", timeout=60_000)

    def drawn(self):
        """Wait until the 3D view has drawn."""
        self.page.wait_for_selector(".stage-host[data-shown]", timeout=60_000)
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def overflowing(self):
        """What reaches past the right edge of the window, its section or its cell, and is in no part that scrolls."""
        return self.page.evaluate(
            """() => {
              const found = document.documentElement.scrollWidth > innerWidth ? ["the page"] : [];
              for (const node of document.body.querySelectorAll("*")) {
                const scrolls = node.closest(".scroll, nav, .plot, svg, .hidden, script, style");
                if (scrolls || !node.checkVisibility()) continue;
                const column = node.parentElement.closest("section, dd, .field, #page > *") || document.body;
                const edge = Math.min(innerWidth, column.getBoundingClientRect().right || innerWidth);
                if (node.getBoundingClientRect().right > edge + 0.5) found.push(node.outerHTML.slice(0, 90));
              }
              return found;
            }"""
        )

    def printed_faults(self):
        """What a printed page has of controls and closed folds, and headings that a page may end with."""
        self.page.emulate_media(media="print")
        self.page.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
        return self.page.evaluate(
            """() => [...document.querySelectorAll("button, input, select, textarea, details:not([open]), h2, h3, h4")]
              .filter((node) => node.getClientRects().length && node.checkVisibility())
              .filter((node) => !/^H/.test(node.tagName) || getComputedStyle(node).breakAfter !== "avoid"
                || (node.parentElement.innerText.trim() === node.innerText.trim()
                  && !node.parentElement.querySelector("canvas, img, svg, .plot")))
              .map((node) => node.outerHTML.slice(0, 90))"""
        )

    def picture(self, selector):
        """Take a picture (PNG) of where a part stands; one that is drawn again meanwhile may be another element."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        clip = self.page.locator(selector).evaluate(
            """(node) => {
              const { x, y, width, height } = node.getBoundingClientRect();
              return { x: x + scrollX, y: y + scrollY, width, height };
            }"""
        )
        return self.page.screenshot(full_page=True, clip=clip)

    def pixels(self, selector):
        """Return the pixels of where a part stands, (height, width, 3) from 0 to 255."""
        return np.asarray(Image.open(io.BytesIO(self.picture(selector))).convert("RGB")).astype(int)

    def colour(self, name):
        """Return a colour of the theme, (3,) from 0 to 255."""
        said = self.page.evaluate("(name) => window.unitcad.theme.colour(name)", name)
        return np.array([int(said[i : i + 2], 16) for i in (1, 3, 5)])

    def close(self):
        """End the visit; nothing was thrown, nor said on the console."""
        self.context.close()
        assert self.errors == []
        assert self.console == []
