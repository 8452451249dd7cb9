"""The page of `hybridnav view`: seconds until it is there, and routes a second by dragging.

The office laid side by side so many times (4 copies are 2.2 million cells, 30 are 16.7), opened by
the command in a browser without a window and without a graphics card, of 1,280 x 800 pixels. An end
of a route is dragged along a circle; a route counts when it is drawn. An answer's time is the
median from its request to its last byte, as the browser has it. Needs Chromium and Playwright's
driver.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import hybridnav as hn
from benchmarks.common import option
from benchmarks.worlds import office_world, tiled
from hybridnav.harness.tables import to_markdown

if TYPE_CHECKING:
    from argparse import Namespace

    from hybridnav.harness.tables import Row

_BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_SIZE = {"width": 1280, "height": 800}
_CELLS = "document.getElementById('map').dataset.waiting === '0'"
_STARTED = "document.getElementById('progress').hidden"
_ROUTES = "Number(document.getElementById('map').dataset.plans || 0)"
_START, _GOAL = (8.0, 17.5), (20.0, 17.5)
_FRAMES = """() => { const count = () => { window.frames_ = (window.frames_ ?? 0) + 1;
    requestAnimationFrame(count); }; performance.clearResourceTimings(); count(); }"""
_ANSWERS = """() => performance.getEntriesByType("resource")
    .filter((each) => each.name.endsWith("/plan")).map((each) => each.duration)"""
_MOVES_S = 1 / 60
_RADIUS = 60
"""Pixels of the circle along which the end is dragged."""
_AIM = 20.0


def measure(driver: Any, rows: int, cols: int, seconds: float) -> Row:
    """Open a page, plan a route and drag its end."""
    world = tiled(office_world(), rows=rows, cols=cols)
    grid = world.grid(robot_radius_m=0.25)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "map.yaml"
        hn.write_ros_map(grid, file)
        command = [sys.executable, "-m", "hybridnav", "view", str(file), "--no-browser"]
        began = time.perf_counter()
        with subprocess.Popen(
            [*command, "--robot-radius", "0.25", "--max-cells", str(grid.classes.size)],
            stdout=subprocess.PIPE,
            text=True,
        ) as server:
            try:
                assert server.stdout is not None  # noqa: S101 - it is a pipe
                address = server.stdout.readline().split()[1]
                path = next(path for path in map(shutil.which, _BROWSERS) if path)
                browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
                page = browser.new_page(viewport=_SIZE)
                page.set_default_timeout(300_000)
                page.goto(f"{address}#face=robot")
                page.wait_for_selector("canvas[data-open=true]")
                _wait(page, _CELLS)
                shown = time.perf_counter() - began
                page.wait_for_selector("canvas[data-ready=true]")
                rooms = time.perf_counter() - began
                _wait(page, _STARTED)
                ready = time.perf_counter() - began
                rates = _dragged(page, grid, seconds)
                browser.close()
            finally:
                server.terminate()
    row: Row = {
        "million cells": round(grid.classes.size / 1e6, 1),
        "cells s": shown,
        "rooms s": rooms,
    }
    return row | {"planner s": ready, **rates, "aim": _AIM}


def _dragged(page: Any, grid: hn.OccupancyGrid, seconds: float) -> Row:
    """Return the routes a second that are drawn while an end is dragged, the frames, and the time
    of an answer."""
    page.fill("#start", "{}, {}".format(*_START))
    page.fill("#goal", "{}, {}".format(*_GOAL))
    page.keyboard.press("Enter")
    _wait(page, f"{_ROUTES} >= 1")
    x, y = _on_screen(page, grid, (14.0, 17.5))
    page.mouse.move(*_on_screen(page, grid, _GOAL))
    page.mouse.down()
    page.evaluate(_FRAMES)
    first, began = page.evaluate(_ROUTES), time.perf_counter()
    k = 0
    while (passed := time.perf_counter() - began) < seconds:
        turn = passed * math.tau / 3
        page.mouse.move(x + _RADIUS * math.cos(turn), y + _RADIUS * math.sin(turn))
        k += 1
        time.sleep(max(0.0, k * _MOVES_S - passed))
    counts = page.evaluate(_ROUTES) - first, page.evaluate("window.frames_")
    answers, passed = page.evaluate(_ANSWERS), time.perf_counter() - began
    page.mouse.up()
    return {
        "routes a second": counts[0] / passed,
        "frames a second": counts[1] / passed,
        "answer ms": float(np.median(answers)),
    }


def _on_screen(
    page: Any, grid: hn.OccupancyGrid, point: tuple[float, float]
) -> tuple[float, float]:
    """Return where a point in metres is on the screen."""
    view = page.locator("#map").get_attribute("data-view")
    middle_x, middle_y, scale = map(float, view.split())
    row, col = grid.frame.position_of(*point)
    box = page.locator("#map").bounding_box()
    return (
        box["x"] + box["width"] / 2 + (col - middle_x) * scale,
        box["y"] + box["height"] / 2 - (row - middle_y) * scale,
    )


def _wait(page: Any, script: str) -> None:
    """Wait until an expression is true; the page itself may not evaluate any."""
    while not page.evaluate(script):
        page.wait_for_timeout(20)


OPTIONS = [
    option("--copies", nargs="*", default=["2x2", "6x5"], metavar="ROWSxCOLS"),
    option("--seconds", type=float, default=5.0),
]


def main(given: Namespace) -> None:
    """Measure the page on maps of several sizes."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - says what is missing

    rows = []
    with sync_playwright() as driver:
        for text in given.copies:
            n_rows, n_cols = map(int, text.split("x"))
            rows.append(measure(driver, n_rows, n_cols, given.seconds))
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores\n")
    print(to_markdown(rows))
