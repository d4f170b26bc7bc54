"""A block as C99: a header that says what it takes and costs, and its source. Both compile to double and, by a macro, to single precision.

No allocation, no other library than math.h; what a block remembers is one structure that the caller owns. Inputs and outputs are `NAME_real`;
state, parameters and arithmetic are `NAME_number`, which another macro leaves double where single inputs and outputs are asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from smajax.export.block import Block, Quantity
from smajax.export.c_text import helpers_of, merged, printed
from smajax.export.compiled import Body, Compiled, Entry, compiled
from smajax.export.operations import type_of
from smajax.export.single_precision import DOUBLE, SINGLE, UNKNOWN, SingleBuild
from smajax.export.statements import NAMES

MACRO = "SMAJAX_SINGLE"
# Then a reading that is no number would pass every test for one, and the command be the largest.
FINITE_ALONE = (
    "#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)",
    '#error "compile this without -ffast-math (-ffinite-math-only): numbers that are not finite have to be recognised"',
    "#endif",
)


@dataclass(frozen=True)
class ShortCall:
    """A function of a few inputs that returns one output, others being at their start values: `step(state, reading, set_point)`."""

    inputs: tuple[str, ...]
    output: str


@dataclass(frozen=True)
class CSource:
    """C of a block. parameters, inputs, outputs: those that it has, for whoever calls it; state_bytes by the precision of the arithmetic.

    single_build: what it computes in where it is compiled with single inputs and outputs.
    """

    name: str
    block: Block
    header: str
    source: str
    parameters: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    state_bytes: dict[str, int]
    operations: dict[str, int]
    single_build: SingleBuild


class _Both:
    """A block compiled in both precisions."""

    def __init__(self, build: Callable[[], Block], name: str) -> None:
        self.double, self.single = compiled(build, DOUBLE), compiled(build, SINGLE)
        self.name, self.block = name, self.double.block
        used = self.double.parameters | self.single.parameters
        self.parameters = [one for one in self.block.parameters if one.name in used]
        taken = self.double.inputs | self.single.inputs
        self.inputs = [one for one in self.block.inputs if one.name in taken]
        single = {one.name: one for one in self.single.state}
        both = {one.name: one for one in (*self.double.state, *self.single.state)}
        self.state = [(one, single.get(one.name, one)) for one in both.values()]

    def body(self, of: Callable[[Compiled], Body]) -> list[str]:
        texts = []
        for one in (self.double, self.single):
            body = of(one)
            lines = printed(body.items, [what for _, what in body.written])
            texts.append([*lines, *(f"    {where} = {self.leaving(where, what)};" for where, what in body.written)])
        return merged(*texts)

    def leaving(self, where: str, what: str) -> str:
        """An output in the precision of the interface; a member of the state as it is."""
        if not where.startswith("y->"):
            return what
        return f"({self.name}_real){what}" if NAMES.fullmatch(what) else f"({self.name}_real)({what})"


def number(value: float) -> str:
    """As C writes it, every digit."""
    if math.isinf(value) or math.isnan(value):
        return "NAN" if math.isnan(value) else ("INFINITY" if value > 0 else "-INFINITY")
    return repr(float(value))


def _shown(value: float) -> str:
    return f"{value:.6g}"


def _meaning(one: Quantity) -> str:
    """Unit, bounds, start value and meaning, for a comment."""
    parts = [one.unit]
    if math.isfinite(one.low) or math.isfinite(one.high):
        parts.append(f"{_shown(one.low)} to {_shown(one.high)}")
    text = ", ".join([*parts, f"start {_shown(one.start)}"])
    return f"{text}: {one.about}".replace("*/", "* /") if one.about else text


def _structure(name: str, members: Sequence[str]) -> list[str]:
    return ["typedef struct {", *(f"    {one}" for one in members), f"}} {name};", ""] if members else []


def _members(quantities: Iterable[Quantity], kind: str) -> list[str]:
    return [f"{kind} {one.c_name}; /* {_meaning(one)} */" for one in quantities]


def _member(double: Entry, single: Entry, name: str) -> str:
    """Of the state."""
    kinds = [type_of(one.dtype).replace("real", f"{name}_number") for one in (double, single)]
    kind = kinds[0] if kinds[0] == kinds[1] else f"{name}_count"
    return f"{kind} {double.name}{f'[{double.size}]' if double.shape else ''};"


def _bytes(state: Sequence[Entry], parameters: int, real: int) -> int:
    """Of the structure, as a compiler lays it out: members on multiples of their size."""
    sizes = [*([(real, parameters)] if parameters else []), (1, 1)]
    for entry in state:
        sizes.append((real if entry.dtype.startswith("float") else np.dtype(entry.dtype).itemsize, entry.size))
    total = 0
    for size, count in sizes:
        total = -(-total // size) * size + size * count
    largest = max(size for size, _ in sizes)
    return -(-total // largest) * largest


def _prototypes(name: str, both: _Both, short: ShortCall | None) -> list[str]:
    seconds = "" if both.block.period is not None else f", {name}_real seconds"
    taken = f"{name}_state *state{_inputs_argument(both, name)}, {name}_outputs *outputs"
    lines = [
        "/* Sets parameters to their start values and forgets all else: call it first. */",
        f"void {name}_init({name}_state *state);",
        "",
    ]
    if both.block.period is not None:
        lines += [f"/* One period of {_shown(both.block.period)} s: call it at each sample, the first too. */"]
    else:
        lines += ["/* The state at rest with these inputs: call it once before the first step. */"]
        lines += [f"void {name}_start({taken});", "", "/* As many seconds on, with these inputs held. */"]
    lines += [f"void {name}_run({taken}{seconds});"]
    if short is not None:
        lines += ["", "/* The same with other inputs at their start values. */", f"{_short_head(name, short)};"]
    return lines


def _inputs_argument(both: _Both, name: str) -> str:
    return f", const {name}_inputs *inputs" if both.inputs else ""


def _short_head(name: str, short: ShortCall) -> str:
    given = "".join(f", {name}_real {one}" for one in short.inputs)
    return f"{name}_real {name}_step({name}_state *state{given})"


def arithmetic_macro(name: str) -> str:
    """What says of a block that arithmetic is single where inputs and outputs are; each has its own, for several may be in one program."""
    return f"{name.upper()}_SINGLE_ARITHMETIC"


def _precision(name: str, single: SingleBuild) -> list[str]:
    """The types by the macros."""
    macro = arithmetic_macro(name)
    return [
        f"#ifndef {MACRO}",
        f"#define {MACRO} 0",
        "#endif",
        f"#ifndef {macro}",
        f"#define {macro} {int(single.arithmetic == SINGLE)}",
        "#endif",
        f"#if {MACRO}",
        f"typedef float {name}_real; /* inputs and outputs */",
        "#else",
        f"typedef double {name}_real;",
        "#endif",
        f"#if {MACRO} && {macro}",
        f"typedef float {name}_number; /* state, parameters and arithmetic */",
        f"typedef int32_t {name}_count;",
        "#else",
        f"typedef double {name}_number;",
        f"typedef int64_t {name}_count;",
        "#endif",
        "",
    ]


def _header(both: _Both, short: ShortCall | None, state_bytes: dict[str, int], single: SingleBuild) -> str:
    name, block = both.name, both.block
    state = _structure(
        f"{name}_state",
        [
            *([f"{name}_parameters parameters;"] if both.parameters else []),
            "bool started;",
            *(_member(*one, name) for one in both.state),
        ],
    )
    step, start = both.double.step.cost, both.double.start.cost
    bounded = "" if step.bounded else ", each loop whose length depends on the numbers counted once,"
    lines = [
        f"/* {block.title}",
        " *",
        " * Written by smajax: change the model and write it again, not this file. SI units, temperatures in degrees Celsius,",
        " * angles in radians.",
        " *",
        *(f" * {line}" for line in single.header(arithmetic_macro(name))),
        " *",
        f" * State: {state_bytes[DOUBLE]} bytes where arithmetic is double and {state_bytes[SINGLE]} where it is single, one structure that the",
        " * caller owns; nothing is allocated, and of the libraries math.h alone is used.",
        f" * Operations of a step at worst{bounded}: {step.total}",
        f" * ({step.words()}); of the first one {start.total}.",
        " */",
        f"#ifndef {name.upper()}_H",
        f"#define {name.upper()}_H",
        "",
        "#include <stdbool.h>",
        "#include <stdint.h>",
        "",
        *_precision(name, single),
        *(
            [f"#define {name.upper()}_PERIOD {number(block.period)} /* s, between two calls */", ""]
            if block.period
            else []
        ),
        *_structure(f"{name}_parameters", _members(both.parameters, f"{name}_number")),
        *_structure(f"{name}_inputs", _members(both.inputs, f"{name}_real")),
        *_structure(
            f"{name}_outputs", [f"{name}_real {one.c_name}; /* {one.unit}: {one.about} */" for one in block.outputs]
        ),
        *state,
        *_prototypes(name, both, short),
        "",
        "#endif",
        "",
    ]
    return "\n".join(lines)


def _function(name: str, both: _Both, kind: str, body: list[str]) -> list[str]:
    """`start` or `step` of the block, as a function of the file."""
    text = "\n".join(body)
    seconds = kind == "step" and both.block.period is None
    arguments = [
        *([f"const {name}_parameters *p"] if both.parameters else []),
        f"{name}_state *x",
        *([f"const {name}_inputs *u"] if both.inputs else []),
        f"{name}_outputs *y",
        *(["real seconds"] if seconds else []),
    ]
    unused = [
        f"    (void){one};"
        for one, used in (("p", "p->"), ("x", "x->"), ("u", "u->"), ("seconds", "seconds"))
        if used not in text and any(argument.replace("*", " ").split()[-1] == one for argument in arguments)
    ]
    return [f"static void {kind}({', '.join(arguments)})", "{", *unused, *body, "}", ""]


def _public(name: str, both: _Both, short: ShortCall | None) -> list[str]:
    """The functions of the header."""
    sampled = both.block.period is not None
    given = "".join(["&state->parameters, " if both.parameters else "", "state"])
    rest = f"{', inputs' if both.inputs else ''}, outputs"
    taken = f"{name}_state *state{_inputs_argument(both, name)}, {name}_outputs *outputs"
    lines = [
        f"void {name}_init({name}_state *state)",
        "{",
        f"    static const {name}_state rest = {{0}};",
        "    *state = rest;",
    ]
    lines += [f"    state->parameters.{one.c_name} = R({number(one.start)});" for one in both.parameters]
    lines += ["}", ""]
    if sampled:
        lines += [
            f"void {name}_run({taken})",
            "{",
            "    if (state->started) {",
            f"        step({given}{rest});",
            "    } else {",
            f"        start({given}{rest});",
            "        state->started = true;",
            "    }",
            "}",
            "",
        ]
    else:
        lines += [
            f"void {name}_start({taken})",
            "{",
            f"    start({given}{rest});",
            "    state->started = true;",
            "}",
            "",
        ]
        lines += [f"void {name}_run({taken}, real seconds)", "{", f"    step({given}{rest}, seconds);", "}", ""]
    if short is not None:
        lines += [_short_head(name, short), "{"]
        if both.inputs:
            values = [
                one.c_name if one.name in short.inputs else f"({name}_real){number(one.start)}" for one in both.inputs
            ]
            lines += [f"    const {name}_inputs inputs = {{{', '.join(values)}}};"]
        used = {one.name for one in both.inputs}
        lines += [f"    (void){one};" for one in short.inputs if one not in used]
        given_inputs = "&inputs, " if both.inputs else ""
        lines += [
            f"    {name}_outputs outputs;",
            f"    {name}_run(state, {given_inputs}&outputs);",
            f"    return outputs.{short.output};",
            "}",
            "",
        ]
    return lines


def c_source(
    build: Callable[[], Block], name: str, short: ShortCall | None = None, single: SingleBuild = UNKNOWN
) -> CSource:
    """The C of the block that `build` makes, in whichever precision JAX computes at the time. single: of a build with single inputs and outputs.

    Raises NoTranslation.
    """
    both = _Both(build, name)
    start, step = both.body(lambda one: one.start), both.body(lambda one: one.step)
    entries = {DOUBLE: [one for one, _ in both.state], SINGLE: [one for _, one in both.state]}
    sizes = {kind: _bytes(entries[kind], len(both.parameters), real) for kind, real in ((DOUBLE, 8), (SINGLE, 4))}
    source = [
        f"/* {both.block.title}: see {name}.h. */",
        f'#include "{name}.h"',
        "",
        "#include <math.h>",
        "",
        *FINITE_ALONE,
        "",
        f"typedef {name}_number real;",
        f"typedef {name}_count count;",
        "#define R(value) ((real)(value))",
        f"#define SINGLE ({MACRO} && {arithmetic_macro(name)})",
        "#if SINGLE",
        "#define R2(of_double, of_single) R(of_single)",
        "#define F(name) name##f",
        "#else",
        "#define R2(of_double, of_single) R(of_double)",
        "#define F(name) name",
        "#endif",
        "",
        *helpers_of([*start, *step]),
        "",
        *_function(name, both, "start", start),
        *_function(name, both, "step", step),
        *_public(name, both, short),
    ]
    return CSource(
        name=name,
        block=both.block,
        header=_header(both, short, sizes, single),
        source="\n".join(source),
        parameters=tuple(both.parameters),
        inputs=tuple(both.inputs),
        outputs=both.block.outputs,
        state_bytes=sizes,
        operations={"start": both.double.start.cost.total, "step": both.double.step.cost.total},
        single_build=single,
    )


def record(source: CSource) -> dict[str, Any]:
    """What the header says, for JSON: state and operations."""
    return {
        "name": source.name,
        "title": source.block.title,
        "period": source.block.period,
        "state_bytes": dict(source.state_bytes),
        "single_build": source.single_build.record(),
        "operations": dict(source.operations),
        "parameters": [one.name for one in source.parameters],
        "inputs": [one.name for one in source.inputs],
        "outputs": [one.name for one in source.outputs],
    }
