"""A phase as a function of its own: a loop over the vectors of a group, or over those chosen.

LLVM looks at all loops of a function for each of them, so its time grows with their number squared: half of it, and more of long
programs, if all phases were loops of one function.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from smajax.engine.parts import LINE, NAMES, Names, Phase, Uniform, Work

OWN = re.compile(r"%[a-z]+\d+|%at\b|%turn\b")


def phase_function(
    phase: Phase, number: int, names: Names, uniform: Uniform, lanes: int, places: Mapping[str, int], alone: bool
) -> tuple[str, list[str]]:
    """The line that calls it, and the lines of the function; `places` are bytes in the thread's own memory.

    `alone`: of a group of a single vector, where LLVM may put it in the place of its call.
    """
    body = _body(phase, number, names, lanes, places)
    addresses, arguments = _from_outside(phase, uniform)
    given = ["ptr {}%scratch", *(f"{uniform.kinds[one]} {{}}{one}" for one in arguments)]
    given += [] if phase.chosen else ["i64 {}%vectors"]
    called = ", ".join(one.format("") for one in given)
    taken = ", ".join([given[0].format("noalias "), *(one.format("") for one in given[1:])])
    attributes = "#0" if alone else "noinline #0"
    lines = [f"define internal void @phase{number}({taken}) {attributes} {{", "entry:"]
    lines += [f"  {one} = {uniform.addresses[one]}" for one in addresses]
    return f"  call void @phase{number}({called})", [*lines, *body, "}"]


def _from_outside(phase: Phase, uniform: Uniform) -> tuple[list[str], list[str]]:
    """(addresses to compute again, values to be handed over) of what a phase uses and does not make.

    An address says more where LLVM sees what it was computed from: which of two may be the same place.
    """
    addresses: dict[str, None] = {}
    arguments: dict[str, None] = {}

    def ask(name: str) -> None:
        if name in addresses or name not in uniform.kinds:
            return
        if (how := uniform.addresses.get(name)) is None:
            arguments[name] = None
            return
        for one in NAMES.findall(how):
            ask(one)
        addresses[name] = None

    for name in (phase.chosen.count, phase.chosen.numbers) if phase.chosen else ():
        ask(name)
    for work in phase.works:
        for name in work.names if isinstance(work, Work) else ():
            ask(name)
    for _, value in phase.stores:
        ask(value)
    return list(addresses), list(arguments)


def _body(phase: Phase, number: int, names: Names, lanes: int, places: Mapping[str, int]) -> list[str]:
    chosen, rows = phase.chosen, dict[int, str]()  # `rows`: this vector's places, by its bytes
    here = {name: f"{name}.{number}" for name in phase.loads}
    many = "%many" if chosen else "%vectors"
    lines = [f"  {many} = load i64, ptr {chosen.count}"] if chosen else []
    lines += ["  br label %each", "each:", "  %turn.count = phi i64 [ 0, %entry ], [ %turn.next, %each ]"]
    if chosen:
        lines.append(f"  %turn.which = getelementptr inbounds i64, ptr {chosen.numbers}, i64 %turn.count")
        lines.append("  %turn = load i64, ptr %turn.which")
    else:
        lines.append("  %turn = add i64 %turn.count, 0")
    lines.append(f"  %at = mul i64 %turn, {lanes}")

    def own(text: str) -> str:
        return OWN.sub(lambda one: here.get(one[0], one[0]), text)

    def address(name: str, use: str) -> str:
        size, where = names.layouts[name].size, f"%{use}.address"
        if size not in rows:
            rows[size] = f"%row.of{size}"
            lines.append(f"  {rows[size]} = getelementptr inbounds [{size} x i8], ptr %scratch, i64 %turn")
        lines.append(f"  {where} = getelementptr inbounds i8, ptr {rows[size]}, i64 {places[name]}")
        return f"ptr {where}, align {min(size & -size, LINE)}"

    for k, name in enumerate(phase.loads):
        cell = names.cells.get(name, name)
        layout, where = names.layouts[cell], address(cell, f"load.{k}")
        if layout.mask is None:
            lines.append(f"  {here[name]} = load {layout.kind}, {where}")
        else:
            lines.append(f"  {here[name]}.stored = load {layout.kind}, {where}")
            lines.append(f"  {here[name]} = icmp slt {layout.kind} {here[name]}.stored, zeroinitializer")
    for work in phase.works:
        if not isinstance(work, Work):
            continue
        loaded = any(name in here for name in work.names)
        lines += ["  " + (own(one) if loaded else one) for one in work.lines]
    for k, (name, value) in enumerate(phase.stores):
        layout, where, what = names.layouts[name], address(name, f"store.{k}"), own(value)
        if layout.mask is not None:
            lines.append(f"  %store.{k} = sext {layout.mask} {what} to {layout.kind}")
            what = f"%store.{k}"
        lines.append(f"  store {layout.kind} {what}, {where}")
    return [
        *lines,
        "  %turn.next = add i64 %turn.count, 1",
        f"  %turn.more = icmp slt i64 %turn.next, {many}",
        "  br i1 %turn.more, label %each, label %done",
        "done:",
        "  ret void",
    ]
