"""A directive that shows the output of `hybridnav COMMAND --help` at the build."""  # noqa: INP001 - no package

from __future__ import annotations

import contextlib
import io
import os
from typing import TYPE_CHECKING, Any
from unittest import mock

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from hybridnav.cli.app import run

if TYPE_CHECKING:
    from sphinx.application import Sphinx


class CommandHelp(SphinxDirective):
    """Help of one command, or of the program if none is named."""

    optional_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """Make a literal block of the command and its help."""
        command = self.arguments[0].split() if self.arguments else []
        printed = io.StringIO()
        with mock.patch.dict(os.environ, COLUMNS="80"), contextlib.redirect_stdout(printed):
            code = run([*command, "--help"])
        if code != 0:
            raise self.error(f"there is no help on {' '.join(command)!r}")
        typed = " ".join(["$ hybridnav", *command, "--help"])
        text = f"{typed}\n{printed.getvalue().rstrip()}"
        return [nodes.literal_block(text, text, language="console")]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive with Sphinx."""
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
