"""Settings of the documentation's build: `make docs` writes it to out/docs."""  # noqa: INP001 - Sphinx reads it

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import hybridnav

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

from notebook_pages import execution_cache

from hybridnav.cli.app import run

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "hybridnav"
author = "the hybridnav maintainers"
copyright = author  # noqa: A001 - Sphinx's name for it
version = release = hybridnav.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx.ext.viewcode",
    "command_help",
    "notebook_pages",
    "constants",
]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
exclude_patterns = ["images", "extensions", "static"]
default_role = "py:obj"  # single backticks in docstrings: code, and a link where it is a name here

myst_heading_anchors = 3

nb_execution_mode = "off"  # `make site` sets it to "cache"
nb_execution_cache_path = str(execution_cache())
nb_execution_show_tb = True  # a cell that fails, and with it the build, shows its traceback
nb_execution_timeout = 300  # of a cell, in seconds
nb_merge_streams = True
nb_output_stderr = "remove-warn"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
python_maximum_signature_line_length = 88

html_theme = "furo"
html_title = f"hybridnav {release}"
html_static_path = ["static"]
html_css_files = ["wide.css"]
html_show_sphinx = False
html_copy_source = False


def save_demo(app: Sphinx, problem: Exception | None) -> None:
    """Write the page of the office that index.md leads to."""
    if problem is None and app.builder.name == "html":
        office = Path(__file__).parents[1] / "maps" / "office" / "office.yaml"
        saved = str(app.outdir / "demo.html")
        if run(["view", str(office), "--robot-radius", "0.25", "--save", saved]):
            raise RuntimeError("the page of the office could not be saved")


def setup(app: Sphinx) -> None:
    """Register what the build does at its end."""
    app.connect("build-finished", save_demo)
