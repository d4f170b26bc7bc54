"""Full voltage, none, then a controller that holds: the two switching times by exhaustive search, refined by halving the grid."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.preset import EQUATION, STATE, ControllerPreset
from smajax.control.measured_state import MeasuredState
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import Reference, clock, constant
from smajax.control.tune.evaluate import TuningProblem
from smajax.control.tune.scenarios import tuned_on
from smajax.core.parameters import parameter, set_parameters
from smajax.model.system import System
from smajax.model.types import Scalar

HOLDS = "backstepping1_integral"  # knows the plant and the true state: here it only holds
SIDE, ZOOMS = 17, 5
PERIOD = 0.005  # s
SHORTEST = 0.01  # s, of a pause


class BangMemory(eqx.Module):
    """Time since the start, and the memory of the controller that holds."""

    time: Scalar
    holding: Any


class Bang(AbstractController):
    """`largest_voltage` up to `full_until`, nothing for `pause`, then what the controller `holding` asks for."""

    holding: AbstractController
    full_until: Scalar = parameter("s", 0.0, 1e3, "first switching time")
    pause: Scalar = parameter("s", 0.0, 1e3, "from the first to the second")
    full_voltage: Scalar = parameter("V", 0.0, 1e4, "largest command")

    def start(self, measured: MeasuredState, wanted: Reference) -> BangMemory:
        return BangMemory(jnp.zeros_like(measured.position), self.holding.start(measured, wanted))

    def step(
        self, memory: BangMemory, measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[BangMemory, Scalar]:
        full, off = memory.time < self.full_until - 1e-9, memory.time < self.full_until + self.pause - 1e-9
        fresh = self.holding.start(measured, wanted)
        begun = jax.tree.map(lambda new, old: jnp.where(off, new, old), fresh, memory.holding)
        later, held = self.holding.step(begun, measured, wanted, period)
        voltage = jnp.where(full, self.full_voltage, jnp.where(off, 0.0, held))
        return BangMemory(memory.time + period, later), voltage


def bang(system: System, full_voltage: float) -> Bang:
    """Before its times are searched."""
    holding = set_parameters(CONTROLLERS[HOLDS].make(system), {"largest_voltage": full_voltage})
    return Bang(holding, 1.0, 0.1, full_voltage)


def switching_times(
    system: System, degrees: float, full_voltage: float, reach: float, seconds: float
) -> tuple[float, float, float]:
    """(settling time, full until, pause), s, of the best pair of times. `reach`: the time to the set point at full voltage."""
    preset = ControllerPreset(
        lambda plant: bang(plant, full_voltage), "full_until", STATE, {}, needs=EQUATION, known=frozenset({"holding"})
    )
    box = {"full_until": (0.4 * reach, 1.1 * reach), "pause": (SHORTEST, max(0.5, 0.8 * reach))}
    problem = TuningProblem(preset, system, box=box, seconds=seconds, loops=SIDE**2)
    scenario = tuned_on([degrees], {}, 0)
    low, high, best = np.zeros(2), np.ones(2), (np.inf, np.zeros(2))
    for _ in range(ZOOMS):
        axes = [np.linspace(low[k], high[k], SIDE) for k in range(2)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        settled = np.asarray(problem.evaluate(points, scenario).merits.settling_time)[:, 0]
        at = int(np.argmin(settled))
        if settled[at] < best[0]:
            best = (float(settled[at]), points[at])
        width = 0.25 * (high - low)
        low, high = np.clip(best[1] - width, 0.0, 1.0), np.clip(best[1] + width, 0.0, 1.0)
    gains = problem.gains(best[1])
    return best[0], gains["full_until"], gains["pause"]


def switched_voltage(
    system: System, degrees: float, full_voltage: float, full_until: float, pause: float, seconds: float
) -> np.ndarray:
    """The command of a pair of times, V, sample by sample."""
    times = {"full_until": full_until, "pause": pause}
    controller = set_parameters(bang(system, full_voltage), times)
    wanted = constant(clock(seconds, PERIOD), np.radians(degrees))
    return np.asarray(simulate_closed_loop(system, controller, wanted, PERIOD, 1).voltage)
