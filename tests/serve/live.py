"""The live page in Chromium: what a test does on it and waits for."""

import time

from chromium import Visit

WALL = 'input[name="layers.0.wall_mm"]'


class Live(Visit):
    """A page of a server in a browser."""

    def __init__(self, browser, server, width=1280, height=900, dark=False):
        super().__init__(browser, server.url, width, height, dark)
        self.server = server
        self.settled()

    @property
    def state(self):
        """What the page says of the spec."""
        return self.page.inner_text("#state")

    def until(self, done, seconds=60.0):
        """Wait until something holds."""
        end = time.monotonic() + seconds
        while not done():
            assert time.monotonic() < end, self.state
            self.page.wait_for_timeout(30)

    def settled(self):
        """Wait until nothing is under way: unit, moulds and estimate are those of the newest change."""
        self.until(lambda: self.page.get_attribute("#page", "aria-busy") == "false")

    def choose(self, selector, value):
        """Type a value, and wait until all of it has been seen."""
        count = len(self.timings())
        self.page.fill(selector, value)
        self.until(lambda: len(self.timings()) > count)
        self.settled()

    def pressed(self, control, key=""):
        """Click a control, or press a key in it, and wait until all of what changes has been seen."""
        count = len(self.timings())
        control.press(key) if key else control.click()
        self.until(lambda: len(self.timings()) > count)
        self.settled()

    def start_from(self, name):
        """Choose a template."""
        count = len(self.timings())
        self.page.select_option('select[name="template"]', name)
        self.until(lambda: len(self.timings()) > count)
        self.settled()

    def timings(self):
        """What the page has measured: what was asked, and ms from the change to what is shown."""
        return self.page.evaluate("() => window.unitcad.timings")

    def close(self):
        """End the visit; nothing was asked of anybody else either."""
        super().close()
        assert all(url.startswith((self.server.base, "data:", "blob:")) for url in self.requests)
