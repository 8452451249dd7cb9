"""Read-only arrays, and copies and pickles that preserve them."""

from __future__ import annotations

import threading
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_T = TypeVar("_T")
_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])
_State = tuple[dict[str, Any], tuple[bool, ...], tuple[str, ...], dict[str, Any]]
_LOCKS = {type(threading.Lock()): threading.Lock, type(threading.RLock()): threading.RLock}
"""What makes a lock of each type."""


def frozen(array: _Array) -> _Array:
    """Make an array read-only, and return it."""
    array.flags.writeable = False
    return array


def filled(cls: type[_T], **values: Any) -> _T:
    """Make a value of a frozen dataclass in a third of the time of its constructor.

    Fields that are left out have defaults, which the class holds; nothing is checked, and arrays
    are made read-only by the caller.
    """
    made = object.__new__(cls)
    object.__setattr__(made, "__dict__", values)
    return made


class _OnDemand:
    """An attribute that may be a function, which is called when it is read first; an array that it
    returns becomes read-only."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, thing: object, owner: type | None = None) -> Any:
        if thing is None:
            return self
        held = vars(thing)
        value = held[self._name]
        if callable(value):
            value = held[self._name] = value()
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        return value

    def __set__(self, thing: object, value: Any) -> None:
        vars(thing)[self._name] = value


def on_demand(name: str) -> Callable[[type[_T]], type[_T]]:
    """Let a field of a dataclass be given as a function, which is called when it is read first.

    `name`: the field; its values are never functions. Returns the decorator, for a class that
    `dataclass` has made.
    """

    def decorate(cls: type[_T]) -> type[_T]:
        setattr(cls, name, _OnDemand(name))
        return cls

    return decorate


def copies_alike(cls: type[_T]) -> type[_T]:
    """Make copies and pickles of a class preserve the read-only flags of its arrays.

    numpy drops these flags, and for numba a writeable array is another type: every kernel would be
    compiled again for a copy. Views of mappings stay views, and a copy has its own locks.

    `cls`: a class whose instances have a `__dict__`. Arrays count if they are attributes, or in
    tuples, lists or mappings that are attributes.
    """
    vars_of: Any = cls
    vars_of.__getstate__ = _state_of
    vars_of.__setstate__ = _set_state
    return cls


def _state_of(thing: object) -> _State:
    """Return attributes, whether each array in them is writeable, names of views, and what makes
    locks."""
    held = {name: getattr(thing, name) for name in vars(thing)}  # what is found on demand too
    views = tuple(name for name, value in held.items() if isinstance(value, MappingProxyType))
    locks = {name: _LOCKS[type(value)] for name, value in held.items() if type(value) in _LOCKS}
    kept = {name: value for name, value in held.items() if name not in locks}
    kept |= {name: dict(held[name]) for name in views}
    writeable = tuple(bool(array.flags.writeable) for array in _arrays(kept))
    return kept, writeable, views, locks


def _set_state(thing: object, state: _State) -> None:
    kept, writeable, views, locks = state
    for array, may_write in zip(_arrays(kept), writeable, strict=True):
        if not may_write:
            array.flags.writeable = False
    kept = kept | {name: MappingProxyType(kept[name]) for name in views}
    vars(thing).update(kept | {name: make() for name, make in locks.items()})


def _arrays(value: Any) -> Iterator[np.ndarray[Any, Any]]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, dict):
        for item in value.values():
            yield from _arrays(item)
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _arrays(item)
