"""LLVM's assembly language, written line by line: instructions on vectors of one number a lane."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

NAME = "members"  # of the translated function

# numpy's kinds of numbers -> LLVM's.
TYPES = {
    "float64": "double",
    "float32": "float",
    "int64": "i64",
    "int32": "i32",
    "int16": "i16",
    "int8": "i8",
    "uint64": "i64",
    "uint32": "i32",
    "uint8": "i8",
    "bool": "i1",
}


class Unsupported(Exception):
    """The program holds something that is not translated; says what."""


@dataclass(frozen=True, slots=True)
class Lane:
    """One number a lane: its name in the text (or a constant, the same in every lane)."""

    name: str
    dtype: str  # numpy's
    number: float | None = None  # of a constant

    @property
    def constant(self) -> bool:
        return self.number is not None


def scalar_type(dtype: str) -> str:
    """LLVM's name of a number. Raises Unsupported."""
    if dtype not in TYPES:
        raise Unsupported(f"numbers of the kind {dtype}")
    return TYPES[dtype]


def literal(value: object, dtype: str) -> str:
    """A constant as LLVM writes it: floating numbers by their bits."""
    if dtype in ("float64", "float32"):
        exact = float(np.float32(value) if dtype == "float32" else np.float64(value))  # type: ignore[arg-type]
        return f"0x{struct.unpack('<Q', struct.pack('<d', exact))[0]:016X}"
    if dtype == "bool":
        return "true" if value else "false"
    return str(int(value))  # type: ignore[call-overload]


class Text:
    """The body of one function. Names are given in order, so the same program gives the same text."""

    def __init__(self, lanes: int, estimates: bool = False) -> None:
        self.lanes = lanes
        self.estimates = estimates  # 1/x by AVX-512's estimate, not by division
        self.either: dict[str, tuple[str, float, float]] = {}  # (mask, yes, no) of what is one of two constants
        self.lines: list[str] = []
        self.globals: list[str] = []
        self.declared: dict[str, str] = {}
        self.count = 0
        self.block = "entry"
        self.scratch = 0  # bytes a thread needs

    def fresh(self, stem: str = "v") -> str:
        self.count += 1
        return f"%{stem}{self.count}"

    def vector(self, dtype: str) -> str:
        return f"<{self.lanes} x {scalar_type(dtype)}>"

    def put(self, line: str) -> None:
        self.lines.append("  " + line)

    def assign(self, right: str, stem: str = "v") -> str:
        """A new name for the value of `right`."""
        name = self.fresh(stem)
        self.put(f"{name} = {right}")
        return name

    def lane(self, right: str, dtype: str) -> Lane:
        return Lane(self.assign(right), dtype)

    def constant(self, value: object, dtype: str) -> Lane:
        return Lane(f"splat ({scalar_type(dtype)} {literal(value, dtype)})", dtype, float(value))  # type: ignore[arg-type]

    def spread(self, scalar: str, dtype: str) -> Lane:
        """A scalar in every lane."""
        one = self.assign(f"insertelement {self.vector(dtype)} poison, {scalar_type(dtype)} {scalar}, i64 0")
        ones = f"<{self.lanes} x i32> zeroinitializer"
        return self.lane(f"shufflevector {self.vector(dtype)} {one}, {self.vector(dtype)} poison, {ones}", dtype)

    def label(self, name: str) -> None:
        self.lines.append(f"{name}:")
        self.block = name

    def new_label(self, stem: str) -> str:
        self.count += 1
        return f"{stem}{self.count}"

    def jump(self, label: str) -> None:
        self.put(f"br label %{label}")

    def branch(self, condition: str, yes: str, no: str) -> None:
        self.put(f"br i1 {condition}, label %{yes}, label %{no}")

    def declare(self, name: str, result: str, arguments: Sequence[str]) -> str:
        self.declared[name] = f"declare {result} @{name}({', '.join(arguments)})"
        return name

    @staticmethod
    def suffix(dtype: str) -> str:
        """Of LLVM's functions."""
        kind = scalar_type(dtype)
        return {"double": "f64", "float": "f32"}.get(kind, kind)

    def call(self, name: str, dtype: str, *arguments: str, flags: str = "contract ") -> Lane:
        """One of LLVM's own functions on whole vectors, of arguments of one type."""
        of = self.vector(dtype)
        self.declare(full := f"{name}.v{self.lanes}{self.suffix(dtype)}", of, [of] * len(arguments))
        given = ", ".join(f"{of} {one}" for one in arguments)
        return self.lane(f"call {flags if dtype.startswith('float') else ''}{of} @{full}({given})", dtype)

    def any(self, mask: Lane) -> str:
        """Whether any lane is true."""
        bits = self.assign(f"bitcast {self.vector('bool')} {mask.name} to i{self.lanes}")
        return self.assign(f"icmp ne i{self.lanes} {bits}, 0")

    def address(self, base: str, index: str, dtype: str) -> str:
        """Where the number with the index (an i64) lies behind `base`. Truth values take a byte."""
        kept = "i8" if dtype == "bool" else scalar_type(dtype)
        return self.assign(f"getelementptr inbounds {kept}, ptr {base}, i64 {index}")

    def load_lanes(self, address: str, dtype: str) -> Lane:
        align = f", align {self.bytes(dtype)}"
        if dtype == "bool":
            raw = self.assign(f"load <{self.lanes} x i8>, ptr {address}{align}")
            return self.lane(f"icmp ne <{self.lanes} x i8> {raw}, zeroinitializer", dtype)
        return self.lane(f"load {self.vector(dtype)}, ptr {address}{align}", dtype)

    def store_lanes(self, value: Lane, address: str) -> None:
        name, kind = value.name, self.vector(value.dtype)
        if value.dtype == "bool":
            name, kind = self.assign(f"zext {kind} {name} to <{self.lanes} x i8>"), f"<{self.lanes} x i8>"
        self.put(f"store {kind} {name}, ptr {address}, align {self.bytes(value.dtype)}")

    def load_everywhere(self, address: str, dtype: str) -> Lane:
        """The one number at an address, in every lane."""
        if dtype == "bool":
            raw = self.assign(f"load i8, ptr {address}")
            return self.spread(self.assign(f"icmp ne i8 {raw}, 0"), dtype)
        return self.spread(self.assign(f"load {scalar_type(dtype)}, ptr {address}"), dtype)

    @staticmethod
    def bytes(dtype: str) -> int:
        return np.dtype(dtype).itemsize

    def reserve(self, count: int, dtype: str) -> str:
        """Room for `count` numbers a lane in the thread's own memory."""
        here = self.scratch
        self.scratch += -(-count * self.lanes * self.bytes(dtype) // 64) * 64
        return self.assign(f"getelementptr inbounds i8, ptr %scratch, i64 {here}")


@dataclass(frozen=True)
class Array:
    """An argument or a result: shape of one member's, and numpy's kind of number."""

    shape: tuple[int, ...]
    dtype: str
