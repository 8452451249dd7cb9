"""How much memory a process of a test has taken."""

import resource
import sys
from pathlib import Path

_STATUS = Path("/proc/self/status")
_BYTES = 1024 if sys.platform == "darwin" else 1
"""What `ru_maxrss` counts in, against kB."""


def peak_kb() -> int:
    """Return the most kB that this process has held at once.

    On Linux `ru_maxrss` begins with that of the process which started this one, and tests run in
    large ones.
    """
    if not _STATUS.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // _BYTES
    lines = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines())
    return int(lines["VmHWM"].split()[0])
