"""LLVM's assembly language, written line by line: instructions on vectors of one number a lane."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from smajax.engine.parts import NAMES, Chosen, Edge, Item, Late, Layout, Names, Uniform, Work, Write

NAME = "runs"  # of the translated function

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


# How the lines of addresses and whole numbers begin, and LLVM's kind of these.
SCALARS = (
    ("getelementptr ", "ptr"),
    ("load ptr,", "ptr"),
    *((f"{name} i64 ", "i64") for name in ("add", "sub", "mul", "udiv", "urem")),
)


class Unsupported(ValueError):
    """The program holds something that is not translated; says what."""

    def __str__(self) -> str:
        return f"machine code has no translation for {self.args[0]}"


# Not frozen, which takes three times as long to make: there are 100,000 of them.
@dataclass(slots=True, unsafe_hash=True)
class Lane:
    """One number a lane: its name in the text (or a constant, the same in every lane). Nothing changes it."""

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


@dataclass(slots=True)
class _Level:
    """A loop that is being written, or what lies outside of all."""

    sure: bool  # it runs once at least: what does not depend on it may be done before it
    items: list[Item] = field(default_factory=list)
    known: dict[str, str] = field(default_factory=dict)  # values that have a name


class Text:
    """The body of one function. Names are given in order, so the same program gives the same text."""

    def __init__(self, lanes: int, estimates: bool = False, vectors: int = 1, mask: str = "i1") -> None:
        self.lanes = lanes  # runs of a vector
        self.vectors = vectors  # of a group, at most
        self.room = lanes * vectors  # runs of a group
        self.mask = mask  # a truth value in memory
        self.estimates = estimates  # 1/x by AVX-512's estimate, not by division
        self.either: dict[str, tuple[str, float, float]] = {}  # (mask, yes, no) of what is one of two constants
        self.names = Names({}, {})
        self.uniform = Uniform()
        self.levels: list[_Level] = [_Level(sure=True)]
        self.least_depth = 0  # of the innermost loop that may not run: nothing is done before it
        self._layouts: dict[str, Layout] = {}
        self.depth: dict[str, int] = {}  # how many loops lie about what has a name
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
        """What is the same for all vectors of a group, and does something."""
        self.levels[-1].items.append("  " + line)

    def assign(self, right: str, dtype: str | None = None) -> str:
        """A name for the value of `right`, outside of all loops that it does not depend on; the one it has, if it has one.

        `dtype`: the kind of number of a vector.
        """
        names, depth, depths = NAMES.findall(right), self.least_depth, self.depth
        for one in names:
            if (own := depths.get(one, 0)) > depth:
                depth = own
        level = self.levels[depth]
        if (given := level.known.get(right)) is not None:
            return given
        name = level.known[right] = self.fresh()
        depths[name] = depth
        if reads := self._reads(names):
            assert dtype is not None, f"of an unknown kind: {right}"
            self.names.layouts[name] = self.layout(dtype)
            level.items.append(Work(name, [f"{name} = {right}"], names, reads))
        else:
            level.items.append(f"  {name} = {right}")
            self._note_uniform(name, right, dtype)
        return name

    def _note_uniform(self, name: str, right: str, dtype: str | None) -> None:
        """What a phase that uses it needs to know: its kind, or how to compute it again. Phases use vectors, addresses and whole numbers."""
        if right.startswith("getelementptr "):
            self.uniform.addresses[name] = right
        scalar = next((kind for start, kind in SCALARS if right.startswith(start)), None)
        kind = scalar if dtype is None else self.vector(dtype)
        if kind is not None:
            self.uniform.kinds[name] = kind

    def layout(self, dtype: str) -> Layout:
        """Of what differs from vector to vector."""
        found = self._layouts.get(dtype)
        if found is None:
            found = self._layouts[dtype] = self._layout(dtype)
        return found

    def _layout(self, dtype: str) -> Layout:
        kind = self.vector(dtype)
        if dtype != "bool":
            return Layout(kind, self.lanes * self.bytes(dtype))
        if self.mask == "i1":
            return Layout(kind, -(-self.lanes // 8))
        return Layout(f"<{self.lanes} x {self.mask}>", self.lanes * int(self.mask[1:]) // 8, kind)

    def _reads(self, names: Sequence[str]) -> tuple[str, ...]:
        layouts = self.names.layouts
        return tuple(dict.fromkeys([one for one in names if one in layouts]))

    def work(self, lines: Sequence[str], dtype: str | None = None) -> str:
        """Lines that stay together, of one vector; the name of the last one's value, where it has one: `{}` in it."""
        name = None
        own = list(lines)
        if dtype is not None:
            name = self.fresh()
            self.depth[name] = len(self.levels) - 1
            self.names.layouts[name] = self.layout(dtype)
            own[-1] = f"{name} = {own[-1]}"
        inside = {one.split(" = ")[0].strip() for one in own}
        names = [one for line in own for one in NAMES.findall(line) if one not in inside]
        self.levels[-1].items.append(Work(name, own, names, self._reads(names)))
        return name or ""

    def lane(self, right: str, dtype: str) -> Lane:
        return Lane(self.assign(right, dtype), dtype)

    # Loops, and what they carry: a cell of memory for each number.

    def open(self, label: str, sure: bool) -> str:
        """Begin a loop at `label`; `sure`: it runs once at least. The name of its count."""
        self.levels.append(_Level(sure))
        self._find_least_depth()
        self.label(label)
        count = self.fresh("i")
        self.depth[count] = len(self.levels) - 1
        self.uniform.kinds[count] = "i64"
        return count

    def close(self, count: str, following: str, before: str, first: str = "0") -> None:
        """The end of the last loop begun, with the value of its count in the next round, and the block before it."""
        top, *rest = self.levels.pop().items
        self._find_least_depth()
        assert isinstance(top, str)
        phi = f"  {count} = phi i64 [ {first}, %{before} ], [ {following}, %{self.block} ]"
        self.levels[-1].items += [f"  br label %{top[:-1]}", Edge(begins=True), top, phi, *rest, Edge(begins=False)]

    def _find_least_depth(self) -> None:
        self.least_depth = max(k for k, level in enumerate(self.levels) if k == 0 or not level.sure)

    def cell(self, dtype: str) -> Lane:
        """A number that will be written over."""
        name = self.fresh("c")
        self.names.layouts[name] = self.layout(dtype)
        self.names.cells[name] = name
        return Lane(name, dtype)

    def present(self, cell: Lane) -> Lane:
        """What a cell holds here and now, to be read before it is written again."""
        name = self.fresh("n")
        self.names.layouts[name] = self.layout(cell.dtype)
        self.names.cells[name] = cell.name
        self.depth[name] = len(self.levels) - 1
        return Lane(name, cell.dtype)

    def write(self, cells: Sequence[Lane], values: Sequence[Lane]) -> None:
        """All at once: a value may be what another cell held."""
        if cells:
            pairs = [(cell.name, value.name) for cell, value in zip(cells, values, strict=True)]
            self.levels[-1].items.append(Write(pairs))

    def constant(self, value: object, dtype: str) -> Lane:
        return Lane(f"splat ({scalar_type(dtype)} {literal(value, dtype)})", dtype, float(value))  # type: ignore[arg-type]

    def spread(self, scalar: str, dtype: str) -> Lane:
        """A scalar in every lane."""
        one = self.assign(f"insertelement {self.vector(dtype)} poison, {scalar_type(dtype)} {scalar}, i64 0")
        ones = f"<{self.lanes} x i32> zeroinitializer"
        return self.lane(f"shufflevector {self.vector(dtype)} {one}, {self.vector(dtype)} poison, {ones}", dtype)

    def label(self, name: str) -> None:
        self.levels[-1].items.append(f"{name}:")
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

    def any(self, mask: Lane) -> tuple[str, Chosen]:
        """Whether any lane of any vector is true, and the vectors of which one is."""
        kind, chosen = f"i{self.lanes}", Chosen(self.reserve(1, "int64"), self.reserve(1, "int64"))
        self.put(f"store i64 0, ptr {chosen.count}")
        bits, some, more, before, where, after = (self.fresh("b") for _ in range(6))
        self.work(
            [
                f"{bits} = bitcast {self.vector('bool')} {mask.name} to {kind}",
                f"{some} = icmp ne {kind} {bits}, 0",
                f"{more} = zext i1 {some} to i64",
                f"{before} = load i64, ptr {chosen.count}",
                f"{where} = getelementptr inbounds i64, ptr {chosen.numbers}, i64 {before}",
                f"store i64 %turn, ptr {where}",
                f"{after} = add i64 {before}, {more}",
                f"store i64 {after}, ptr {chosen.count}",
            ]
        )
        result, going = self.fresh("b"), self.fresh("b")
        items = self.levels[-1].items
        items += [Late(f"  {result} = load i64, ptr {chosen.count}"), Late(f"  {going} = icmp ne i64 {result}, 0")]
        return going, chosen

    def only(self, chosen: Chosen) -> None:
        """From here to the end of the loop, the vectors that were chosen alone."""
        self.levels[-1].items.append(chosen)

    def address(self, base: str, index: str, dtype: str) -> str:
        """Where the number with the index (an i64) lies behind `base`. Truth values take a byte."""
        stored = "i8" if dtype == "bool" else scalar_type(dtype)
        return self.assign(f"getelementptr inbounds {stored}, ptr {base}, i64 {index}")

    def load_lanes(self, address: str, dtype: str) -> Lane:
        stored = "int8" if dtype == "bool" else dtype
        where, raw = self.fresh("p"), self.fresh("r")
        lines = [f"{where} = getelementptr inbounds {scalar_type(stored)}, ptr {address}, i64 %at"]
        load = f"load {self.vector(stored)}, ptr {where}, align {self.bytes(dtype)}"
        if dtype == "bool":
            lines += [f"{raw} = {load}", f"icmp ne {self.vector(stored)} {raw}, zeroinitializer"]
        else:
            lines.append(load)
        return Lane(self.work(lines, dtype), dtype)

    def store_lanes(self, value: Lane, address: str) -> None:
        stored = "int8" if value.dtype == "bool" else value.dtype
        where, name, lines = self.fresh("p"), value.name, []
        if value.dtype == "bool":
            name = self.fresh("r")
            lines = [f"{name} = zext {self.vector('bool')} {value.name} to {self.vector(stored)}"]
        lines.append(f"{where} = getelementptr inbounds {scalar_type(stored)}, ptr {address}, i64 %at")
        lines.append(f"store {self.vector(stored)} {name}, ptr {where}, align {self.bytes(value.dtype)}")
        self.work(lines)

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
        self.scratch += -(-count * self.room * self.bytes(dtype) // 64) * 64
        return self.assign(f"getelementptr inbounds i8, ptr %scratch, i64 {here}")


@dataclass(frozen=True)
class Array:
    """An argument or a result: shape of one run's, and numpy's kind of number."""

    shape: tuple[int, ...]
    dtype: str
