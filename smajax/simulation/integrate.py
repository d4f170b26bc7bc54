"""The one march in time: an advance, its inputs step by step, and observers -> the last state and what was observed.

Every run of the package goes through `integrate`: single runs, runs of a batch with and without slopes, closed loops, and figures
of merit of a run that is stored. How a state moves on by one step is the `advance` (`steppers`); what is made of the states is
up to observers (`observers`); what a sampled controller does between steps is the `control`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.core.checkpointed_scan import checkpointed_scan


class Carry(NamedTuple):
    """What goes from step to step."""

    state: Any
    memory: Any = None  # of the advance, such as the length of the next step


class Step(NamedTuple):
    """One step, as an observer sees it."""

    before: Any  # state
    inputs: Any  # held during the step
    after: Any  # state


class Period(NamedTuple):
    """One period of `Schedule.every` steps, as an observer sees it."""

    after: Any  # state at its end
    shown: Any  # what the control gave at its beginning, None without one


class Controlled(NamedTuple):
    """The inputs of a step under a control."""

    held: Any  # the control's command, the same throughout a period
    now: Any  # the step's own


class Control(NamedTuple):
    """What acts once a period, before its first step: a sampled controller with a zero-order hold."""

    step: Callable[[Any, Any, Any], tuple[Any, Any, Any]]  # (memory, state, sample) -> (memory, held, shown)
    memory: Any  # before the first period
    samples: Any  # one for each period, leaves of shape (steps / every, ...)


class Schedule(NamedTuple):
    """How many steps there are, and how they are grouped."""

    steps: int
    every: int = 1  # steps a period; divides `steps`
    checkpointed: bool = False  # reverse mode then stores the square root of the steps and computes the others again


class Observed(NamedTuple):
    """A whole run, of which an observer gives the result."""

    start: Any  # state
    end: Any  # state
    memory: Any  # the observer's own
    samples: Any  # what it sampled, leaves of shape (steps, ...) or (periods, ...)
    control: Any  # the control's memory at the end, None without one


class AbstractObserver(eqx.Module):
    """What is made of a run while it goes on. Whatever is not overridden does nothing; no observers at all is `()`.

    Observers record: none estimates a state from readings, as the observers of control theory do (`smajax.control.estimators`).
    """

    per_period: ClassVar[bool] = False  # `sample` is called once a `Period`, otherwise once a `Step`

    def init(self, state: Any) -> Any:
        """The memory before the first step, any pytree."""
        return None

    def update(self, memory: Any, step: Step) -> Any:
        """The memory after a step, of the same structure, shapes and kinds."""
        return memory

    def sample(self, now: Any) -> Any:
        """What is stored of a step or period, any pytree."""
        return None

    def result(self, run: Observed) -> Any:
        """What was observed, any pytree."""
        return run.memory


class March(NamedTuple):
    """What comes of a run."""

    end: Carry
    control: Any  # the control's memory at the end
    results: tuple[Any, ...]  # one for each observer


Advance = Callable[[Carry, Any], Carry]


def integrate(
    advance: Advance,
    start: Carry,
    inputs: Any,
    schedule: Schedule,
    observers: Sequence[AbstractObserver] = (),
    control: Control | None = None,
) -> March:
    """Advance from `start` by `schedule.steps` steps. Pure: `jit`, `vmap` and differentiate it as the advance allows.

    `inputs`: a pytree with leaves of shape (steps, ...), one row a step; without leaves where nothing changes in time. Under a
    `control` the advance and the observers see `Controlled` inputs, otherwise the row itself.
    """
    sampling = [one.per_period for one in observers]

    def one_step(carry: tuple[Carry, tuple[Any, ...]], now: Any) -> tuple[tuple[Carry, tuple[Any, ...]], Any]:
        old, memories = carry
        new = advance(old, now)
        step = Step(old.state, now, new.state)
        memories = tuple(one.update(memory, step) for one, memory in zip(observers, memories, strict=True))
        return (new, memories), tuple(None if one.per_period else one.sample(step) for one in observers)

    memories = tuple(one.init(start.state) for one in observers)
    if control is None and not any(sampling):
        (end, memories), samples = _scan(one_step, (start, memories), inputs, schedule.steps, schedule.checkpointed)
        return _march(start, end, observers, memories, samples, None)

    every, periods = schedule.every, schedule.steps // schedule.every
    # A period of more steps than a segment has is checkpointed by itself.
    long = every**2 > schedule.steps

    def one_period(carry: Any, now: Any) -> tuple[Any, Any]:
        own, (rows, due) = carry, now
        memory, inner = own
        held = shown = None
        if control is not None:
            memory, held, shown = control.step(memory, inner[0].state, due)

        def body(inner: Any, row: Any) -> tuple[Any, Any]:
            return one_step(inner, row if control is None else Controlled(held, row))

        if every == 1:
            inner, stored = body(inner, rows)
        else:
            inner, stored = _scan(body, inner, rows, every, schedule.checkpointed and long)
        period = Period(inner[0].state, shown)
        return (memory, inner), (stored, tuple(one.sample(period) if one.per_period else None for one in observers))

    # Leaves of shape (periods, every, ...), or (periods, ...) where a period is a step.
    grouped = inputs if every == 1 else jax.tree.map(lambda leaf: leaf.reshape(periods, every, *leaf.shape[1:]), inputs)
    carry: Any = (None if control is None else control.memory, (start, memories))
    weight = 1 if long else every
    due = None if control is None else control.samples
    (memory, (end, memories)), (by_step, by_period) = _scan(
        one_period, carry, (grouped, due), periods, schedule.checkpointed, weight
    )
    if every > 1:
        by_step = jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), by_step)
    samples = tuple(period if rare else step for rare, step, period in zip(sampling, by_step, by_period, strict=True))
    return _march(start, end, observers, memories, samples, memory)


def _scan(
    body: Callable[[Any, Any], tuple[Any, Any]], carry: Any, rows: Any, length: int, checkpointed: bool, weight: int = 1
) -> tuple[Any, Any]:
    if checkpointed:
        return checkpointed_scan(body, carry, rows, length, weight)
    return lax.scan(body, carry, rows, length)


def _march(
    start: Carry,
    end: Carry,
    observers: Sequence[AbstractObserver],
    memories: tuple[Any, ...],
    samples: tuple[Any, ...],
    control: Any,
) -> March:
    results = tuple(
        one.result(Observed(start.state, end.state, memory, rows, control))
        for one, memory, rows in zip(observers, memories, samples, strict=True)
    )
    return March(end, control, results)


def with_first(first: Any, rest: Any) -> Any:
    """A pytree and the stacked ones after it, leaves of shape (n, ...)."""
    return jax.tree.map(lambda one, more: jnp.concatenate([one[None], more]), first, rest)
