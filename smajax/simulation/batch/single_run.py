"""One run of a batch: a system with its own values -> what is stored of the run, and whether it went wrong."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.core.parameters import get_parameters, parameters, set_parameters
from smajax.model.channels import INPUT_UNITS
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, Series
from smajax.simulation.input_delay import acting_inputs
from smajax.simulation.integrate import AbstractObserver, Carry, Schedule, integrate
from smajax.simulation.measures import SHOWN, AbstractMeasure
from smajax.simulation.observers import Measures, Status, ValueTrace
from smajax.simulation.simulate import held_inputs
from smajax.simulation.steppers import Integration, stepper_of

DIFFERENCES = {"degC": "K", "-": "1"}
Values = dict[str, Scalar]


class Recipe(eqx.Module):
    """What the runs of a batch have in common. Names that are varied are parameters or input channels."""

    system: System
    series: dict[str, Series]  # inputs over time, each of shape (steps + 1,)
    constants: dict[str, Scalar]  # inputs that do not change
    dt: Scalar
    measures: tuple[AbstractMeasure, ...]
    integration: Integration  # how finely between two samples
    channels: tuple[str, ...] = eqx.field(static=True)  # varied names that are input channels
    steps: int = eqx.field(static=True)
    every: int = eqx.field(static=True)  # one state in so many is stored
    keep: tuple[str, ...] = eqx.field(static=True)  # of `measures.SHOWN`, over time
    slopes: tuple[str, ...] = eqx.field(static=True, default=())  # parameters and varied inputs to differentiate by

    def units(self) -> dict[str, str]:
        """Of everything that a run gives, and of what may be varied."""
        own, load = self.system.load.reading[1], self.system.load
        moved = load.position_unit if isinstance(load, AbstractMovingLoad) else own
        own_of = {name: unit or own for name, unit in SHOWN.items()}
        own_of |= {"position": moved, "velocity": f"{moved}/s"}
        result = {name: own_of[name] for name in self.keep}
        measured = {one.name: one.unit or own_of.get(getattr(one, "of", ""), own) for one in self.measures}
        result |= measured
        table = parameters(self.system)
        for one in self.measures:
            for name in self.slopes:
                below = table[name].unit if name in table else INPUT_UNITS[name]
                result[slope_name(one.name, name)] = _per(measured[one.name], below)
        varied = {**INPUT_UNITS, **{name: one.unit for name, one in table.items()}}
        return varied | result | {"status": "-", "first_bad_time": "s"}


def slope_name(measure: str, name: str) -> str:
    """Of the derivative of a measure by a parameter or an input, in a result."""
    return f"{measure}_by_{name}"


def _per(above: str, below: str) -> str:
    """The unit of a slope: of differences, which in temperature are kelvins."""
    above, below = (DIFFERENCES.get(one, one) for one in (above, below))
    if below == "1":
        return "-" if above == "1" else above
    return f"{above}/{below if below.isalpha() else f'({below})'}"


def single_run(recipe: Recipe, values: Values) -> dict[str, jax.Array]:
    """Simulate one run. Stored values are arrays (steps // every + 1,), everything else is a number.

    Pure: `jit`, `vmap` and differentiate it as you like, but for the slopes that the recipe asks for, which have no derivative of their own: with
    error-controlled steps they are found along the run, parameter by parameter; with equal steps backwards through it, whatever their number, once for
    every measure.
    """
    if not recipe.slopes:
        return without_slopes(recipe, values)
    at = {name: values[name] if name in values else get_parameters(recipe.system, [name])[0] for name in recipe.slopes}
    slopes = _slopes_back if recipe.integration.tolerance is None else _slopes_along
    return slopes(recipe, values, at)


def _slopes_along(recipe: Recipe, values: Values, at: Values) -> dict[str, jax.Array]:
    """In forward mode: steps whose number depends on the parameters have no way back."""
    names = [one.name for one in recipe.measures]

    def measured(place: jax.Array) -> tuple[jax.Array, dict[str, jax.Array]]:
        result = without_slopes(recipe, values | dict(zip(at, place, strict=True)))
        return jnp.stack([jnp.asarray(result[name], dtype=float) for name in names]), result

    slopes, result = jax.jacfwd(measured, has_aux=True)(
        jnp.stack([jnp.asarray(one, dtype=float) for one in at.values()])
    )
    found = {slope_name(name, by): slopes[row, k] for row, name in enumerate(names) for k, by in enumerate(at)}
    return result | found


def _slopes_back(recipe: Recipe, values: Values, at: Values) -> dict[str, jax.Array]:
    """In reverse mode."""
    names = [one.name for one in recipe.measures]

    def measured(at: Values) -> tuple[tuple[Scalar, ...], dict[str, jax.Array]]:
        result = without_slopes(recipe, values | at)
        return tuple(result[name] for name in names), result

    _, back, result = jax.vjp(measured, at, has_aux=True)
    for number, name in enumerate(names):
        weights = tuple(jnp.asarray(float(k == number)) for k in range(len(names)))
        (slopes,) = back(weights)
        result |= {slope_name(name, by): slope for by, slope in slopes.items()}
    return result


def without_slopes(recipe: Recipe, values: Values) -> dict[str, jax.Array]:
    """The run and its measures alone, to be differentiated as you like."""
    own = {name: value for name, value in values.items() if name not in recipe.channels}
    system = set_parameters(recipe.system, own)
    constants = recipe.constants | {name: values[name] for name in recipe.channels}
    acting = acting_inputs(system, recipe.series, recipe.dt)
    first = {**constants, **{name: series[0] for name, series in acting.items()}}
    stepper = stepper_of(system, recipe.dt, recipe.integration, once=bool(recipe.slopes))

    def advance(carry: Carry, now: dict[str, Scalar]) -> Carry:
        return stepper(carry, {**constants, **now})

    traces: list[AbstractObserver] = [ValueTrace(recipe.keep)] if recipe.keep else []
    observers = [*traces, Measures(recipe.measures, recipe.dt, constants, first), Status()]
    schedule = Schedule(recipe.steps, recipe.every, checkpointed=True)
    start = stepper.start(initial_state(system, first), first)
    run = integrate(advance, start, held_inputs(system, acting), schedule, observers)
    return {name: value for result in run.results for name, value in result.items()}
