"""`renamed`: the warning of a name of an earlier version."""

import warnings


def renamed(old: str, new: str) -> None:
    """Warn the caller of a function's caller that it has another name now."""
    warnings.warn(f"{old} is now {new}: write that", FutureWarning, stacklevel=3)
