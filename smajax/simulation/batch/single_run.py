"""One member of a batch: a system with its own values -> what is kept of its run, and whether it went wrong."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.core.checkpointed_scan import checkpointed_scan
from smajax.core.parameters import get_parameters, parameters, set_parameters
from smajax.model.channels import INPUT_UNITS
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, Series, State
from smajax.simulation.adaptive_steps import advance
from smajax.simulation.input_delay import acting_inputs
from smajax.simulation.measures import SHOWN, AbstractMeasure, value_of
from smajax.simulation.step import step

# Status codes of a member.
GOOD, NOT_FINITE, RUNAWAY = 0, 1, 2
HOTTEST = 3000.0  # C: no wire is hotter, it has molten long before
COLDEST = -273.15  # C
DIFFERENCES = {"degC": "K", "-": "1"}
Values = dict[str, Scalar]


class Recipe(eqx.Module):
    """What the members of a batch have in common. Names that are varied are parameters or input channels."""

    system: System
    series: dict[str, Series]  # inputs over time, each of shape (steps + 1,)
    constants: dict[str, Scalar]  # inputs that do not change
    dt: Scalar
    measures: tuple[AbstractMeasure, ...]
    tolerance: Scalar | None  # of `adaptive.advance`; None: one step of `dt` each
    channels: tuple[str, ...] = eqx.field(static=True)  # varied names that are input channels
    steps: int = eqx.field(static=True)
    every: int = eqx.field(static=True)  # one state in so many is kept
    keep: tuple[str, ...] = eqx.field(static=True)  # of `measure.SHOWN`, over time
    slopes: tuple[str, ...] = eqx.field(static=True, default=())  # parameters and varied inputs to differentiate by

    def units(self) -> dict[str, str]:
        """Of everything that a member gives, and of what may be varied."""
        own = self.system.load.reading[1]
        own_of = {name: unit or (f"{own}/s" if name == "velocity" else own) for name, unit in SHOWN.items()}
        found = {name: own_of[name] for name in self.keep}
        measured = {one.name: one.unit or own_of.get(getattr(one, "of", ""), own) for one in self.measures}
        found |= measured
        table = parameters(self.system)
        for one in self.measures:
            for name in self.slopes:
                below = table[name].unit if name in table else INPUT_UNITS[name]
                found[slope_name(one.name, name)] = _per(measured[one.name], below)
        varied = {**INPUT_UNITS, **{name: one.unit for name, one in table.items()}}
        return varied | found | {"status": "-", "first_bad_time": "s"}


def _wrong(state: State) -> tuple[Scalar, Scalar]:
    """(not finite, runaway)."""
    wire, motion = state.wire, state.motion
    total = wire.temperature + wire.stress + wire.martensite_fraction + motion.position + motion.velocity
    return ~jnp.isfinite(total), (wire.temperature > HOTTEST) | (wire.temperature < COLDEST)


def slope_name(measure: str, name: str) -> str:
    """Of the derivative of a measure by a parameter or an input, in a result."""
    return f"{measure}_by_{name}"


def _per(above: str, below: str) -> str:
    """The unit of a slope: of differences, which in temperature are kelvins."""
    above, below = (DIFFERENCES.get(one, one) for one in (above, below))
    if below == "1":
        return "-" if above == "1" else above
    return f"{above}/{below if below.isalpha() else f'({below})'}"


def member(recipe: Recipe, values: Values) -> dict[str, jax.Array]:
    """Simulate one member. Kept values are arrays (steps // every + 1,), everything else is a number.

    Pure: `jit`, `vmap` and differentiate it as you like, but for the slopes that the recipe asks for: they are found
    backwards through the run, whatever their number, once for every measure, and have no derivative of their own.
    """
    if not recipe.slopes:
        return _run(recipe, values)
    at = {name: values[name] if name in values else get_parameters(recipe.system, [name])[0] for name in recipe.slopes}
    names = [one.name for one in recipe.measures]

    def measured(at: Values) -> tuple[tuple[Scalar, ...], dict[str, jax.Array]]:
        found = _run(recipe, values | at)
        return tuple(found[name] for name in names), found

    _, back, found = jax.vjp(measured, at, has_aux=True)
    for number, name in enumerate(names):
        weights = tuple(jnp.asarray(float(k == number)) for k in range(len(names)))
        (slopes,) = back(weights)
        found |= {slope_name(name, by): slope for by, slope in slopes.items()}
    return found


def _run(recipe: Recipe, values: Values) -> dict[str, jax.Array]:
    own = {name: value for name, value in values.items() if name not in recipe.channels}
    system = set_parameters(recipe.system, own)
    constants = recipe.constants | {name: values[name] for name in recipe.channels}
    ahead = isinstance(system.load, AbstractCoupon)
    acting = acting_inputs(system, recipe.series, recipe.dt)
    series = {name: run[1:] if ahead else run[:-1] for name, run in acting.items()}
    first = {**constants, **{name: run[0] for name, run in acting.items()}}
    state = initial_state(system, first)

    def one(carry: Any, now: dict[str, Scalar]) -> tuple[Any, None]:
        state, tried, memories, bad, status = carry
        inputs = {**constants, **now}
        if recipe.tolerance is None:
            state = step(system, state, inputs, recipe.dt, once=bool(recipe.slopes))
        else:
            state, tried, _ = advance(system, state, inputs, recipe.dt, tried, recipe.tolerance)
        memories = [
            measure.update(memory, state, inputs, recipe.dt)
            for measure, memory in zip(recipe.measures, memories, strict=True)
        ]
        broken, hot = _wrong(state)
        code = jnp.where(broken, NOT_FINITE, jnp.where(hot, RUNAWAY, GOOD))
        fresh = (status == GOOD) & (code != GOOD)
        return (state, tried, memories, jnp.where(fresh, state.time, bad), jnp.where(fresh, code, status)), None

    start = [measure.start(state, first) for measure in recipe.measures]
    carry: Any = (state, recipe.dt, start, jnp.full_like(state.time, jnp.inf), jnp.zeros_like(state.time, int))
    found: dict[str, jax.Array] = {}
    if recipe.keep:
        periods = recipe.steps // recipe.every
        long = recipe.every**2 > recipe.steps  # then a period is more than a segment by itself

        def several(carry: Any, now: dict[str, Series]) -> tuple[Any, dict[str, Scalar]]:
            carry, _ = (
                checkpointed_scan(one, carry, now, recipe.every) if long else lax.scan(one, carry, now, recipe.every)
            )
            return carry, {name: value_of(carry[0], name) for name in recipe.keep}

        grouped = {name: run.reshape(periods, recipe.every) for name, run in series.items()}
        carry, kept = checkpointed_scan(several, carry, grouped, periods, weight=1 if long else recipe.every)
        found = {name: jnp.append(value_of(state, name), kept[name]) for name in recipe.keep}
    else:
        carry, _ = checkpointed_scan(one, carry, series, recipe.steps)
    _, _, memories, bad, status = carry
    found |= {measure.name: measure.result(memory) for measure, memory in zip(recipe.measures, memories, strict=True)}
    return found | {"status": status.astype("int8"), "first_bad_time": bad}
