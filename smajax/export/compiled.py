"""A block -> the statements of its two functions, with what nothing comes of left out: state, parameters and inputs too."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from math import prod
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.engine.jax_versions import kind_of
from smajax.engine.values import held
from smajax.export.arrays import numbers_of
from smajax.export.block import Block, Quantity, identifier
from smajax.export.c_text import texts_of
from smajax.export.counts import Cost, cost_of
from smajax.export.single_precision import DOUBLE
from smajax.export.statements import NAMES, Item, Number, Writer, needed
from smajax.export.translate import Translation

# Inputs may be of less precision than the arithmetic: two of them are not multiplied before they are converted.
PARAMETER, INPUT = "p->", "(real)u->"


@dataclass(frozen=True)
class Entry:
    """A member of the state: its name in C, numpy's kind of number, and its shape."""

    name: str
    dtype: str
    shape: tuple[int, ...]

    @property
    def size(self) -> int:
        return prod(self.shape)


@dataclass(frozen=True)
class Body:
    """A function: its statements, and what is written at its end, (where, what)."""

    items: list[Item]
    written: tuple[tuple[str, str], ...]

    @property
    def cost(self) -> Cost:
        return cost_of(self.items)


@dataclass(frozen=True)
class Compiled:
    """A block in one precision. parameters, inputs: those that change anything, by index of the block's."""

    block: Block
    start: Body
    step: Body
    state: tuple[Entry, ...]
    parameters: frozenset[str]
    inputs: frozenset[str]


def precision(kind: str) -> AbstractContextManager[Any]:
    """JAX computes in this precision within. Raises ValueError in a program that computes in float32 and asks for double."""
    wanted = kind == DOUBLE
    if bool(jax.config.read("jax_enable_x64")) == wanted:
        return nullcontext()
    switch: Any = getattr(jax, "enable_x64", None)
    if switch is None:  # before JAX 0.8
        from jax import experimental

        switch = getattr(experimental, "enable_x64")  # noqa: B009  # which later releases have not
    context: AbstractContextManager[Any] = switch(wanted)
    return context


def cast(tree: Any) -> Any:
    """The numbers of a model in the precision that JAX computes in; the rest as it is."""

    def one(leaf: Any) -> Any:
        if isinstance(leaf, jax.Array | np.ndarray) and jnp.issubdtype(leaf.dtype, jnp.floating):
            return jnp.asarray(np.asarray(leaf), dtype=float)
        return leaf

    return jax.tree.map(one, tree)


def _named(quantities: Sequence[Quantity], at: str) -> list[str]:
    return [f"{at}{one.c_name}" for one in quantities]


class _Function:
    """One of the two functions, traced and translated."""

    def __init__(
        self, function: Callable[..., Any], arguments: Sequence[Any], sources: Sequence[Sequence[str]]
    ) -> None:
        """sources: of each leaf of the arguments, the C expression of each of its numbers."""
        program, shape = jax.make_jaxpr(function, return_shape=True)(*arguments)
        self.shape = shape
        writer = Writer()
        given = []
        for leaf, texts in zip(jax.tree.leaves(arguments), sources, strict=True):
            dtype = str(np.asarray(leaf).dtype if not hasattr(leaf, "dtype") else leaf.dtype)
            numbers: list[Number] = [writer.assign(text, dtype) for text in texts]
            given.append(held(numbers, tuple(np.shape(leaf) if not hasattr(leaf, "shape") else leaf.shape)))
        self.locals = {text: name for (text, _), name in writer.scopes[0].known.items()}
        results = Translation(writer).closed(program, given)
        self.results = [list(numbers_of(one).ravel()) for one in results]
        self.kinds = [kind_of(aval) for aval in program.out_avals]
        self.items = writer.scopes[0].items

    def body(self, places: Sequence[Sequence[str] | None]) -> Body:
        """What is needed of it for the results that have a place."""
        pairs = [
            (where, number.text)
            for numbers, row in zip(self.results, places, strict=True)
            if row is not None
            for where, number in zip(row, numbers, strict=True)
        ]
        return Body(needed(self.items, [text for _, text in pairs]), tuple(pairs))

    def read(self, body: Body) -> set[str]:
        """The sources that a body reads."""
        texts = [text for item in body.items for text in texts_of(item)] + [text for _, text in body.written]
        used = {name for text in texts for name in NAMES.findall(text)}
        return {text for text, name in self.locals.items() if name in used}


def entry_names(state: Any) -> list[str]:
    """A C name for each leaf of a state: the names on its path, with a number where two are the same."""
    names = ["parameters", "started"]  # other members of the structure
    for path, _ in jax.tree_util.tree_leaves_with_path(state):
        keys = (str(getattr(key, "name", getattr(key, "key", ""))) for key in path)
        name = identifier("_".join(key for key in keys if key)) if path else "memory"
        alike = sum(re.fullmatch(rf"{name}(_[0-9]+)?", one) is not None for one in names)
        names.append(f"{name}_{alike + 1}" if alike else name)
    return names[2:]


def _texts(entry: Entry) -> list[str]:
    """Its numbers in C."""
    return [f"x->{entry.name}[{k}]" for k in range(entry.size)] if entry.shape else [f"x->{entry.name}"]


def compiled(build: Callable[[], Block], kind: str) -> Compiled:
    """The block that `build` makes, in a precision. Raises NoTranslation with the part of the model that C cannot say."""
    with precision(kind):
        block = build()
        real = jnp.zeros(())
        parameters = {one.name: real for one in block.parameters}
        inputs = {one.name: real for one in block.inputs}
        # Dictionaries are flattened in the order of their sorted keys.
        given = [
            _named(sorted(many, key=lambda one: one.name), at)
            for many, at in ((block.parameters, PARAMETER), (block.inputs, INPUT))
        ]
        of_parameters, of_inputs = ([[text] for text in texts] for texts in given)

        def begin(p: Any, u: Any) -> Any:
            return _canonical(block.start(p, u), block)

        def proceed(p: Any, x: Any, u: Any, seconds: Any) -> Any:
            return _canonical(block.step(p, x, u, seconds), block)

        start = _Function(begin, (parameters, inputs), [*of_parameters, *of_inputs])
        shape = start.shape[0]
        leaves = jax.tree.leaves(shape)
        entries = [
            Entry(name, str(leaf.dtype), tuple(leaf.shape))
            for name, leaf in zip(entry_names(shape), leaves, strict=True)
        ]
        of_state = [_texts(one) for one in entries]
        step = _Function(
            proceed, (parameters, shape, inputs, real), [*of_parameters, *of_state, *of_inputs, ["seconds"]]
        )
    if (
        str(jax.tree.structure(step.shape[0])) != str(jax.tree.structure(shape))
        or step.kinds[: len(entries)] != start.kinds[: len(entries)]
    ):
        raise ValueError(
            f"the state of {block.name} after a step is of another kind than at its start; give both the same shapes."
        )
    names = sorted(one.name for one in block.outputs)
    of_outputs = [[f"y->{identifier(name)}"] for name in names]
    alive: set[int] = set()
    while True:
        places: list[Any] = [of_state[k] if k in alive else None for k in range(len(entries))]
        body = step.body([*places, *of_outputs])
        read = step.read(body)
        more = {k for k, texts in enumerate(of_state) if read & set(texts)}
        if more <= alive:
            break
        alive |= more
    first = start.body([*places, *of_outputs])
    read |= start.read(first)
    return Compiled(
        block,
        first,
        body,
        tuple(entry for k, entry in enumerate(entries) if k in alive),
        frozenset(one.name for one in block.parameters if f"{PARAMETER}{one.c_name}" in read),
        frozenset(one.name for one in block.inputs if f"{INPUT}{one.c_name}" in read),
    )


def _canonical(result: tuple[Any, Any], block: Block) -> tuple[Any, dict[str, Any]]:
    """Arrays throughout, and the outputs that the block declares in the order of their names."""
    state, outputs = result
    if missing := {one.name for one in block.outputs} - set(outputs):
        raise ValueError(f"{block.name} gives no output {sorted(missing)}.")
    named = {one.name: jnp.asarray(outputs[one.name], dtype=float) for one in block.outputs}
    return jax.tree.map(jnp.asarray, state), named
