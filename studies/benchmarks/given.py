"""A problem as a peer is given it, in one file; numpy alone, so that any environment can read it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Given:
    """Members and constants of a problem, and the exact solution of the first members.

    `said` is the problem in words that a file can be told by: constants (`smajax.cli.benchmark_arm`), seconds and limits.
    """

    said: str
    voltage: np.ndarray  # V, (members,)
    payload_mass: np.ndarray  # kg
    times: np.ndarray  # s
    angle: np.ndarray  # degrees, (solved members, times)
    fraction: np.ndarray

    @property
    def constants(self) -> dict[str, float]:
        """By smajax's names, SI, temperatures in C."""
        return dict(json.loads(self.said)["constants"])

    @property
    def seconds(self) -> float:
        """Length of a trajectory, s."""
        return float(self.times[-1])

    @property
    def solved(self) -> int:
        """How many members, from the first on, have an exact solution."""
        return len(self.angle)

    def errors(self, angle: np.ndarray, fraction: np.ndarray, every: int = 1) -> tuple[float, float]:
        """Largest errors of angle (degrees) and fraction over the solved members; infinite where one is not finite.

        `every`: given at every so many of the times.
        """
        off = np.abs(angle - self.angle[:, ::every]).max(), np.abs(fraction - self.fraction[:, ::every]).max()
        return (float(off[0]), float(off[1])) if np.isfinite(off).all() else (float("inf"), float("inf"))

    def meets(self, off: tuple[float, float]) -> bool:
        """Whether errors are within what is asked for."""
        angle, fraction = json.loads(self.said)["limits"]
        return bool(off[0] < angle and off[1] < fraction)


def save(file: Path, given: Given) -> None:
    """Write a problem."""
    file.parent.mkdir(parents=True, exist_ok=True)
    np.savez(file, **{name: np.asarray(value) for name, value in vars(given).items()})  # type: ignore[arg-type]


def load(file: Path) -> Given:
    """Read a problem."""
    with np.load(file) as archive:
        return Given(str(archive["said"]), *(archive[name] for name in Given.__annotations__ if name != "said"))
