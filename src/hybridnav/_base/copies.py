"""Read-only arrays, values that are made late, and copies and pickles that preserve them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from types import MappingProxyType
from typing import Any, TypeAlias, TypeVar

import numpy as np

_T = TypeVar("_T")
_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])
_State = tuple[dict[str, Any], tuple[bool, ...], tuple[str, ...], dict[str, Any]]
_LOCKS = {type(threading.Lock()): threading.Lock, type(threading.RLock()): threading.RLock}
"""What makes a lock of each type."""


def frozen(array: _Array) -> _Array:
    """Make an array read-only, and return it."""
    array.flags.writeable = False
    return array


Source: TypeAlias = "_T | Callable[[], _T]"
"""A value, or how to make it when somebody reads it first, whose results are never functions.

A field of this type ends in `_source`; a `cached_property` of the same name without that ending
reads it by `made`, and copies have the value itself by `made_state`.
"""


def made(source: Source[_T]) -> _T:
    """Return a value, made now if it is given as how to make it."""
    value: _T = source() if callable(source) else source
    return value


def made_state(thing: object) -> dict[str, Any]:
    """Return the attributes of a value, those of sources made and not twice."""
    held = list(vars(thing))
    return {
        name: getattr(thing, name.removesuffix("_source"))
        for name in held
        if f"{name}_source" not in held
    }


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
    held = made_state(thing)
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
