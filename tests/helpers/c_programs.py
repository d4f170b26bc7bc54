"""C of a block, compiled and called: for tests that hold it against the package."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from smajax.export.block import Block
from smajax.export.single_precision import DOUBLE, SINGLE
from smajax.export.source import CSource, ShortCall, arithmetic_macro, c_source

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc, to compile the C that is written")
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]


class Running:
    """An instance of a block in C: parameters, inputs and outputs by name."""

    def __init__(self, library: ctypes.CDLL, source: CSource, kind: str, arithmetic: str) -> None:
        self.library, self.source = library, source
        self.real = ctypes.c_double if kind == DOUBLE else ctypes.c_float
        number = ctypes.c_double if arithmetic == DOUBLE else ctypes.c_float
        size = getattr(library, f"{source.name}_size")()
        assert size == source.state_bytes[arithmetic], "the header says another size of the state"
        self.memory = (ctypes.c_uint64 * (size // 8 + 1))()
        self.at = ctypes.byref(self.memory)
        self.parameters = (number * len(source.parameters)).from_buffer(self.memory)
        self.inputs = (self.real * max(len(source.inputs), 1))()
        self.outputs = (self.real * len(source.outputs))()
        for k, one in enumerate(source.inputs):
            self.inputs[k] = one.start
        self.call("init")

    def call(self, name: str, *more: Any) -> None:
        """A function of the header."""
        getattr(self.library, f"{self.source.name}_{name}")(self.at, *more)

    def set(self, values: Mapping[str, float]) -> None:
        """Parameters."""
        names = [one.name for one in self.source.parameters]
        for name, value in values.items():
            self.parameters[names.index(name)] = value

    def run(self, values: Mapping[str, float], seconds: float | None = None, name: str = "run") -> dict[str, float]:
        """One call of `run` or `start` with these inputs."""
        names = [one.name for one in self.source.inputs]
        for key, value in values.items():
            if key in names:
                self.inputs[names.index(key)] = value
        given = [ctypes.byref(self.inputs)] if names else []
        more = [] if seconds is None else [self.real(seconds)]
        self.call(name, *given, ctypes.byref(self.outputs), *more)
        return {one.name: value for one, value in zip(self.source.outputs, self.outputs, strict=True)}


def compiled_c(
    source: CSource, folder: Path, kind: str = DOUBLE, flags: Sequence[str] = ("-O1",), arithmetic: str = ""
) -> Callable[[], Running]:
    """Makes instances of the block, whose C is compiled without a warning. kind: of inputs and outputs; arithmetic: "" for the header's."""
    library = shared_library(source, folder, kind, flags, arithmetic)
    computes = DOUBLE if kind == DOUBLE else arithmetic or source.single_build.arithmetic
    return lambda: Running(library, source, kind, computes)


def shared_library(source: CSource, folder: Path, kind: str, flags: Sequence[str], arithmetic: str = "") -> ctypes.CDLL:
    (folder / f"{source.name}.h").write_text(source.header)
    size = f"\nunsigned long {source.name}_size(void);\nunsigned long {source.name}_size(void) {{ return sizeof({source.name}_state); }}\n"
    code = folder / f"{source.name}.c"
    code.write_text(source.source + size)
    path = folder / f"{source.name}_{kind}_{arithmetic}.so"
    macros = [f"-DSMAJAX_SINGLE={int(kind == SINGLE)}"]
    macros += [f"-D{arithmetic_macro(source.name)}={int(arithmetic == SINGLE)}"] if arithmetic else []
    subprocess.run(["gcc", *STRICT, *flags, *macros, "-fPIC", "-shared", code, "-o", path, "-lm"], check=True)
    return ctypes.CDLL(str(path))


def source_of(build: Callable[[], Block], name: str = "block", short: ShortCall | None = None) -> CSource:
    return c_source(build, name, short)
