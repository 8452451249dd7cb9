"""The command line `hybridnav`."""

import sys

_EXIT_INTERRUPTED = 130
"""As a shell reports a program that Ctrl-C (SIGINT, 2) ended: 128 + 2."""


def main() -> None:
    """Run the command line and exit with its code.

    0: solved; 1: not solved; 2: wrong usage; 3: unreadable input; 130: interrupted.
    """
    try:
        from hybridnav.cli.app import run  # noqa: PLC0415 - Ctrl-C may come during the imports

        code = run(sys.argv[1:])
    except KeyboardInterrupt:
        code = _EXIT_INTERRUPTED
    sys.exit(code)
