"""Compilation of kernels, and the only place that decides about their cache."""

from __future__ import annotations

import logging
import multiprocessing
import sys
import time
import warnings
from functools import cache, cached_property, partial
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar

import llvmlite.binding as llvm
import numba
from numba.core import cgutils, types
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
from numba.extending import intrinsic, overload, register_jitable
from numba.np.numpy_support import as_dtype

from hybridnav._base import shipped
from hybridnav._base.clock import listen
from hybridnav._base.trig import IN_KERNELS
from hybridnav.errors import CacheWarning

_LOG = logging.getLogger("hybridnav.kernels")

for _function in IN_KERNELS:
    register_jitable(_function)

listen()


def compiled(function: Any, options: dict[str, Any]) -> Any:
    """Return a function that numba compiles when it is called; itself where numba is told not to.

    `options`: options of `numba.njit`.
    """
    wanted = {**options, "no_cfunc_wrapper": True, "cache": False}  # never called from C
    kernel = numba.njit(**wanted)(function)
    if isinstance(kernel, CPUDispatcher):
        kernel.__class__ = _Kernel
        if options.get("cache"):
            kernel.enable_caching()
    return kernel


def guarded(kernel: Any) -> Any:
    """See `jit.guarded`."""
    if isinstance(kernel, CPUDispatcher):
        kernel.__class__ = _Guarded
    return kernel


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


class _Stamped(CompileResultCacheImpl):
    """What is kept of a compiled kernel; it holds while nothing that it is made of changes."""

    def __init__(self, py_func: Any) -> None:
        super().__init__(py_func)  # type: ignore[no-untyped-call]
        self._locator.get_source_stamp = partial(shipped.stamp_of, py_func.__module__)


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
        others[4] = " ".join([names[1], *_undefined(cres.library)])  # for `kept.Kernel`
        return ((name, kind, (code, llvm.parse_assembly(stub).as_bitcode())), about, *others)


def _undefined(library: Any) -> list[str]:
    """Return the symbols that compiled code takes from outside."""
    module = library._final_module  # noqa: SLF001 - numba has no other access
    declared = (each for each in (*module.functions, *module.global_variables))
    return [
        each.name for each in declared if each.is_declaration and not each.name.startswith("llvm.")
    ]


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
        if kept is not None or not shipped.SHIPPED.exists():
            return kept
        key: Any = self._index_key(sig, target_context.codegen())  # type: ignore[no-untyped-call]
        _, (triple, *_), code = key
        for level in shipped.levels():
            entry = self._shipped(level).load((sig, (triple, level, ""), code))
            if entry is not None:
                return self._impl.rebuild(target_context, entry)
        return None

    def _shipped(self, level: str) -> Any:
        folder = shipped.SHIPPED / numba.__version__ / level / self._py_func.__module__
        stamp = self._impl.locator.get_source_stamp()
        name = self._impl.filename_base
        return IndexDataCacheFile(str(folder), name, stamp)  # type: ignore[no-untyped-call]

    def is_warm(self) -> bool:
        """Return whether a version of the kernel is kept, or none can be."""
        places = [self._cache_file, *map(self._shipped, shipped.levels())]
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


@cache
def array_at(n_axes: int, is_fixed: bool, kind_of: Any, refusal: Any) -> Any:  # noqa: FBT001 - keys of a cache
    """Return what kernels call for an array of `kernels.places`; numba's `carray` makes an array of
    a pointer in the same way, but none that is read only.

    `kind_of`, `refusal`: those of `kernels.places`.
    """
    arrays: Any = import_module("numba.np.arrayobj")  # without types

    def made(_typing: Any, places: Any, k: Any, dtype: Any) -> Any:
        made_of = types.Array(dtype.dtype, n_axes, "C", readonly=is_fixed)
        of_elements = as_dtype(dtype.dtype)

        def build(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            table = arrays.make_array(signature.args[0])(context, builder, given[0])
            at = builder.mul(context.cast(builder, given[1], k, types.intp), cgutils.intp_t(4))
            place, *shape, kind = (
                builder.load(builder.gep(table.data, [builder.add(at, cgutils.intp_t(i))]))
                for i in (*range(1 + n_axes), 3)
            )
            wanted = cgutils.intp_t(kind_of(of_elements, n_axes))
            with builder.if_then(builder.icmp_signed("!=", kind, wanted), likely=False):
                told = (refusal(of_elements, n_axes),)
                context.call_conv.return_user_exc(builder, TypeError, told)
            element = context.get_data_type(made_of.dtype)
            size = cgutils.intp_t(context.get_abi_sizeof(element))
            array = arrays.make_array(made_of)(context, builder)
            arrays.populate_array(
                array,
                data=builder.inttoptr(place, element.as_pointer()),
                shape=shape,
                strides=[builder.mul(size, each) for each in shape[1:]] + [size],
                itemsize=size,
                meminfo=None,  # nobody counts who uses it
            )
            return array._getvalue()  # noqa: SLF001 - numba's way

        return made_of(places, k, dtype), build

    return intrinsic(made)


class _Renewed(CPUDispatcher):
    """A kernel whose kept code is dropped if it cannot be read.

    An index of the cache names the types of arguments by their modules. One that another version of
    this package wrote may name a module that is gone, and numba reads it before it compares dates.
    """

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or load it from the cache."""
        while shipped.OVERLOADS:
            of, by = shipped.OVERLOADS.pop()
            overload(of)(by)
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
            raised = shipped.cause_of(error)
        raise raised
