"""Compiling: functions that are compiled each on its own and call each other by symbol; laws called by address.

    inline   put into its callers, for what is small or called in one place
    unit     compiled once, apart from its callers, neither linked nor inlined into them
    compiled linked into its callers, for what makes arrays
    kernel   what Python calls; it compiles, or fetches, itself and every unit that it needs when it is first called

A unit is kept under its own digest, so that an edited one compiles anew alone; what only calls it stays as it is.
All that leans on numba's inside is in this file: its calling convention, its records of compiled code and its cache
(numba 0.61 to 0.68). Under NUMBA_DISABLE_JIT=1 every decorator leaves the plain function. An address holds in one
process only, so none is kept in anything that may go to another.
"""

from __future__ import annotations

import inspect
import logging
import math
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache, cached_property, wraps
from pathlib import Path

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import cgutils, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.runtime import rtsys
from numba.extending import intrinsic

from ers_mj.plants.compiling.code_folder import code_folder, complaint, one_at_a_time, shelves
from ers_mj.plants.compiling.digest import digest_of, read_by
from ers_mj.processes.passing import remove

MANY = 4  # parts to compile of which it is worth saying so
SECONDS_EACH = 0.6
THIS_FILE = Path(__file__).read_text()
IS_PLAIN = bool(numba.config.DISABLE_JIT)
# without counts of who holds an array, atomic additions that cost more than the arithmetic of a small function, and
# without what Python or C would call it by
INNER = {"nogil": True, "_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
OUTER = {"nogil": True, "no_cfunc_wrapper": True}


@dataclass(eq=False)
class Piece:
    """A function that is compiled apart: a unit, a kernel or a law.

    Attributes:
        name: of the module and the function; a unit's symbol.
        signature: numba's, the only one that it is compiled for.
        options: of numba's compiler.
        stand: what its callers' code names in its place, of a unit.
        dispatcher: numba's, once it is compiled.
    """

    function: Callable
    name: str
    signature: object
    options: dict
    stand: object = field(default=None, init=False)
    dispatcher: object = field(default=None, init=False)

    @property
    def told(self) -> str:
        """What a caller's code depends on."""
        return f"{self.name} {self.signature}"

    @property
    def address(self) -> int:
        """Where its code lies in this process."""
        (result,) = self.dispatcher.overloads.values()
        return result.library.get_pointer_to_function(result.fndesc.llvm_func_name)

    @cached_property
    def stem(self) -> str:
        """Of the names of its files in the cache: they hold for one state of the code, one numba and one processor."""
        made_by = (numba.__version__, numba.config.CPU_NAME or llvm.get_host_cpu_name(), THIS_FILE)
        made = digest_of(self.function, _told, str(self.signature), str(self.options), *made_by)
        return f"{self.name}-{made}.py{sys.version_info[0]}{sys.version_info[1]}"

    def reached(self) -> list[object]:
        """The units that its code calls and the functions that are put into it, those that others name before them."""
        found = {}

        def visit(function: Callable) -> None:
            for _, value in read_by(function):
                if id(value) not in found and (id(value) in _PIECES or hasattr(value, "py_func")):
                    if hasattr(value, "py_func"):
                        visit(value.py_func)
                    found[id(value)] = value

        visit(self.function)
        return list(found.values())

    def needs(self) -> Iterator[Piece]:
        """The units that its code calls, and those of what is put into it."""
        return (_PIECES[id(value)] for value in self.reached() if id(value) in _PIECES)


_PIECES: dict[int, Piece] = {}  # units, by the identity of what stands for them in code
_TOLD: dict[int, str] = {}  # what a digest says of an intrinsic of this file, by its identity
_SIGNATURES: dict[int, tuple] = {}  # what is put into callers for one signature alone, with it, by its identity
_COMPILING = threading.RLock()


def _told(value: object) -> str | None:
    return _PIECES[id(value)].told if id(value) in _PIECES else _TOLD.get(id(value))


def compiled(function: Callable) -> Callable:
    """Compile a function that makes arrays, linked into those that call it."""
    return numba.njit(**{**INNER, "_nrt": True})(function)


def inline(function: Callable) -> Callable:
    """Compile a function that makes no arrays of its own into those that call it."""
    return numba.njit(forceinline=True, **INNER)(function)


def inline_as(signature) -> Callable[[Callable], Callable]:
    """As ``inline``, compiled for this signature alone: of what is called with numbers written out, for each of which
    numba would make a copy.
    """

    def declare(function: Callable) -> Callable:
        compiled = inline(function)
        if IS_PLAIN:
            return compiled
        _SIGNATURES[id(compiled)] = (compiled, signature)
        return compiled

    return declare


def unit(signature) -> Callable[[Callable], Callable]:
    """Compile a function that makes no arrays once, apart from its callers, which call its symbol."""

    def declare(function: Callable) -> Callable:
        if IS_PLAIN:
            return function
        piece = Piece(function, f"{function.__module__}.{function.__qualname__}", signature, INNER)

        def find(builder, function_type, arguments):
            return cgutils.get_or_insert_function(builder.module, function_type, piece.name), arguments

        stand = _intrinsic(signature.args, lambda *_: (signature, _calling(signature, find)))
        piece.stand = stand
        _PIECES[id(stand)] = piece
        return stand

    return declare


def kernel(signature) -> Callable[[Callable], Callable]:
    """A function that Python calls, compiled or fetched with all that it needs when it is first called."""

    def declare(function: Callable) -> Callable:
        if IS_PLAIN:
            return function
        piece = Piece(function, f"{function.__module__}.{function.__qualname__}", signature, OUTER)

        @wraps(function)
        def called(*arguments):
            if piece.dispatcher is None:
                make(piece)
            return piece.dispatcher(*arguments)

        called.piece = piece
        return called

    return declare


@cache
def address_of(function: Callable, signature) -> int:
    """Of a law, compiled now where it was not before; where nothing is compiled a number that stands for it."""
    if IS_PLAIN:
        _PLAIN_LAWS.append(function)
        return len(_PLAIN_LAWS)
    function = getattr(function, "py_func", function)
    piece = Piece(function, f"{function.__module__}.{function.__qualname__}", signature, INNER)
    make(piece)
    _LAWS.append(piece)  # whose code lasts as long as it is held
    return piece.address


_LAWS: list[Piece] = []
_PLAIN_LAWS: list[Callable] = []


def by_address(record: types.Record, signature) -> Callable:
    """A call of the function at an address, of the ``constants`` that a ``record`` holds and of what else is given."""
    if IS_PLAIN:
        return lambda address, law, *rest: _PLAIN_LAWS[address - 1](law["constants"].tolist(), *rest)

    def find(builder, function_type, arguments):
        address, law, *rest = arguments
        constants = cgutils.pointer_add(builder, law, record.offset("constants"), cgutils.ir.DoubleType().as_pointer())
        return builder.inttoptr(address, function_type.as_pointer()), [constants, *rest]

    given = (types.int64, record, *signature.args[1:])
    stand = _intrinsic(given, lambda *_: (signature.return_type(*given), _calling(signature, find)))
    _TOLD[id(stand)] = f"{record} {signature}"
    return stand


def record_in(dtype: np.dtype) -> Callable:
    """A function that sees an array of numbers as a record of this ``dtype``, without a copy."""
    if IS_PLAIN:
        return lambda array: array.view(dtype)[0]
    record = numba.from_dtype(dtype)

    def typing(_, array):
        def generate(context, builder, signature, arguments):
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            return builder.bitcast(data, context.get_value_type(record))

        return record(array), generate

    stand = _intrinsic((None,), typing)
    _TOLD[id(stand)] = f"record {record}"
    return stand


def _intrinsic(arguments: tuple, typing: Callable) -> Callable:
    """Numba's intrinsic of as many parameters as there are ``arguments``."""

    def typed(*given):
        return typing(*given)

    names = ["context", *(f"a_{k}" for k in range(len(arguments)))]
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    typed.__signature__ = inspect.Signature([inspect.Parameter(name, kind) for name in names])
    return intrinsic(typed)


def _calling(signature, find: Callable) -> Callable:
    """What writes the call of the function that ``find`` finds; an error there is passed on as one here."""

    def generate(context, builder, _, arguments):
        convention, result, given = context.call_conv, signature.return_type, signature.args
        function, passed = find(builder, convention.get_function_type(result, given), arguments)
        status, value = convention.call_function(builder, function, result, given, passed)
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return value

    return generate


def make(piece: Piece) -> None:
    """Compile a piece and all that it needs, or fetch what is kept."""
    with _COMPILING:
        if all(_is_kept(each) for each in _in_order(piece)):
            _make_all(piece)
            return
        with one_at_a_time():
            missing = sum(not _is_kept(each) for each in _in_order(piece))
            if missing >= MANY:
                where = f" ({complaint()})" if complaint() else ""
                _tell(
                    f"compiling {missing} parts of the simulator ({piece.name}) for this machine, once: "
                    f"about {math.ceil(SECONDS_EACH * missing)} s{where}"
                )
            _make_all(piece)


@cache
def _tell(sentence: str) -> None:
    """Say something once."""
    logging.getLogger(__name__).warning(f"ers-mj: {sentence}")


def _in_order(piece: Piece) -> list[Piece]:
    """A piece and those that it needs and has not yet, callees first: a symbol that is missing ends the process."""
    found = {}

    def visit(each: Piece) -> None:
        if each.dispatcher is None and each not in found:
            for other in each.needs():
                visit(other)
            found[each] = None

    visit(piece)
    return list(found)


def _is_kept(piece: Piece) -> bool:
    return _shelf(piece) is not None


def _shelf(piece: Piece) -> Path | None:
    """The folder in which a piece is kept; None where it is in none."""
    return next((folder for folder in shelves() if (folder / f"{piece.stem}.nbi").exists()), None)


def _make_all(piece: Piece) -> None:
    for each in _in_order(piece):
        if not _is_kept(each):
            _prepare(each)
        dispatcher = numba.njit(**each.options)(each.function)
        dispatcher._cache = _cache_of(each)
        dispatcher.compile(each.signature)
        dispatcher.disable_compile()  # for other arguments: these convert
        each.dispatcher = dispatcher
        if each.stand is not None:
            llvm.add_symbol(each.name, each.address)


def _prepare(piece: Piece) -> None:
    """Compile what is put into a piece for one signature alone, before numba finds others."""
    for value in piece.reached():
        if id(value) in _SIGNATURES and not value.signatures:
            value.compile(_SIGNATURES[id(value)][1])
            value.disable_compile()


def _cache_of(piece: Piece) -> FunctionCache:
    """Numba's cache of one function, under a name of ours."""

    class Kept(FunctionCache):
        _impl_class = staticmethod(lambda _: _Place(piece))

        def load_overload(self, signature, target):
            """What is kept; nothing where that is not whole. As numba's, without reading all that numba knows how to
            compile (and scipy.linalg for it): what is kept is linked, and who compiles reads it then.
            """
            rtsys.initialize(target)
            try:
                with self._guard_against_spurious_io_errors():
                    return self._load_overload(signature, target)
            except Exception as error:  # pickle raises whatever the bytes say
                _tell(f"{self.cache_path} is not whole ({type(error).__name__}), what is missing is compiled again")
                self._cache_file = _Place(piece).fresh()
                return None

        def save_overload(self, signature, data):
            """Keep it, where there is room."""
            try:
                super().save_overload(signature, data)
            except OSError as error:
                _tell(f"{self.cache_path} takes no compiled code ({error.strerror}), the next call compiles it again")

    return Kept(piece.function)


class _Place(CompileResultCacheImpl):
    """Where numba keeps a piece; it is its own locator."""

    def __init__(self, piece: Piece):
        self.piece = piece
        self._locator, self._filename_base, self._lineno = self, piece.stem, piece.function.__code__.co_firstlineno
        self._py_file = piece.function.__code__.co_filename

    def fresh(self) -> IndexDataCacheFile:
        """The files where code is written, with nothing in them."""
        remove(code_folder() / f"{self._filename_base}.nbi")
        return IndexDataCacheFile(str(code_folder()), self._filename_base, self.get_source_stamp())

    def ensure_cache_path(self) -> None:
        """The folder is there."""

    def get_cache_path(self) -> str:
        return str(_shelf(self.piece) or code_folder())

    def get_source_stamp(self) -> str:
        return self._filename_base
