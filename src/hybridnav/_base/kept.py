"""Kernels that numba keeps, run without numba: a command imports it where it has to compile.

numba's files of a kernel hold machine code, and what its compiler knew of it as pickled objects. To
load and call the code takes LLVM's linker (llvmlite) and three of numba's compiled modules alone:
the helpers that the code calls, its memory, and what makes a function of an address. Here they are
loaded without the package round them, and ghosts stand for the compiler's objects. Importing numba
takes 0.25 s of processor, this 0.03 s, most of it llvmlite. What is unknown here in any respect is
left to numba: other types of arguments, files of another version, symbols that are not there.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from functools import cache, cached_property
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np

from hybridnav._base import shipped
from hybridnav._base.clock import stopped

_MANY = 20_000
"""Calls of kernels after which numba's import pays: it finds code for arguments faster."""
_LOCK = RLock()


class UnknownError(Exception):
    """Raised where numba has to decide."""


class Kernel:
    """A kernel whose kept code is run; numba's dispatcher where there is none."""

    _n_calls = 0

    def __init__(self, function: Any, compiled: Callable[[], Any]) -> None:
        self.py_func = function
        self._compile = compiled
        self._code: dict[Any, Any] = {}
        self._compiled: Any = None

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        call = self._compiled
        if call is None:
            call = self._kept(arguments) if not named else self.dispatcher
        try:
            return call(*arguments, **named)
        except SystemError as error:
            raised = shipped.cause_of(error)
        raise raised

    def __getattr__(self, name: str) -> Any:
        return getattr(self.py_func if name.startswith("__") else self.dispatcher, name)

    def is_warm(self) -> bool:
        """Return whether a version of the kernel is kept, or none can be."""
        return any(path.exists() for path, _ in _indexes(self.py_func)) or self.dispatcher.is_warm()

    @cached_property
    def dispatcher(self) -> Any:
        """The kernel as numba calls it."""
        with stopped():
            self._compiled = self._compile()
        return self._compiled

    @property
    def _numba_type_(self) -> Any:
        return self.dispatcher._numba_type_

    def _kept(self, arguments: tuple[Any, ...]) -> Any:
        Kernel._n_calls += 1
        try:
            key = tuple(map(_kind_of, arguments))
            found = self._code.get(key)
            if found is None and Kernel._n_calls < _MANY:
                with _LOCK, stopped():
                    found = self._code[key] = _load(self.py_func, arguments)
        except UnknownError:
            return self.dispatcher
        return self.dispatcher if found is None or Kernel._n_calls >= _MANY else found


# Arguments: what distinguishes their types, and what numba calls these.


def _kind_of(value: Any) -> Any:
    kind = type(value)
    if kind is np.ndarray:
        return value.dtype, value.ndim, value.flags.num
    return (kind, *map(_kind_of, value)) if issubclass(kind, tuple) else kind


def name_of(value: Any) -> str:
    """Return the name of an argument's type.

    As numba 0.68.1 has it: `Array` in core/types/npytypes.py, tuples in core/types/containers.py.
    """
    kind = type(value)
    if kind is np.ndarray:
        flags = value.flags
        layout = "C" if flags.c_contiguous else "F" if flags.f_contiguous else "A"
        readonly = "" if flags.writeable else "readonly "
        return f"{readonly}array({_name_of_number(value.dtype)}, {value.ndim}d, {layout})"
    if issubclass(kind, tuple):
        names = [name_of(each) for each in value]
        if value and names.count(names[0]) == len(names):
            return f"{'UniTuple' if kind is tuple else kind.__name__}({names[0]} x {len(names)})"
        return f"{'Tuple' if kind is tuple else kind.__name__}({', '.join(names)})"
    if kind in (bool, int, float, type(None)):
        return {bool: "bool", int: "int64", float: "float64", type(None): "none"}[kind]
    if issubclass(kind, np.generic):
        return _name_of_number(value.dtype)
    raise UnknownError


def _name_of_number(dtype: np.dtype[Any]) -> str:
    if dtype.kind not in "biuf" or not dtype.isnative:
        raise UnknownError
    return dtype.name


# Files: where numba keeps the code of a function, and what they hold.


def _indexes(function: Any) -> Iterator[tuple[Path, str]]:
    """Return where the index of a function's versions may be, and for which processor."""
    code, version = function.__code__, sys.version_info
    file = Path(code.co_filename)
    name = f"{file.stem}.{function.__qualname__}-{code.co_firstlineno}"
    name += f".py{version[0]}{version[1]}{getattr(sys, 'abiflags', '')}.nbi"
    hashed = f"{file.parent.name}_{hashlib.sha1(str(file.parent).encode()).hexdigest()}"  # noqa: S324
    given, home = os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME")
    if given:
        yield Path(given, hashed, name), ""
    else:
        yield file.parent / "__pycache__" / name, ""
        if sys.platform.startswith("linux"):
            yield Path(home or Path.home() / ".cache", "numba", hashed, name), ""
    for level in shipped.levels() if shipped.SHIPPED.exists() else ():
        for folder in shipped.SHIPPED.iterdir():
            yield folder / level / function.__module__ / name, level


class _Ghost:
    """Stands for an object of numba's compiler."""

    def __init__(self, *given: Any) -> None:
        self.given = given
        self.state: Any = {}

    def __setstate__(self, state: Any) -> None:
        self.state = state


def _type_of(_by: Any, about: tuple[Any, ...], state: Any) -> _Ghost:
    made = object.__new__(about[0])
    made.state = state or {}
    return made


class _Reader(pickle.Unpickler):
    """Reads numba's files, without numba."""

    def find_class(self, module: str, name: str) -> Any:
        """Return what a file names."""
        if name == "_type_reconstructor":
            return _type_of
        return _Ghost if module.startswith("numba.") else super().find_class(module, name)


_UNREADABLE = (OSError, EOFError, LookupError, AttributeError, ImportError, ValueError, TypeError)
"""What reading raises of files that are no longer, or not yet, as expected."""


def _load(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Return what runs the code of a function that is kept for arguments."""
    wanted = [name_of(each) for each in arguments]
    for path, level in _indexes(function):
        try:
            with path.open("rb") as file:
                if not _is_installed(pickle.load(file)):  # noqa: S301 - numba's, as it reads it
                    continue
                stamp, versions = _Reader(file).load()
            if stamp != shipped.stamp_of(function.__module__):
                continue
            for (types, target, _), name in versions.items():
                if [each.state["name"] for each in types] != wanted:
                    continue
                if target[1:] == ((level, "") if level else _processor()):
                    with path.with_name(name).open("rb") as file:
                        return _linked(function, _Reader(file).load())
        except FileNotFoundError:
            continue
        except _UNREADABLE as error:
            raise UnknownError from error
    raise UnknownError


# Code: what it needs, and a function of it.


@cache
def _home() -> Path:
    spec = find_spec("numba")
    if spec is None or not spec.submodule_search_locations:
        raise UnknownError
    return Path(spec.submodule_search_locations[0])


@cache
def _is_installed(version: str) -> bool:
    return (_home().parent / f"numba-{version}.dist-info").exists()


@cache
def _processor() -> tuple[str, str]:
    """Return name and features of this processor, as numba distinguishes them."""
    import llvmlite.binding as llvm  # noqa: PLC0415 - on demand

    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def _part(name: str) -> Any:
    """Load a compiled module of numba, without the packages round it."""
    if name not in sys.modules:
        path = _home().joinpath(*name.split(".")[1:])
        spec = spec_from_file_location(name, f"{path}{EXTENSION_SUFFIXES[0]}")
        if spec is None or spec.loader is None:
            raise UnknownError
        sys.modules[name] = module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


_MADE: dict[int, Any] = {}
"""Objects that code has unpickled, by the places of their bytes."""


def _unpickle(place: int, size: int, _digest: int) -> Any:
    """Return an object that code has as bytes: a class of results, an exception."""
    if place not in _MADE:
        _MADE[place] = pickle.loads(ctypes.string_at(place, size))  # noqa: S301 - a kernel's own
    return _MADE[place]


_UNPICKLE = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)(
    _unpickle
)


@cache
def _linker() -> tuple[Any, Any]:
    """Return llvmlite's binding and its engine, to which numba's helpers are known."""
    import builtins  # noqa: PLC0415

    import llvmlite.binding as llvm  # noqa: PLC0415

    helpers, functions = _part("numba._helperlib"), _part("numba._dynfunc")
    memory = _part("numba.core.runtime._nrt_python")
    memory.memsys_use_cpython_allocator()
    symbols = {"_Py_NoneStruct": id(None)}
    for part in (helpers, functions):
        symbols |= {f"numba_{name}": place for name, place in part.c_helpers.items()}
    symbols["numba_unpickle"] = ctypes.cast(_UNPICKLE, ctypes.c_void_p).value or 0
    for name, place in memory.c_helpers.items():
        symbols[name if name.startswith("_") else f"NRT_{name}"] = place
    for each in vars(builtins).values():
        if isinstance(each, type) and issubclass(each, BaseException):
            symbols[f"PyExc_{each.__name__}"] = id(each)
    for name, place in symbols.items():
        llvm.add_symbol(name, place)
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    triple = llvm.get_process_triple()
    machine = llvm.Target.from_triple(triple).create_target_machine(opt=3, jit=True)
    return llvm, llvm.create_mcjit_compiler(
        llvm.parse_assembly(f'target triple = "{triple}"'), machine
    )


def _linked(function: Any, entry: tuple[Any, ...]) -> Any:
    """Return a function of what numba keeps of a version: see `CompileResult._reduce` there."""
    (_, kind, (code, _)), _, own, _, is_python, lifted, needs, again, others = entry
    if kind != "object" or is_python or lifted or again or not needs:
        raise UnknownError
    llvm, engine = _linker()
    wrapper, *symbols = needs.split()
    if any(llvm.address_of_symbol(name) is None for name in symbols):
        raise UnknownError
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    functions, module = _part("numba._dynfunc"), sys.modules[function.__module__]
    kept = []
    for _, constants, name in (own.given, *(each.given for each in others)):
        made = functions.Environment(vars(module))
        made.consts[:] = constants
        place = engine.get_global_value_address(name)
        if place:
            ctypes.c_void_p.from_address(place).value = id(made)
        kept.append(made)
    place = engine.get_function_address(wrapper)
    if not place:
        raise UnknownError
    return functions.make_function(module, function.__name__, "", place, kept[0], tuple(kept))
