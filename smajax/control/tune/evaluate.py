"""Candidates on scenarios in one batch: terms, their gradients in the gains, and figures of merit.

Slopes are forward: gains are few and loops many. A candidate is a point of the unit cube, the box of the gains by
logarithm.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import ClosedLoopSetup, observe_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.preset import Box, ControllerPreset
from smajax.control.figures_of_merit import Merit, merit_observer
from smajax.control.load_equation import stroke_of
from smajax.control.perturbed_plant import Perturbation, perturbed_plant
from smajax.control.plants import PlantSet, plant_set
from smajax.control.reference import clock, constant
from smajax.control.scales import arm_scales, is_arm
from smajax.control.signal_path import Interface
from smajax.control.sweep.batched_loops import NUMBER, TARGET
from smajax.control.tune.scenarios import Scenarios
from smajax.control.tune.terms import TERMS, Terms, exact_vector, factors_in, term_observer, term_vector
from smajax.core.parameters import check_bounds, get_parameters, set_parameters, set_vector
from smajax.model.system import System
from smajax.model.types import Scalar, Series
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.chunks import Function, chunks
from smajax.simulation.steppers import ONE_STEP, Integration

LOOPS = 256  # at most, in a batch: between two batches a run can be interrupted
STEP = 0.01  # s, of the simulation while tuning
FINE = 0.005  # s, of the simulation whose figures of merit are reported
LARGEST_GRADIENT = 1e4  # units of a term per box: a larger gradient predicts nothing


class Evaluation(NamedTuple):
    """Results of candidates: arrays of shape (candidates, scenarios, ...)."""

    terms: np.ndarray  # (C, M, terms), with derivatives; units of `terms_in`
    gradients: np.ndarray  # (C, M, terms, gains), by the unit cube; of no length where they were not requested
    exact: np.ndarray  # (C, M, terms), the settling time itself
    merits: Merit

    @property
    def failed(self) -> np.ndarray:
        """(C, M): some value is not finite."""
        return ~(np.isfinite(self.exact) & np.isfinite(self.terms)).all(axis=2)

    def unusable(self, used: np.ndarray | list[int]) -> np.ndarray:
        """(C, M): the gradients of the terms `used` are not finite, or so large that they predict nothing."""
        return ~(np.abs(self.gradients[:, :, used]) < LARGEST_GRADIENT).all(axis=(2, 3))  # nan is not


class _Problem(eqx.Module):
    system: System
    controller: AbstractController
    low: Series  # logarithm of the gains at the cube's corner
    width: Series
    time: Series
    softness: Scalar
    length: Scalar  # of the load's stroke, in those of the arm: what a layer's width is a share of
    factors: Series  # of the terms, from SI to the units shown
    interface: Interface
    key: jax.Array
    integration: Integration
    names: tuple[str, ...] = eqx.field(static=True)
    perturbation: Perturbation = eqx.field(static=True)
    smoothed: Callable[[AbstractController, Scalar], AbstractController] | None = eqx.field(static=True)


def _point(problem: _Problem, values: dict[str, Scalar]) -> Scalar:
    return jnp.stack([values[f"at {name}"] for name in problem.names])


def _loop(problem: _Problem, values: dict[str, Scalar], point: Scalar) -> tuple[Terms, Merit]:
    plant = perturbed_plant(problem.system, values, problem.perturbation)
    wanted = constant(problem.time, values[TARGET])
    controller = set_vector(problem.controller, problem.names, jnp.exp(problem.low + point * problem.width))
    if problem.smoothed is not None:
        controller = problem.smoothed(controller, problem.softness * problem.length)
    observer = term_observer(merit_observer(plant, wanted, assumed=problem.system), problem.softness)
    settings = problem.interface.settings(problem.time[1] - problem.time[0], problem.key, values[NUMBER])
    setup = ClosedLoopSetup(
        plant, controller, wanted, integration=problem.integration, assumed=problem.system, **settings
    )
    return observe_closed_loop(observer, setup)[0]


def _valued(problem: _Problem, values: dict[str, Scalar]) -> dict[str, Any]:
    terms, merit = _loop(problem, values, _point(problem, values))
    exact = exact_vector(terms, merit, problem.time[-1], problem.factors)
    return {"terms": term_vector(terms, problem.factors), "exact": exact, "merits": merit}


def _sloped(problem: _Problem, values: dict[str, Scalar]) -> dict[str, Any]:
    def terms_of(point: Scalar) -> tuple[Scalar, tuple[Terms, Merit]]:
        terms, merit = _loop(problem, values, point)
        return term_vector(terms, problem.factors), (terms, merit)

    gradients, (terms, merit) = jax.jacfwd(terms_of, has_aux=True)(_point(problem, values))
    exact = exact_vector(terms, merit, problem.time[-1], problem.factors)
    return {"terms": term_vector(terms, problem.factors), "gradients": gradients, "exact": exact, "merits": merit}


class TuningProblem:
    """A controller on its plant with a box of gains. `simulations` counts the closed loops so far.

    system: any load that moves; gains and box are the arm's, scaled to it. plants: what the columns of scenarios mean.
    Raises ValueError for gains that the controller does not have, bounds that are not positive and rising, and a plant that
    does not give what the controller needs.
    """

    def __init__(
        self,
        preset: ControllerPreset,
        system: System,
        *,
        box: Box | None = None,
        seconds: float = 10.0,
        interface: Interface | None = None,
        seed: int = 0,
        loops: int = LOOPS,
        plants: PlantSet | None = None,
    ) -> None:
        self.preset = preset
        self.system = preset.plant(system)
        self.controller = preset.make(self.system)
        self.plants = plant_set(system) if plants is None else plants
        self.box = dict(preset.box_on(self.system) if box is None else box)
        wrong = {name: bounds for name, bounds in self.box.items() if not 0.0 < bounds[0] < bounds[1]}
        if wrong:
            raise ValueError(f"gains are searched by logarithm: bounds must be positive and rise, not {wrong}.")
        for side in (0, 1):
            check_bounds(set_parameters(self.controller, {name: bounds[side] for name, bounds in self.box.items()}))
        self.names = tuple(self.box)
        low, high = np.log(np.asarray(list(self.box.values()))).T
        self._low, self._width = low, high - low
        self.seconds, self.interface, self.seed, self.loops = seconds, interface or Interface(), seed, loops
        self.simulations = 0
        self.integration = ONE_STEP  # how finely between two samples

    @property
    def before(self) -> np.ndarray:
        """The preset's gains, held in the box, as a point of the cube."""
        return self.point(dict(zip(self.names, np.asarray(get_parameters(self.controller, self.names)), strict=True)))

    def gains(self, point: np.ndarray) -> dict[str, float]:
        """The gains at a point, to six digits: the values that are evaluated are those of the file."""
        values = np.exp(self._low + point * self._width)
        return {name: float(f"{value:.6g}") for name, value in zip(self.names, values, strict=True)}

    def point(self, gains: Mapping[str, float]) -> np.ndarray:
        """The point of gains, held in the cube."""
        values = np.asarray([gains[name] for name in self.names])
        return np.clip((np.log(values) - self._low) / self._width, 0.0, 1.0)

    def rounded(self, points: np.ndarray) -> np.ndarray:
        """Points (C, gains) with gains to six digits, as a file has them."""
        return np.stack([self.point(self.gains(one)) for one in points])

    def evaluate_gradients(self, points: np.ndarray, scenarios: Scenarios, softness: float) -> Evaluation:
        """Terms with gradients of every point (C, gains); a switching controller is smoothed by `softness`, a sensor's steps are noise."""
        return self._evaluated(_sloped, points, scenarios, STEP, softness, True)

    def evaluate(self, points: np.ndarray, scenarios: Scenarios, dt: float = FINE) -> Evaluation:
        """The same loops without gradients and without smoothing."""
        return self._evaluated(_valued, points, scenarios, dt, 0.1, False)

    def _evaluated(
        self, function: Function, points: np.ndarray, scenarios: Scenarios, dt: float, softness: float, smooth: bool
    ) -> Evaluation:
        inside = round(STEP / dt)
        interface = dataclasses.replace(self.interface, every=self.interface.every * inside)
        if smooth and interface.sensor is not None and float(interface.sensor.quantum) > 0.0:
            interface = dataclasses.replace(interface, sensor=interface.sensor.smoothed())
        arm = is_arm(self.system)
        length = 1.0 if arm else float(stroke_of(self.system) / arm_scales().position)
        problem = _Problem(
            system=self.system,
            controller=self.controller,
            low=jnp.asarray(self._low),
            width=jnp.asarray(self._width),
            time=clock(self.seconds, dt),
            softness=jnp.asarray(softness),
            length=jnp.asarray(length),
            factors=jnp.asarray(factors_in(self.plants.unit)),
            interface=interface,
            key=jax.random.key(self.seed),
            integration=self.integration,
            names=self.names,
            perturbation=self.plants.perturbation,
            smoothed=self.preset.smoothed if smooth else None,
        )
        count, size = len(points), scenarios.size
        engine = self.preset.derivatives_by if smooth else "auto"
        columns = {f"at {name}": np.repeat(points[:, k], size) for k, name in enumerate(self.names)}
        columns |= dict(zip((*self.plants.columns, TARGET), np.tile(scenarios.rows, (count, 1)).T, strict=True))
        columns[NUMBER] = np.tile(np.arange(size, dtype=float), count)
        result = []
        for start in range(0, count * size, self.loops):
            # Batches of one size, the last one filled up: one program serves however many starts are left.
            some = np.minimum(np.arange(start, start + self.loops), count * size - 1)
            axes = zipped({name: values[some] for name, values in columns.items()})
            result += [answer for _, answer in chunks(function, problem, axes, self.loops, [0], engine=engine)]
        whole = jax.tree.map(lambda *leaves: np.concatenate(leaves)[: count * size], *result)
        self.simulations += count * size
        by_candidate = jax.tree.map(lambda leaf: leaf.reshape(count, size, *leaf.shape[1:]), whole)
        return Evaluation(**{"gradients": np.zeros((count, size, len(TERMS), 0)), **by_candidate})
