"""The one way to a compiled program: a function of one run -> the same of many, by machine code or by XLA.

Under "auto" it is machine code on a processor, and XLA wherever that cannot be had, for whatever reason: one warning then
says what was in the way. The caller knows nothing of it. The environment variable SMAJAX_ENGINE stands for "auto" where it is set.
"""

from __future__ import annotations

import importlib.util
import os
import warnings
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from threading import Event
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar, cast, get_args

import jax
import numpy as np

from smajax.core import worker_process
from smajax.core.beside import begun
from smajax.core.compiling import compiling
from smajax.core.operating_system import WINDOWS, available_cores
from smajax.engine import xla
from smajax.engine.arguments import (
    ONE_DIRECTION,
    Along,
    check_along,
    check_arguments,
    checked_threads,
    key_of,
    signature,
)
from smajax.engine.cache import versions
from smajax.engine.kernel import Stopped
from smajax.engine.text import Unsupported
from smajax.engine.traced import Function, Traced, collector_paused

if TYPE_CHECKING:
    from smajax.engine.native import MachineCode, NativeProgram

Engine = Literal["auto", "native", "xla"]
VARIABLE = "SMAJAX_ENGINE"
CACHED = 128  # programs that a process remembers
Made = TypeVar("Made")


class EngineWarning(UserWarning):
    """A program runs by XLA, several times slower, because machine code could not be made of it or failed; says why."""


class EngineError(ValueError):
    """An engine that there is not was asked for."""


# What goes wrong in machine code can end the process, so a system without a test has it on request only.
UNTRIED = (
    f"machine code was never tried on Windows, so XLA runs the programs, several times slower. {VARIABLE}=native tries it; "
    f"with {VARIABLE}=xla nothing is said."
)


@dataclass(frozen=True)
class Coming:
    """Results that are on their way: to be called for them, or stopped where they are no longer wanted (which XLA does not)."""

    result: Callable[[], Any]
    stop: Callable[[], None] = lambda: None

    def __call__(self) -> Any:
        return self.result()


def by_machine_code() -> bool:
    """Whether "auto" means machine code here, where nothing stands in the way of a single program."""
    engine = engine_of()
    return engine == "native" or (engine == "auto" and not WINDOWS and _has_llvmlite())


@cache
def _has_llvmlite() -> bool:
    return importlib.util.find_spec("llvmlite") is not None


class Program:
    """`function(model, own)` of one run, for many: `program(model, own)`.

    What goes wrong while machine code runs is raised under "native"; otherwise XLA takes over for good, with one warning.
    Raises ValueError for a model or arrays of another kind than it was made for.
    """

    def __init__(
        self,
        function: Function,
        model: Any,
        names: tuple[str, ...],
        alone: bool,
        native: NativeProgram | None,
        replaceable: bool = False,
        along: Along = ONE_DIRECTION,
    ) -> None:
        """`model` and `names` are what it is made for; `replaceable`: XLA may stand in for `native`."""
        self._function, self._alone, self._replaceable, self.native = function, alone, replaceable, native
        self._made_for, self._names, self._along = signature(model), names, along
        self._blocks = xla.BlockLengths()

    def __call__(
        self, model: Any, own: dict[str, np.ndarray], threads: int | None = None, stop: Event | None = None
    ) -> Any:
        """What the function gives, arrays of numpy, every leaf with one row a run; `own` are arrays of shape (runs,).

        With directions, `own` of `along` has shape (runs, directions), and every leaf (runs, directions, ...).
        `threads` of machine code: by default as many as there are cores. It raises Stopped soon after another thread has set `stop`.
        """
        check_arguments(self._made_for, self._names, model, own, self._along)
        threads = available_cores() if threads is None else checked_threads(threads)
        native = self.native
        if native is None:
            return self._by_xla(model, own)
        try:
            return native(model, own, threads, stop)
        except Stopped:
            raise
        except Exception as error:
            if not self._replaceable:
                raise
            failure = error
        # What XLA raises too is the caller's: it is raised, and machine code stays.
        results = self._by_xla(model, own)
        self.native = None
        _warn(failure, "failed while it ran")
        return results

    def _by_xla(self, model: Any, own: dict[str, np.ndarray]) -> Any:
        """The same by XLA, to which every direction is a run."""
        names, count = self._along
        if not names:
            return xla.evaluated(self._function, model, own, self._alone, self._blocks)
        each = {name: one.ravel() if name in names else np.repeat(one, count) for name, one in own.items()}
        results = xla.evaluated(self._function, model, each, self._alone, self._blocks)
        return jax.tree.map(lambda leaf: leaf.reshape(-1, count, *leaf.shape[1:]), results)

    def wait(self) -> None:
        """Until it is compiled, where that goes on beside the caller; what goes wrong there shows at the first call."""
        if self.native is not None:
            self.native.wait()

    def begin(
        self,
        model: Any,
        own: dict[str, np.ndarray],
        threads: int,
        devices: tuple[jax.Device, ...],
        block: int,
        room: int,
    ) -> Coming:
        """The same beside the caller, who gets the results by calling what this gives.

        `devices`, `block` and `room` (runs that one compilation has room for) are of XLA, `threads` of machine code.
        """
        check_arguments(self._made_for, self._names, model, own, self._along)
        if self.native is None:
            if self._along.names:
                return Coming(partial(self._by_xla, model, own))
            return Coming(xla.started(self._function, model, own, devices, block, room))
        stop = Event()
        coming = begun(self, model, own, threads, stop)
        if coming is None:  # done when it is asked for
            return Coming(partial(self, model, own, threads))
        return Coming(coming.result, stop.set)


def engine_of(requested: str = "auto") -> Engine:
    """The engine that is meant, with SMAJAX_ENGINE for "auto". Raises EngineError for one that there is not."""
    named = requested
    for engine, source in ((requested, "engine"), (os.environ.get(VARIABLE) or "auto", VARIABLE)):
        if engine == "lanes" and source == "engine":
            warnings.warn('`engine="lanes"` is "native" now; it goes in version 0.3', DeprecationWarning, stacklevel=3)
            return "native"
        if engine not in get_args(Engine):
            raise EngineError(f"{source} is {engine!r}; expected one of {', '.join(get_args(Engine))}.")
        named = engine if named == "auto" else named
    return cast(Engine, named)


def cached(made: dict[Hashable, Made], key: Hashable, make: Callable[[], Made]) -> Made:
    """What was made for a key before, or now; the least recently used makes room."""
    result = made.pop(key) if key in made else make()
    while len(made) >= CACHED:
        made.pop(next(iter(made)), None)
    made[key] = result
    return result


_programs: dict[Hashable, Program] = {}


# Keywords, which a caller names one by one.
def program(
    function: Function,
    model: Any,
    names: tuple[str, ...],
    *,
    alone: bool = False,
    engine: Engine = "auto",
    devices: Sequence[jax.Device] = (),
    beside: bool = False,
    quickly: bool = False,
    along: Along = ONE_DIRECTION,
) -> Program:
    """`function(model, own)` compiled for models of this kind; `names` are those of the numbers that a run has of its own.

    `alone`: for one run at a time. `devices`: where XLA would run it; under "auto" anything but a processor is XLA's. `beside`: it is compiled beside
    the caller, who waits for it at its first call, and may have others traced meanwhile. `quickly`: in half the time or less, of
    a program that is not run for long: a run takes a tenth longer. `along`: those of `names` of which a run has several numbers, one for each direction; machine code
    computes once a run what does not depend on them.
    Raises, under "native" alone, what stands in the way of machine code: Unsupported for what has no translation,
    ImportError without llvmlite, and whatever else goes wrong. What the function itself raises is always raised.
    """
    check_along(names, along)
    meant = engine_of(engine)
    if meant == "auto" and devices and devices[0].platform != "cpu":
        meant = "xla"
    wanted = Wanted(function, model, names, alone, quickly, along)
    key = wanted.key(meant)
    return cached(_programs, key, lambda: _made(wanted, key, meant, beside))


class Wanted(NamedTuple):
    """What a program is made of: arguments of `program`."""

    function: Function
    model: Any
    names: tuple[str, ...]
    alone: bool = False
    quickly: bool = False
    along: Along = ONE_DIRECTION

    def key(self, engine: Engine) -> Hashable:
        """Of the program, in a process."""
        return key_of(self.function, self.model, self.names), self.alone, engine, self.quickly, self.along


def begin_programs(wanted: Sequence[Wanted], first: bool = False) -> None:
    """Have the second process make them, where there is one (`worker_process`); `program` then gives them. `first`: before those that it was to make before."""
    engine = engine_of()
    if engine != "xla" and by_machine_code() and worker_process.is_there():
        for one in wanted:
            if (key := one.key(engine)) not in _programs:
                worker_process.begin(key, _code_to_send, tuple(one), first)


# In the second process, what it made for the first one: it may be called for the same.
_codes: dict[Hashable, MachineCode] = {}


def _code_to_send(*wanted: Any) -> MachineCode:
    """The machine code of `Wanted`, for the process that asks for it."""
    from smajax.engine.native import machine_code

    return cached(_codes, Wanted(*wanted).key(engine_of()), lambda: machine_code(*wanted))


def programs(wanted: Sequence[Wanted]) -> None:
    """Make several, for `program` to give: some by the second process, where there is one, and here each compiled beside the tracing of the next."""
    begin_programs(wanted[1:], first=True)
    engine, made = engine_of(), []
    left = {one.key(engine): one for one in wanted}
    while left:
        key = next((key for key in left if not worker_process.is_called(key)), next(iter(left)))
        made.append(program(**left.pop(key)._asdict(), beside=True))
    for one in made:
        one.wait()


@collector_paused()
def _made(wanted: Wanted, key: Hashable, engine: Engine, beside: bool) -> Program:
    function, model, names, alone, quickly, along = wanted
    made = partial(Program, function, model, names, alone, along=along)
    if engine == "xla":
        return made(None)
    # What goes wrong in here goes wrong by XLA too.
    with compiling():
        there = worker_process.taken(key)
        code = _codes.get(key) if there is None else there[0]
        known: MachineCode | Traced = Traced(function, model, names) if code is None else code
    if engine == "auto" and WINDOWS:
        _say(UNTRIED)
        return made(None)
    try:
        # Imported here: the translator reads names of JAX that a release may move, and then XLA has to run all the same.
        from smajax.engine.native import NativeProgram

        native = NativeProgram(known, names, alone, along, beside, quickly)
    except Exception as error:
        if engine == "native":
            raise
        _warn(error, "could not be made")
        return made(None)
    return made(native, replaceable=engine == "auto")


def reason(error: BaseException) -> str:
    """Why there is no machine code, with the operation at which it failed."""
    named = str(error) if isinstance(error, Unsupported) else f"{type(error).__name__}: {error}"
    # JAX adds notes too, on its tracebacks.
    return ", ".join(
        [named, *(note for note in getattr(error, "__notes__", ()) if note.startswith("while the operation"))]
    )


_said: set[str] = set()  # Python forgets what it has shown wherever a library changes a filter


def _warn(error: BaseException, what: str) -> None:
    _say(_message(error, what))


def _say(message: str) -> None:
    """Once in a process for each reason."""
    if message not in _said:
        warnings.warn(message, EngineWarning, stacklevel=1)
        _said.add(message)


def _message(error: BaseException, what: str) -> str:
    if isinstance(error, ImportError) and (error.name or "").split(".")[0] == "llvmlite":
        return (
            f"machine code needs llvmlite, which cannot be imported ({error}): XLA is used, several times slower. "
            "`pip install llvmlite` brings it; with SMAJAX_ENGINE=xla nothing is said."
        )
    return (
        f"machine code of a program {what}, so XLA runs it, several times slower: {reason(error)} ({versions()}). Where the model "
        "is smajax's own, please report this line with what `smajax doctor --json` says. SMAJAX_ENGINE=xla takes XLA at once."
    )
