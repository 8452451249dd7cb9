"""The page itself: one HTML file, one style sheet, plain ES modules."""

from __future__ import annotations

import json
from importlib.resources import files

_NAMES = (
    *("scene.js", "draw.js", "link.js", "route.js", "closures.js", "floors.js", "names.js"),
    *("pictures.js", "main.js"),
)
"""The modules of the page."""
ASSETS = (("page.css", "text/css"), *((name, "text/javascript") for name in _NAMES))
"""Names and kinds of the files beside the page."""
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""What the browser lets the page load: nothing but its own files."""
_SAVED_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' data: blob:; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'"
)


def asset(name: str) -> str:
    """Return the text of a file of the page."""
    return (files("hybridnav.view") / "assets" / name).read_text(encoding="utf-8")


def live_page() -> str:
    """Return the page that a server stands behind."""
    head = '<link rel="stylesheet" href="page.css">\n<script type="module" src="main.js"></script>'
    return asset("page.html").replace("<!-- head -->", head)


def whole_page(data: object) -> str:
    """Return the page with everything inside, which opens without a server.

    Parameters
    ----------
    data
        What the server would answer, as plain values.
    """
    modules = "\n".join(_plain(asset(name)) for name in _NAMES)
    # `</script>` in a name of a room must not end the script.
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    head = (
        f'<meta http-equiv="Content-Security-Policy" content="{_SAVED_POLICY}">\n'
        f"<style>\n{asset('page.css')}</style>\n"
    )
    end = (
        f'<script type="application/json" id="saved">{text}</script>\n'
        f'<script type="module">\n{modules}</script>\n'
    )
    page = asset("page.html").replace("<!-- head -->", head)
    return page.replace("<!-- end -->", end)


def _plain(module: str) -> str:
    """Return a module's text without imports and exports: names differ between the modules."""
    lines = [line for line in module.splitlines() if not line.startswith("import ")]
    return "\n".join(line.removeprefix("export ") for line in lines)
