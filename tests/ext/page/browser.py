"""A page in headless Chromium: what a person sees and clicks."""

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
WINDOW: dict[str, Any] = {"viewport": {"width": 1280, "height": 800}, "color_scheme": "light"}
_PATIENCE_S = 90


def browser_path() -> str:
    """Return the path of a browser; skip the test where there is none."""
    pytest.importorskip("playwright", reason="the driver of the browser is not installed")
    found = next((path for path in map(shutil.which, BROWSERS) if path), None)
    if found is None:
        pytest.skip(f"no browser: none of {', '.join(BROWSERS)} is installed")
    return found


@contextmanager
def browsing() -> Iterator[Any]:
    """Open a browser without a window."""
    path = browser_path()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        try:
            yield browser
        finally:
            browser.close()


class Shown:
    """A page, and what is on it."""

    def __init__(self, context: Any, address: str, face: str = "robot") -> None:
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page = context.new_page()
        self.page.set_default_timeout(1000 * _PATIENCE_S)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(f"{address}#face={face}" if "#" not in address else address)
        self.page.wait_for_selector("canvas[data-ready=true]")
        self.wait("document.getElementById('map').dataset.waiting === '0'")

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point [column, row] of the grid is on the screen."""
        middle_x, middle_y, scale = map(float, self.fact("view").split())
        box = self.page.locator("#map").bounding_box()
        return (
            box["x"] + box["width"] / 2 + (x - middle_x) * scale,
            box["y"] + box["height"] / 2 - (y - middle_y) * scale,
        )

    def fact(self, name: str) -> str:
        """Return what the canvas states of itself."""
        return str(self.page.locator("#map").get_attribute(f"data-{name}") or "")

    def click(self, x: float, y: float) -> None:
        """Click a point of the grid."""
        self.page.mouse.click(*self.at(x, y))

    def take(self, which: str, text: str) -> None:
        """Type the name of an end, and take the first room that the page offers for all of it."""
        self.page.fill(f"#{which}", text)
        self.page.wait_for_selector(f"#{which}-list[data-asked='{text}'] li")
        self.page.keyboard.press("Enter")
        self.wait(f"!document.getElementById('{which}-star').disabled")  # a room is the end

    def mode(self, name: str) -> None:
        """Choose what a click on the map means."""
        self.page.check(f"input[value={name}]")

    def text(self, selector: str) -> str:
        return str(self.page.locator(selector).inner_text())

    def wait(self, script: str) -> None:
        """Wait until an expression is true; the page itself may not evaluate any."""
        self._wait_until(lambda: self.page.evaluate(script), f"still false: {script}")

    def wait_request(self, part: str) -> None:
        """Wait until an address that holds a text has been asked for."""
        self._wait_until(
            lambda: any(part in url for url in self.requests), f"never asked for: {part}"
        )

    def wait_painted(self) -> None:
        """Wait until what the page knows of is painted, with its tiles."""
        frame = "new Promise((done) => requestAnimationFrame(done))"
        # A change of size is noticed at the end of a frame, and painted in the next one.
        for _ in range(2):
            self.page.evaluate(frame)
        self.wait("document.getElementById('map').dataset.waiting === '0'")

    def wait_corner(self, x: float, y: float) -> None:
        """Wait until the corner of an outline that can be dragged is painted, in white."""
        self._wait_until(lambda: self.colour(x, y) == (255, 255, 255), f"no corner at {x}, {y}")

    def _wait_until(self, is_so: Callable[[], bool], otherwise: str) -> None:
        ends_at = time.monotonic() + _PATIENCE_S
        while not is_so():
            assert time.monotonic() < ends_at, otherwise
            self.page.wait_for_timeout(20)

    def wait_plan(self, number: int) -> None:
        """Wait until so many plans have been shown, and none is under way."""
        self.wait(
            f"(m => Number(m.plans) >= {number} && m.busy === 'false')"
            "(document.getElementById('map').dataset)"
        )

    def wait_text(self, selector: str, text: str) -> None:
        """Wait until an element holds a text."""
        self.wait(f"document.querySelector({selector!r}).textContent.includes({text!r})")

    @property
    def length_m(self) -> float:
        """Length of the route that is shown."""
        return float(self.fact("length"))

    def colour(self, x: float, y: float) -> tuple[int, ...]:
        """Return the colour of the canvas at a point of the grid."""
        left, top = self.at(x, y)
        box = self.page.locator("#map").bounding_box()
        script = (
            "([x, y]) => { const c = document.getElementById('map'), r = c.width / c.clientWidth;"
            " return [...c.getContext('2d').getImageData(x * r, y * r, 1, 1).data] }"
        )
        found = self.page.evaluate(script, [left - box["x"], top - box["y"]])
        return tuple(found[:3])
