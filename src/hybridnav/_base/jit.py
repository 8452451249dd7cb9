"""Compilation of kernels, and the only place that decides about their cache."""

from __future__ import annotations

import hashlib
import logging
import multiprocessing
import re
import sys
import time
import warnings
from collections.abc import Callable
from functools import cache, cached_property, partial
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar, TypeVar

import llvmlite.binding as llvm
import numba
from numba.core import types
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    InTreeCacheLocator,
    UserProvidedCacheLocator,
    UserWideCacheLocator,
)
from numba.core.registry import CPUDispatcher
from numba.core.runtime.nrt import rtsys
from numba.extending import register_jitable

from hybridnav._base.trig import IN_KERNELS
from hybridnav.errors import CacheWarning

Kernel = TypeVar("Kernel")

_LOG = logging.getLogger("hybridnav.kernels")

for _function in IN_KERNELS:
    register_jitable(_function)


SHIPPED = Path(__file__).parents[1] / "compiled"
"""Folder of compiled kernels that a wheel brings, in one folder for each version of numba."""
LEVELS: dict[str, tuple[str, ...]] = {
    "x86-64-v3": ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"),
    "x86-64": (),
}
"""Processors that a wheel brings kernels for, as LLVM names them, and their features, best first.

A pyramid of the office grew as fast with code for AVX2 as with code for the processor that it was
measured on, and took 1.2 times as long with that for all processors."""


def njit(**options: Any) -> Callable[[Any], Any]:
    """Compile a function like `numba.njit`, or take the code that the wheel brought.

    numba keeps compiled code beside the module or in the user's home. Where it can write to neither
    (a read-only installation, a user without a home) it refuses the function; here nothing is kept.

    `options`: options of `numba.njit`.
    """

    def decorate(function: Any) -> Any:
        wanted = {**options, "no_cfunc_wrapper": True, "cache": False}  # never called from C
        kernel = numba.njit(**wanted)(function)
        if isinstance(kernel, CPUDispatcher):
            kernel.__class__ = _Kernel
            if options.get("cache"):
                kernel.enable_caching()
        return kernel

    return decorate


@cache
def _tell() -> None:
    """Warn, once and not in each process of a pool."""
    if multiprocessing.parent_process() is None:
        warnings.warn(
            f"{CacheWarning.opening} in which numba could keep compiled code, so every start "
            "compiles anew, for up to some minutes; to keep it set the environment variable "
            "NUMBA_CACHE_DIR to a folder that can be written",
            CacheWarning,
            stacklevel=4,
        )


_IMPORT = re.compile(r"^from ([\w.]+) import (?:\(([^)]*)\)|(.*))", re.MULTILINE)


@cache
def _source(module: str) -> tuple[bytes, list[str]]:
    """Return the text of a module, and the modules that it may import from."""
    file = getattr(sys.modules.get(module), "__file__", None)
    text = b"" if file is None else Path(file).read_bytes()
    imported = []
    for of, *names in _IMPORT.findall(text.decode()):
        imported += [of, *(f"{of}.{name}" for name in re.findall(r"\w+", " ".join(names)))]
    return text, imported


@cache
def _stamp(module: str) -> str:
    """Return a digest of a module and of what it imports of its own package, and so on.

    numba asks for the module alone, and would run kept code of kernels that others changed.
    """
    package, found, to_see = module.partition(".")[0], dict[str, bytes](), [module]
    while to_see:
        name = to_see.pop()
        if name not in found and name.partition(".")[0] == package:
            found[name], imported = _source(name)
            to_see += imported
    return hashlib.sha256(b"".join(found[name] for name in sorted(found))).hexdigest()


class _Stamped(CompileResultCacheImpl):
    """What is kept of a compiled kernel; it holds while nothing that it is made of changes."""

    def __init__(self, py_func: Any) -> None:
        super().__init__(py_func)  # type: ignore[no-untyped-call]
        self._locator.get_source_stamp = partial(_stamp, py_func.__module__)


class _Nowhere(UserWideCacheLocator):
    """The place of compiled code where no folder can be written."""

    def ensure_cache_path(self) -> None:
        """Ask for no folder."""


class _Entries(_Stamped):
    """What is kept of a compiled kernel: the machine code.

    numba adds the code that compiled callers link to, which are the twins' alone, and a listing:
    three quarters of the bytes.
    """

    _locator_classes: ClassVar = [  # type: ignore[misc]
        *(UserProvidedCacheLocator, InTreeCacheLocator, UserWideCacheLocator),
        _Nowhere,
    ]

    def reduce(self, cres: Any) -> Any:
        """Return what is written of a compiled kernel."""
        (name, kind, (code, _)), about, *others = super().reduce(cres)  # type: ignore[no-untyped-call]
        # numba asks that code which functions there are.
        names = about.llvm_func_name, about.llvm_cpython_wrapper_name
        stub = "".join(f'define void @"{one}"() {{ ret void }}\n' for one in names)
        others[4] = ""
        return ((name, kind, (code, llvm.parse_assembly(stub).as_bitcode())), about, *others)


class _InnerCache(FunctionCache):
    """Kept code of a twin, which its callers link to."""

    _impl_class = _Stamped


class _Cache(FunctionCache):
    """Kept code of a kernel: what was compiled for this processor, or what the wheel brought.

    The wheel's is read only. numba's key of an entry holds the name and features of a processor;
    there it holds one of `LEVELS`.
    """

    _impl_class = _Entries

    @property
    def cache_path(self) -> Any:
        """Folder of what is compiled here, None where none can be written."""
        return None if isinstance(self._impl.locator, _Nowhere) else self._cache_path

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load code, without the declarations that only a compiler needs: a sixth of a start."""
        rtsys.initialize(target_context)
        kept = self._load_overload(sig, target_context)
        if kept is None:
            _load_arrays()
        return kept

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        kept = None
        if self.cache_path is not None:
            kept = super()._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        if kept is not None or not SHIPPED.exists():
            return kept
        key: Any = self._index_key(sig, target_context.codegen())  # type: ignore[no-untyped-call]
        _, (triple, *_), code = key
        for level in levels():
            entry = self._shipped(level).load((sig, (triple, level, ""), code))
            if entry is not None:
                return self._impl.rebuild(target_context, entry)
        return None

    def _shipped(self, level: str) -> Any:
        folder = SHIPPED / numba.__version__ / level / self._py_func.__module__
        stamp = self._impl.locator.get_source_stamp()
        name = self._impl.filename_base
        return IndexDataCacheFile(str(folder), name, stamp)  # type: ignore[no-untyped-call]

    def is_warm(self) -> bool:
        """Return whether a version of the kernel is kept, or none can be."""
        places = [self._cache_file, *map(self._shipped, levels())]
        return self.cache_path is None or any(Path(one._index_path).exists() for one in places)  # noqa: SLF001

    def _save_overload(self, sig: Any, data: Any) -> None:
        if self.cache_path is not None:
            super()._save_overload(sig, data)  # type: ignore[no-untyped-call]


@cache
def _load_arrays() -> None:
    """Load numba's functions of arrays without the linear algebra of scipy, for which they look.

    That takes longer than the rest of a first kernel, and none of ours multiplies matrices. Whoever
    does in this process still can: numba looks again when it compiles such a product.
    """
    blas = "scipy.linalg.cython_blas"
    if blas in sys.modules:
        return
    sys.modules[blas] = None  # type: ignore[assignment]
    try:
        vars(import_module("numba.np.arraymath"))["_HAVE_BLAS"] = True  # scipy has it
    finally:
        del sys.modules[blas]


def is_for_another_numba() -> bool:
    """Return whether a wheel brought kernels that this version of numba cannot read."""
    return SHIPPED.exists() and not (SHIPPED / numba.__version__).exists()


@cache
def levels() -> list[str]:
    """Return the levels of `LEVELS` that this processor has."""
    has = llvm.get_host_cpu_features()
    return [level for level, features in LEVELS.items() if all(map(has.get, features))]


class _Renewed(CPUDispatcher):
    """A kernel whose kept code is dropped if it cannot be read.

    An index of the cache names the types of arguments by their modules. One that another version of
    this package wrote may name a module that is gone, and numba reads it before it compares dates.
    """

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or load it from the cache."""
        try:
            return super().compile(sig)
        except (AttributeError, ImportError):
            self._cache.flush()  # type: ignore[attr-defined]
            return super().compile(sig)


class _Inner(_Renewed):
    """The twin of a kernel that other kernels call.

    A first plan spends most of its time in the compiler. A quarter of that went into wrappers for
    Python of kernels that Python never calls, and into one version of each for every integer
    literal.
    """

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile for the types of the arguments, not for their values."""
        return super().get_call_template(tuple(map(_type_of, args)), kws)

    def add_overload(self, cres: Any) -> None:
        """Hide compiled code from Python, which cannot call it."""
        self.overloads[tuple(cres.signature.args)] = cres


def _type_of(argument: Any) -> Any:
    """Return the type of an argument whose value may be known."""
    return types.unliteral(argument)  # type: ignore[no-untyped-call]


class _Kernel(_Renewed):
    """A kernel that Python calls; other kernels call its twin. Slow compilations are logged."""

    def enable_caching(self) -> None:
        """Keep what is compiled, and look for what is kept."""
        del self._cache

    @cached_property
    def _cache(self) -> _Cache:
        """The cache of a kernel that is called: a plan calls one of eight that it imports."""
        return _Cache(self.py_func)  # type: ignore[no-untyped-call]

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or load it from the cache."""
        began, n_missed = time.perf_counter(), self._n_missed()
        entry = super().compile(sig)
        if self._n_missed() > n_missed:
            seconds, name = time.perf_counter() - began, self.py_func.__name__
            is_kept = self.stats.cache_path is not None
            if not is_kept and isinstance(self._cache, _Cache):
                _tell()
            about = {"seconds": seconds, "is_kept": is_kept}
            _LOG.info("compiled %s in %.1f s", name, seconds, extra=about)
        return entry

    def is_warm(self) -> bool:
        """Return whether a version of the kernel is kept, or none can be."""
        return not isinstance(self._cache, _Cache) or self._cache.is_warm()

    def _n_missed(self) -> int:
        """Return the number of cache misses."""
        return sum(self.stats.cache_misses.values())

    @cached_property
    def inner(self) -> _Inner:
        """The twin, under another name in the cache."""
        code = self.py_func
        twin = FunctionType(code.__code__, code.__globals__, code.__name__, code.__defaults__)
        twin.__qualname__ = f"{code.__qualname__}_inner"
        options = {**self.targetoptions, "no_cpython_wrapper": True, "cache": False}
        kernel: Any = numba.jit(**options)(twin)
        kernel.__class__ = _Inner
        if self.stats.cache_path is not None:
            kernel._cache = _InnerCache(twin)  # type: ignore[no-untyped-call]  # noqa: SLF001
        return kernel

    @property
    def _numba_type_(self) -> Any:
        return types.Dispatcher(self.inner)


class _Guarded(_Kernel):
    """A kernel that re-raises an exception from the conversion of its results to Python objects."""

    def __call__(self, *arguments: Any) -> Any:
        try:
            return super().__call__(*arguments)
        except SystemError as error:
            raised: BaseException = error
            while isinstance(raised, SystemError) and raised.__cause__ is not None:
                raised = raised.__cause__
            if raised is error:
                raise
        raise raised


def guarded(kernel: Kernel) -> Kernel:
    """Make a kernel raise the exception of a signal handler.

    A handler runs as soon as Python does, which is when numba makes arrays of the results. With
    several results numba continues with the next one: it returns a broken tuple with the exception
    set, which Python turns into a SystemError with the exception as its cause.
    """
    if isinstance(kernel, CPUDispatcher):
        kernel.__class__ = _Guarded  # type: ignore[assignment]
    return kernel
