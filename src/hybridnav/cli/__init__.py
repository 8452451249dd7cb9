"""The command line `hybridnav`."""

import gc
import os
import signal
import sys
import threading

from hybridnav._base.files import remove_unfinished

_EXIT_INTERRUPTED = 130
"""As a shell reports a program that Ctrl-C (SIGINT, 2) ended: 128 + 2."""
_SOME_OBJECTS = 500_000
"""New objects after which Python looks for garbage: by its own setting it does 300 times while a
plan is imported, a tenth of the plan's time, and finds none."""
_SHOW_CURSOR = b"\r\x1b[K\x1b[?25h"


def main() -> None:
    """Run the command line and exit with its code.

    0: solved; 1: not solved; 2: wrong usage; 3: unreadable input; 130: interrupted.
    """
    _handle_interrupts(_end_at_once)
    gc.set_threshold(_SOME_OBJECTS)
    try:
        code = _run(sys.argv[1:])
    except KeyboardInterrupt:
        code = _EXIT_INTERRUPTED
    # The answer is out: an interrupt while Python comes to its end does not change it.
    _handle_interrupts(signal.SIG_IGN)
    if "ompl" not in sys.modules:  # its bindings report what nobody took apart
        gc.freeze()  # Python would take every object apart, for a fifth of a plan's time
    sys.exit(code)


def _run(words: list[str]) -> int:
    """Run a command line; Ctrl-C may come during the imports."""
    if words == ["--help"]:
        from hybridnav.cli.help import write_help  # noqa: PLC0415

        write_help()
        return 0
    from hybridnav._base.jit import run_kept  # noqa: PLC0415
    from hybridnav.cli.app import run  # noqa: PLC0415

    run_kept()
    return run(words)


def _handle_interrupts(handler: object) -> None:
    """Set what Ctrl-C does, unless whoever started the command has it ignored."""
    is_main = threading.current_thread() is threading.main_thread()
    if is_main and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, handler)  # type: ignore[arg-type]


def _end_at_once(*_: object) -> None:
    """End the process and its children.

    An exception in its place is lost in callbacks, turned into others during imports, and printed
    where nobody catches it.
    """
    try:
        remove_unfinished()
        if sys.stderr is not None and sys.stderr.isatty():
            os.write(sys.stderr.fileno(), _SHOW_CURSOR)  # the spinner hides it
        loaded = sys.modules.get("multiprocessing")
        for child in loaded.active_children() if loaded is not None else ():
            child.kill()
    finally:
        os._exit(_EXIT_INTERRUPTED)
