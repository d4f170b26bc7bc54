"""A traced program of one run -> the text of a loop over groups of runs, a lane each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

from jax.interpreters import partial_eval

from smajax.engine.arithmetic import ELEMENTWISE
from smajax.engine.directions import Several, apart
from smajax.engine.equations import array_of
from smajax.engine.loop import Loop
from smajax.engine.memory import in_memory, in_registers, row
from smajax.engine.phases import laid_out
from smajax.engine.text import NAME, Array, Text, Unsupported, scalar_type
from smajax.engine.translation import Translation, constants
from smajax.engine.values import SMALL, Filled, Stored, Value, held

VECTORS = 6  # of a group: while one waits for a result others go on


@dataclass(frozen=True)
class Translated:
    """The text of `void runs(ptr shared, ptr own, ptr results, ptr scratch, i64 first, i64 last)`, over vectors of runs."""

    text: str
    lanes: int  # runs of a vector
    results: tuple[Array, ...]
    scratch: int  # bytes a thread needs
    vectors: int = 1  # of a group
    # Which results of the program are one for each direction: they stand one after the other in `results`.
    several: tuple[bool, ...] = ()


def translate(
    program: Any,
    own: Sequence[bool],
    lanes: int,
    estimates: bool = False,
    vectors: int = VECTORS,
    mask: str = "i1",
    along: Sequence[bool] = (),
    directions: int = 1,
) -> Translated:
    """`program` is `jax.make_jaxpr` of one run; `own[k]` says whether argument k differs from run to run.

    Such an argument is a number; of one that `along` marks, a run has `directions` of them, and the results that depend on it are as many. `estimates`: 1/x by AVX-512's estimate. `vectors`: of a
    group, at most. `mask`: LLVM's kind of a truth value in memory. Raises Unsupported with what cannot be translated.
    """
    text = Text(lanes, estimates, vectors, mask)
    put = Translation(text, directions)
    arguments = [array_of(aval) for aval in program.in_avals]
    by_direction = list(along) or [False] * len(arguments)
    # What no result asks for may well be what has no translation.
    needed, _ = partial_eval.dce_jaxpr(program.jaxpr, [True] * len(program.out_avals), instantiate=True)
    several = put.dependence.results(needed, by_direction)
    shared: list[Value | None] = []
    places = {True: 0, False: 0}
    pointers: list[list[str]] = []
    for argument, mine, each in zip(arguments, own, by_direction, strict=True):
        of = "own" if mine else "shared"
        pointers.append([])
        for _ in range(directions if each else 1):
            slot = text.assign(f"getelementptr inbounds ptr, ptr %{of}, i64 {places[mine]}")
            pointers[-1].append(text.assign(f"load ptr, ptr {slot}"))
            places[mine] += 1
        if mine:
            if argument.shape != ():
                raise Unsupported("a run's own argument that is an array")
            shared.append(None)
            continue
        whole = Stored(pointers[-1][0], argument.shape, argument.dtype, own=False)
        shared.append(in_registers(text, whole) if whole.size <= SMALL else whole)
    results = tuple(apart([array_of(aval) for aval in program.out_avals], several, directions))
    outputs = []
    for number in range(len(results)):
        slot = text.assign(f"getelementptr inbounds ptr, ptr %results, i64 {number}")
        outputs.append(text.assign(f"load ptr, ptr {slot}"))
    group = text.open("groups", sure=True)
    text.declare("llvm.smin.i64", "i64", ["i64", "i64"])
    text.put(f"%vectors = call i64 @llvm.smin.i64(i64 {text.assign(f'sub i64 %last, {group}')}, i64 {vectors})")
    first = text.assign(f"mul i64 {group}, {lanes}")
    given: list[Several | Value] = []
    for where, argument, value, each in zip(pointers, arguments, shared, by_direction, strict=True):
        if value is not None:
            given.append(value)
            continue
        lane = [held(text.load_lanes(text.address(one, first, argument.dtype), argument.dtype)) for one in where]
        given.append(Several(lane) if each else lane[0])
    outcome = apart(put.program(needed, constants(program.consts), given), several, directions)
    for pointer, result, answer in zip(outputs, results, outcome, strict=True):
        _leave(text, pointer, first, result, answer)
    following = text.assign(f"add i64 {group}, {vectors}")
    text.branch(text.assign(f"icmp slt i64 {following}, %last"), "groups", "finished")
    text.close(group, following, "entry", "%first")
    text.label("finished")
    text.put("ret void")
    head = (
        f"define void @{NAME}(ptr noalias %shared, ptr noalias %own, ptr noalias %results, ptr noalias %scratch, "
        "i64 %first, i64 %last) #0 {\nentry:"
    )
    # The processor takes what it has of 512 bits. Without the alignment what does not fit its registers would lie across
    # cache lines.
    attributes = 'attributes #0 = { nounwind alignstack=64 "prefer-vector-width"="512" "min-legal-vector-width"="512" }'
    body, functions, room = laid_out(text.levels[0].items, text.names, text.uniform, lanes, vectors, text.scratch)
    lines = [*text.globals, *sorted(text.declared.values()), *functions, head, *body, "}", attributes]
    return Translated("\n".join(lines) + "\n", lanes, results, text.scratch + room, vectors, tuple(several))


def _leave(text: Text, pointer: str, first: str, result: Array, value: Value) -> None:
    """A result where the caller finds it: runs one after the other."""
    size = prod(result.shape)
    if size == 0:
        return
    if size == 1:
        text.store_lanes(in_registers(text, value).ravel()[0], text.address(pointer, first, result.dtype))
        return
    stored = "int8" if result.dtype == "bool" else result.dtype
    rows = in_memory(text, value, result.shape, result.dtype) if not isinstance(value, Filled) else value
    base = text.address(pointer, text.assign(f"mul i64 {first}, {size}"), result.dtype)
    loop = Loop(text, [], "leave")
    lane = in_registers(text, row(text, rows, loop.count, (), result.dtype)).ravel()[0]
    if result.dtype == "bool":
        lane = ELEMENTWISE["convert_element_type"](text, stored, lane)
    kind, where, at = scalar_type(stored), text.fresh("p"), text.fresh("p")
    lines = [
        f"{at} = mul i64 %at, {size}",
        f"{where} = getelementptr inbounds {kind}, ptr {text.address(base, loop.count, stored)}, i64 {at}",
    ]
    for k in range(text.lanes):
        one, there = text.fresh("r"), text.fresh("p")
        lines += [
            f"{one} = extractelement {text.vector(stored)} {lane.name}, i64 {k}",
            f"{there} = getelementptr inbounds {kind}, ptr {where}, i64 {k * size}",
            f"store {kind} {one}, ptr {there}",
        ]
    text.work(lines)
    loop.end_after(size)
