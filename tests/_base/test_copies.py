"""Copies of objects that hold locks."""

import copy
import threading

from hybridnav._base.copies import copies_alike


def test_a_lock_is_not_shared_with_a_copy() -> None:
    @copies_alike
    class Locked:
        def __init__(self) -> None:
            self.lock = threading.Lock()

    locked = Locked()
    with locked.lock:
        assert copy.deepcopy(locked).lock.acquire(blocking=False)
