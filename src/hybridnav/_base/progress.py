"""Progress reports of long work."""

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""Called after each step with the number of steps done and of all steps, as for a progress bar."""


def no_progress(done: int, total: int) -> None:
    """Ignore the progress."""
