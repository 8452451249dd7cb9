"""The notebooks as pages of the site: copies in docs/notebooks, with links that lead to pages."""  # noqa: INP001 - no package

from __future__ import annotations

import hashlib
import logging
import os
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sphinx.util import logging as sphinx_logging

if TYPE_CHECKING:
    from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
NOTEBOOKS = ROOT / "notebooks"
COPIES = ROOT / "docs" / "notebooks"
CACHES = ROOT / "out" / "notebooks"

_RUN_ON = ("src/**/*.py", "planners/*", "maps/**/*", "requirements.lock")
_UP_TO_NOTEBOOKS = re.compile(r"\]\(\.\./((?:\.\./)*notebooks/)")
_FETCHED = re.compile(r'<link rel="stylesheet"\s+href="https://[^"]+/font-awesome[^"]*">')
_ELSEWHERE = re.compile(r'(?:src|<link[^>]+href)="(?:https?:)?//[^"]+"')
_QUIET_KERNEL = "c.IPKernelApp.log_level = 'ERROR'  # not that it listens on a local port\n"


def execution_cache() -> Path:
    """Return the jupyter-cache for the present code, and remove those for older code.

    jupyter-cache identifies a notebook by its cells, which stay the same when the package changes;
    so the name of the folder is a checksum of the code that all notebooks run on.
    """
    state = hashlib.sha256()
    files = {path for pattern in _RUN_ON for path in ROOT.glob(pattern) if path.is_file()}
    for path in sorted(files):
        state.update(path.relative_to(ROOT).as_posix().encode())
        state.update(hashlib.sha256(path.read_bytes()).digest())
    cache = CACHES / state.hexdigest()[:16]
    for other in CACHES.glob("*"):
        if other != cache:
            shutil.rmtree(other)
    return cache


def copy_notebooks(_app: Sphinx) -> None:
    """Copy the notebooks into Sphinx's folder, and remove copies of notebooks that are gone."""
    shutil.rmtree(COPIES, ignore_errors=True)
    COPIES.mkdir()
    for notebook in NOTEBOOKS.glob("*.ipynb"):
        shutil.copy(notebook, COPIES)


def mend_links(_app: Sphinx | None, docname: str, source: list[str]) -> None:
    """Turn links of the checkout, where docs and notebooks are neighbours, into the site's."""
    if docname.startswith("notebooks/"):
        source[0] = source[0].replace("](../docs/", "](../")
    else:
        source[0] = _UP_TO_NOTEBOOKS.sub(r"](\1", source[0])


def fetch_nothing(
    _app: Sphinx, page: str, _template: str, context: dict[str, Any], _doctree: object
) -> None:
    """Remove the link of matplotlib's player to icons on another site; wide.css has them here.

    Whatever else a page would fetch from another site is a warning, which fails the build.
    """
    if "body" in context:
        context["body"] = _FETCHED.sub("", context["body"])
        for link in _ELSEWHERE.findall(context["body"]):
            sphinx_logging.getLogger(__name__).warning("%s fetches %s", page, link)


def start_kernels_clean() -> None:
    """Keep kernels from reading the user's start-up files; let both sides report errors only."""
    profile = ROOT / "out" / "ipython" / "profile_default"
    profile.mkdir(parents=True, exist_ok=True)
    (profile / "ipython_kernel_config.py").write_text(_QUIET_KERNEL, encoding="utf-8")
    os.environ["IPYTHONDIR"] = str(profile.parent)
    logging.getLogger("traitlets").setLevel(logging.ERROR)


def setup(app: Sphinx) -> dict[str, Any]:
    """Copy before Sphinx looks for pages, mend before it reads them."""
    start_kernels_clean()
    app.connect("builder-inited", copy_notebooks)
    app.connect("source-read", mend_links)
    app.connect("html-page-context", fetch_nothing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
