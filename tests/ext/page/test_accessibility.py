"""The page for people who do not see it, or use no mouse: names, order of focus, contrast."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.ext.page.browser import WINDOW, Shown
from tests.ext.page.server import Client

CONTROLS = {
    *("button", "textbox", "combobox", "checkbox", "radio", "slider", "spinbutton", "listbox"),
    *("application", "link", "progressbar", "group", "complementary"),
}
FOCUS = """() => [...document.querySelectorAll('canvas, button, input, select, [tabindex]')]
    .filter((e) => !e.disabled && e.tabIndex >= 0 && e.checkVisibility() && !e.closest('[inert]'))
    .filter((e) => e.type !== 'radio' || e.checked)
    .map((e) => e.id || e.name || e.dataset.export || e.textContent.trim())"""
FOCUSED = """() => ((e) => e.id || e.name || e.dataset.export || e.textContent.trim())
    (document.activeElement)"""
CONTRAST = """() => {
    const numbers = (text) => text.match(/[\\d.]+/g).map(Number);
    const share = (v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    const light = ([r, g, b]) => 0.2126 * share(r) + 0.7152 * share(g) + 0.0722 * share(b);
    const behind = (e) => {
        for (let at = e; at; at = at.parentElement) {
            const colour = numbers(getComputedStyle(at).backgroundColor);
            if (colour.length < 4 || colour[3] > 0) return colour;
        }
        return [255, 255, 255];
    };
    const own = (e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    return [...document.querySelectorAll('aside *, main *')]
        .filter((e) => own(e) && e.checkVisibility() && !e.disabled && e.tagName !== 'OPTION')
        .map((e) => {
            const [one, other] = [light(numbers(getComputedStyle(e).color)), light(behind(e))];
            const ratio = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
            return [e.textContent.trim().slice(0, 40), ratio];
        })
        .filter(([, ratio]) => ratio < 4.5);
}"""


@pytest.fixture(params=["client", pytest.param("building", marks=pytest.mark.full)])
def shown(browser: Any, request: pytest.FixtureRequest) -> Iterator[Shown]:
    """The page of a map, and that of a building, with a route and something closed."""
    served: Client = request.getfixturevalue(request.param)
    context = browser.new_context(**WINDOW)
    shown = Shown(context, served.address)
    shown.click(20.5, 40.5)
    shown.click(60.5, 40.5)
    shown.wait_plan(1)
    shown.page.select_option("#close-door", "1")
    shown.wait_plan(2)
    shown.page.select_option("#room", shown.page.locator("#room option").nth(1).inner_text())
    yield shown
    assert shown.errors == []
    context.close()


def test_chromium_finds_a_name_for_every_control(shown: Shown) -> None:
    tree = shown.page.context.new_cdp_session(shown.page).send("Accessibility.getFullAXTree")
    nodes = [node for node in tree["nodes"] if not node["ignored"]]
    found = [node for node in nodes if node["role"]["value"] in CONTROLS]
    nameless = [node for node in found if not node.get("name", {}).get("value", "").strip()]
    assert nameless == []
    roles = {node["role"]["value"] for node in found}
    assert {"button", "textbox", "combobox", "checkbox", "radio", "application"} <= roles
    # Two controls that a list of them could not tell apart.
    names = [
        (node["role"]["value"], node["name"]["value"])
        for node in found
        if node["role"]["value"] in {"button", "textbox"}
    ]
    assert {each for each in names if names.count(each) > 1} == set()


@pytest.mark.full
def test_tab_goes_through_all_controls_in_their_order(shown: Shown) -> None:
    expected = shown.page.evaluate(FOCUS)
    assert expected[0] == "map"
    shown.page.evaluate("document.activeElement.blur()")
    shown.page.focus("#map")
    passed = [shown.page.evaluate(FOCUSED)]
    for _ in expected[1:]:
        shown.page.keyboard.press("Tab")
        passed.append(shown.page.evaluate(FOCUSED))
    assert passed == expected


@pytest.mark.full
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_texts_stand_out_from_their_ground(shown: Shown, theme: str) -> None:
    shown.page.select_option("#theme", theme)
    shown.wait(f"document.documentElement.dataset.theme === '{theme}'")
    assert shown.page.evaluate(CONTRAST) == []


@pytest.mark.full
def test_what_happens_is_announced(shown: Shown) -> None:
    script = "() => [...document.querySelectorAll('[aria-live], [role=status]')].map((e) => e.id)"
    assert {"status", "figures", "unsaved", "stage"} <= set(shown.page.evaluate(script))
