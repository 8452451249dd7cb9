"""A query that makes the search of the fork that answers it hang, crash or fail."""

import os
import signal
from dataclasses import dataclass
from typing import Any

from hybridnav.refine.ompl import OmplQuery


@dataclass(frozen=True, eq=False)
class TroubledQuery(OmplQuery):
    """Trouble comes when the search begins, or when the first path is to be simplified."""

    trouble: str = "hang"
    after_path: bool = False

    def __getattribute__(self, name: str) -> Any:
        # Nobody but the fork asks for the corridors.
        if name == "corridors":
            from hybridnav.refine.ompl import answer, attempts

            where, function = (attempts, "simplify") if self.after_path else (answer, "attempt")
            setattr(where, function, lambda *_args, **_named: _trouble(self.trouble))
        return super().__getattribute__(name)


def _trouble(kind: str) -> None:
    if kind == "hang":
        while True:
            pass
    if kind == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    raise ZeroDivisionError(f"{kind} on purpose")
