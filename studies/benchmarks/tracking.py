r"""What is differentiated beside others: a cost of tracking by all parameters of the arm; numpy alone.

$J = \frac{1}{T} \int_0^T [(\theta - \theta_d)/s]^2 dt$ of the arm lifted by a constant voltage, with $\theta_d$ a ramp from its rest
to `ENDS_AT` and $s$ `SCALE`; smajax takes the mean over the ends of its steps. For the peers J is a sixth state of
`smajax.cli.benchmark_arm`. Those equations know no `start_fraction`, for they begin in martensite: a slope by it is not compared.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from smajax.cli import benchmark_arm as equations

SECONDS = 10.0
ENDS_AT, SCALE = 0.5, 0.1  # rad
VOLTAGES = (5.5, 8.5)  # V
PAYLOAD = 0.9  # of the preset's: as in `problem.py` no member comes to a stop
LIMIT = 3e-2  # of the norm of the slopes, each times its parameter: what the default step of smajax keeps
UNKNOWN = "start_fraction"
DIFFERENCE = 1e-4  # of a parameter, to either side
RTOL = 1e-9
REPEATS = 10  # of everything that is timed here: a tenth of a second each, and of two of them a ratio is taken

State = tuple[Any, ...]  # of `smajax.cli.benchmark_arm`, and the cost so far


@dataclass(frozen=True)
class Tracking:
    """Constants (JSON, by smajax's names), members and the exact slopes of the first of them."""

    said: str
    voltage: np.ndarray  # V, (members,)
    cost: np.ndarray  # -, (solved members,)
    slopes: np.ndarray  # by each of `names`, (solved members, parameters)

    @property
    def constants(self) -> dict[str, float]:
        """By smajax's names, SI, temperatures in C, the payload with them."""
        return dict(json.loads(self.said))

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters in the order of a gradient."""
        return tuple(self.constants)

    @property
    def vector(self) -> np.ndarray:
        """Their values, (parameters,)."""
        return np.array(list(self.constants.values()))

    @property
    def solved(self) -> np.ndarray:
        """Voltages of the members with exact slopes, V: spread over all of them."""
        return self.voltage[np.linspace(0, len(self.voltage) - 1, len(self.cost)).round().astype(int)]

    def error(self, slopes: np.ndarray) -> float:
        """Largest distance of a solved member's slopes from the exact ones, over the norm of those; infinite if not finite."""
        weights = np.where(np.array(self.names) == UNKNOWN, 0.0, self.vector)
        off = np.linalg.norm((slopes - self.slopes) * weights, axis=1) / np.linalg.norm(self.slopes * weights, axis=1)
        return float(off.max()) if np.isfinite(slopes).all() else float("inf")


def on_one_core() -> None:
    """Of this process and what it starts, where the system can say so: what is compared is the work, not how it is divided."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def start(xp: Any, p: Mapping[str, Any]) -> State:
    """The six states at rest; `p` the constants, of any shape."""
    first = equations.start(xp, p, p["payload_mass"])
    return (*first, 0.0 * first[0])


def rates(xp: Any, p: Mapping[str, Any], voltage: Any, rest: float, time: Any, state: State) -> State:
    """Their time derivative at `time`, s, under `voltage`, V; the ramp begins at `rest`, rad, whatever `p` says."""
    temperature, tension, angle, rate, furthest, _ = state
    moved = equations.rates(xp, p, voltage, p["payload_mass"], (temperature, tension, angle, rate, furthest))
    off = (angle - (rest + (ENDS_AT - rest) * (time / SECONDS))) / SCALE
    return (*moved, off * off / SECONDS)


def _solved(constants: Mapping[str, float], voltage: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(cost, slopes) of members by central differences of tight solutions, all of them one system with one series of steps."""
    from scipy.integrate import solve_ivp

    vector = np.array(list(constants.values()))
    step = DIFFERENCE * np.where(vector == 0.0, 1.0, np.abs(vector))
    shifted = np.concatenate([vector[None], vector + np.diag(step), vector - np.diag(step)])
    count = len(shifted)
    p = dict(zip(constants, np.tile(shifted, (len(voltage), 1)).T, strict=True))
    volts, rest = np.repeat(voltage, count), constants["start_angle"]

    def slope(time: float, flat: np.ndarray) -> np.ndarray:
        return np.stack(rates(np, p, volts, rest, time, tuple(flat.reshape(6, -1)))).ravel()

    first = np.stack(start(np, p)).ravel()
    done = solve_ivp(slope, (0.0, SECONDS), first, "DOP853", [SECONDS], rtol=RTOL, atol=RTOL, max_step=0.05)
    cost = done.y[-len(volts) :, -1].reshape(len(voltage), count)
    half = len(vector)
    return cost[:, 0], (cost[:, 1 : half + 1] - cost[:, half + 1 :]) / (2.0 * step)


def tracking(constants: Mapping[str, float], solved: int, count: int, folder: Path) -> tuple[Path, Tracking]:
    """`count` members with `constants` (`problem.constants`), exact slopes of `solved` of them; and the file that stores them."""
    own = {**constants, "payload_mass": PAYLOAD * constants["payload_mass"]}
    said, voltage = json.dumps(own), np.linspace(*VOLTAGES, count)
    file = folder / f"tracking_{solved}_of_{count}.npz"
    if file.is_file():
        cached = load(file)
        if cached.said == said and np.array_equal(cached.voltage, voltage):
            return file, cached
    made = Tracking(said, voltage, np.zeros(solved), np.zeros((solved, len(own))))
    made = Tracking(said, voltage, *_solved(own, made.solved))
    file.parent.mkdir(parents=True, exist_ok=True)
    np.savez(file, **{name: np.asarray(value) for name, value in vars(made).items()})  # type: ignore[arg-type]
    return file, made


def load(file: Path) -> Tracking:
    """Read a problem."""
    with np.load(file) as cached:
        return Tracking(str(cached["said"]), cached["voltage"], cached["cost"], cached["slopes"])
