"""Machine code of a translated program, and threads that run it."""

from __future__ import annotations

import ctypes
import struct
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np

from smajax.engine.text import NAME, Array

ALIGNED = 64  # bytes
# Of LLVM; part of the key of a cached program. Every instruction is on a whole vector already, and a step is long enough as
# it is, so that vectorization and unrolling of loops would only cost time.
COMPILE_OPTIONS = {
    "codegen_level": 3,
    "speed_level": 3,
    "loop_vectorization": False,
    "slp_vectorization": False,
    "loop_unrolling": False,
}
# In half to a quarter of the time, for a tenth of a run's, of very long programs a third: of programs that are not run for long.
QUICK = {"codegen_level": 0}
# Characters of a program beyond which LLVM's passes on loops cost more than they gain: half of its time or more, for a twentieth of a run's.
LONG = 800_000
# Machine code answers no Ctrl-C, so it is called for some groups of runs at a time: for as long as this, and at most so many times as many groups as before.
PIECE_SECONDS = 0.25
GROWTH = 4


def options_of(quickly: bool) -> dict[str, Any]:
    """LLVM's options; `quickly`: of a program that is not run for long."""
    return {**COMPILE_OPTIONS, **QUICK, "quickly": True} if quickly else COMPILE_OPTIONS


def _machine(quickly: bool = False) -> Any:
    """A new one for every program: what runs a program takes it over."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = ",".join(f"{'+' if has else '-'}{name}" for name, has in sorted(_features().items()))
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=features, opt=options_of(quickly)["codegen_level"], jit=True
    )


def _features() -> dict[str, bool]:
    """What the processor can do; nothing beyond the least where LLVM does not know it."""
    import llvmlite.binding as llvm

    try:
        return dict(llvm.get_host_cpu_features())
    except RuntimeError:
        return {}


@cache
def vector_bits() -> int:
    """Of the processor's widest vectors."""
    return 512 if has_wide_vectors() else 256 if _features().get("avx") else 128


@cache
def has_wide_vectors() -> bool:
    """Whether it has AVX-512, with the instructions on 64-bit numbers."""
    features = _features()
    return all(bool(features.get(name)) for name in ("avx512f", "avx512dq", "avx512vl"))


@cache
def divides_slowly() -> bool:
    """Whether an estimate of 1/x and Newton's steps are quicker than the processor's own division of its widest vectors.

    AMD's divide in half the time of others, and beside all else that they do.
    """
    import llvmlite.binding as llvm

    return has_wide_vectors() and not llvm.get_host_cpu_name().startswith("znver")


def _aligned(count: int) -> np.ndarray:
    raw = np.empty(count + ALIGNED, np.uint8)
    start = -raw.ctypes.data % ALIGNED
    return raw[start : start + count]


def processor() -> str:
    """Its name and what it can do: machine code is of one kind of processor."""
    import llvmlite.binding as llvm

    able = ",".join(name for name, has in sorted(_features().items()) if has)
    return f"{llvm.get_default_triple()} {llvm.get_host_cpu_name()} {able}"


def compiled(text: str, quickly: bool = False) -> bytes:
    """The machine code of a program by its text, an object file."""
    import llvmlite.binding as llvm

    machine = _machine(quickly)
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=COMPILE_OPTIONS["speed_level"])
    for name in ("loop_vectorization", "slp_vectorization", "loop_unrolling"):
        setattr(options, name, COMPILE_OPTIONS[name])
    builder = llvm.create_pass_builder(machine, options)
    _passes(builder, few=quickly or len(text) > LONG).run(module, builder)
    return bytes(machine.emit_object(module))


def _passes(builder: Any, few: bool) -> Any:
    """LLVM's own passes for its level; `few`: the one alone that makes a long program quicker.

    Not its new numbering of values (NewGVN), which ends the process at some programs of 2 MB ("Seem to have processed the same Value a lot",
    llvmlite 0.50), and gains nothing: the translator gives equal values one name.
    """
    import llvmlite.binding as llvm

    if not few or not COMPILE_OPTIONS["speed_level"]:
        return builder.getModulePassManager()
    passes = llvm.create_new_module_pass_manager()
    passes.add_instruction_combine_pass()
    return passes


class UnresolvedSymbol(RuntimeError):
    """Machine code calls functions that this process does not have; to link it would end the process."""


def undefined_symbols(code: bytes) -> list[str]:
    """Names that an object file of the kind ELF (64 bits, little-endian) needs from elsewhere; none for other kinds of file.

    The symbol table is the section of type 2 (SHT_SYMTAB), its entries of 24 bytes, and section 0 (SHN_UNDEF) is that of what
    is defined elsewhere (System V ABI, chapter 4).
    """
    if code[:6] != b"\x7fELF\x02\x01":
        return []
    (headers,) = struct.unpack_from("<Q", code, 0x28)
    size, count = struct.unpack_from("<HH", code, 0x3A)
    sections = [struct.unpack_from("<IIQQQQII", code, headers + number * size) for number in range(count)]
    names = []
    for _, kind, _, _, start, length, link, _ in sections:
        if kind != 2:
            continue
        texts = sections[link][4]
        for place in range(start, start + length, 24):
            name, _, _, section = struct.unpack_from("<IBBH", code, place)
            if name and section == 0:
                names.append(code[texts + name : code.index(b"\0", texts + name)].decode())
    return sorted(names)


def _check_symbols(code: bytes) -> None:
    """Raise UnresolvedSymbol for functions that are nowhere in the process: LLVM's linker would end it."""
    import llvmlite.binding as llvm

    missing = [name for name in undefined_symbols(code) if not llvm.address_of_symbol(name)]
    if missing:
        raise UnresolvedSymbol(
            f"machine code calls {', '.join(missing)}, which neither this process nor its mathematical library has; expected "
            "functions of the C library alone. Take another version of llvmlite, or SMAJAX_ENGINE=xla."
        )


class Stopped(Exception):
    """The caller no longer wants the results."""


def in_pieces(call: Callable[[int, int], None], first: int, last: int, group: int, stop: threading.Event) -> None:
    """`call` for all vectors from `first` to `last`, whole groups at a time; as many as take `PIECE_SECONDS`, by the pieces before.

    Raises Stopped where `stop` is set before the last piece.
    """
    size = group
    while first < last:
        if stop.is_set():
            raise Stopped("stopped before all runs were done")
        end, begun = min(first + size, last), time.perf_counter()
        call(first, end)
        groups = PIECE_SECONDS * (end - first) / (group * max(time.perf_counter() - begun, 1e-9))
        first, size = end, group * max(1, int(min(groups, GROWTH * size / group)))


class Kernel:
    """Machine code as a function of whole arrays. Threads share nothing but what they read. Raises UnresolvedSymbol."""

    def __init__(self, code: bytes, lanes: int, results: Sequence[Array], scratch: int, group: int = 1) -> None:
        """`group`: vectors that the machine code runs side by side."""
        import llvmlite.binding as llvm

        self._lanes, self._results, self.scratch, self._group = lanes, tuple(results), scratch, group
        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
        _check_symbols(code)  # after the compiler, which makes the process's own functions known
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()
        pointer, number = ctypes.c_void_p, ctypes.c_int64
        kind = ctypes.CFUNCTYPE(None, pointer, pointer, pointer, pointer, number, number)
        self._call = kind(self._engine.get_function_address(NAME))

    def __call__(
        self, shared: Sequence[np.ndarray], own: Sequence[np.ndarray], threads: int, stop: threading.Event | None = None
    ) -> list[np.ndarray]:
        """`own` are arrays of shape (runs,), `shared` of the shapes traced; results have shape (runs, ...).

        Ends some tenths of a second after Ctrl-C in the thread that calls, or, with Stopped, after another has set `stop`.
        """
        runs = len(own[0])
        count = -(-runs // self._lanes)
        room = count * self._lanes
        filled = [np.concatenate([one, np.full(room - runs, one[-1])]) for one in own]
        results = [np.empty((room, *one.shape), one.dtype) for one in self._results]
        tables = [self._pointers(arrays) for arrays in (shared, filled, results)]
        edges = np.linspace(0, count, min(threads, count) + 1).astype(int)
        stopped = threading.Event() if stop is None else stop

        def part(first: int, last: int) -> None:
            scratch = _aligned(self.scratch)

            def call(begin: int, end: int) -> None:
                self._call(*tables, scratch.ctypes.data, begin, end)

            in_pieces(call, first, last, self._group, stopped)

        if len(edges) == 2:
            part(0, count)
            return [one[:runs] for one in results]
        try:
            with ThreadPoolExecutor(len(edges) - 1) as pool:
                try:
                    list(pool.map(part, edges[:-1].tolist(), edges[1:].tolist()))
                except KeyboardInterrupt:  # the pool waits for its threads
                    stopped.set()
                    raise
        except RuntimeError:  # no room for another thread under a cap on memory: this one does it all
            part(0, count)
        return [one[:runs] for one in results]

    @staticmethod
    def _pointers(arrays: Sequence[np.ndarray]) -> Any:
        return (ctypes.c_void_p * len(arrays))(*(one.ctypes.data for one in arrays))
