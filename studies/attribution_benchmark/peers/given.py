"""A case as a peer with an environment of its own is handed it: a file that numpy alone can read.

Runs with commands, reading, and what the refitted base model makes of them. No truth, no name of an effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Series:
    """One run, n samples."""

    name: str
    fitted: bool  # whether fits may see it
    inputs: dict[str, np.ndarray]  # channel -> (n,), SI
    reading: np.ndarray  # (n,), over the noise
    base: np.ndarray  # (n,), the base model's, over the noise, its best zero added
    states: dict[str, np.ndarray]  # the base model's, (n,), SI

    @property
    def residual(self) -> np.ndarray:
        """(n,), over the noise; its mean is zero."""
        return self.reading - self.base


@dataclass(frozen=True)
class Given:
    """All runs of a case, on one clock."""

    rig: str  # coupon, or a wire that is heated
    step: float  # s
    runs: tuple[Series, ...]

    @property
    def fit_runs(self) -> list[Series]:
        """Those that a peer may learn from."""
        return [run for run in self.runs if run.fitted]


def error(runs: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Rms over all samples of pairs (measured, predicted), each run's best zero off."""
    off = np.concatenate([(one - other) - np.mean(one - other) for one, other in runs])
    return float(np.sqrt(np.mean(off**2)))


def save(file: Path, given: Given) -> None:
    """Write a case."""
    arrays: dict[str, np.ndarray] = {"rig": np.asarray(given.rig), "step": np.asarray(given.step)}
    for number, run in enumerate(given.runs):
        here = f"{number:02d}"
        arrays |= {f"{here}/name": np.asarray(run.name), f"{here}/fitted": np.asarray(run.fitted)}
        arrays |= {f"{here}/reading": run.reading, f"{here}/base": run.base}
        arrays |= {f"{here}/inputs/{name}": one for name, one in run.inputs.items()}
        arrays |= {f"{here}/states/{name}": one for name, one in run.states.items()}
    np.savez(file, **arrays)  # type: ignore[arg-type]


def load(file: Path) -> Given:
    """Read a case."""
    with np.load(file) as kept:
        arrays = dict(kept)

    def under(place: str) -> dict[str, np.ndarray]:
        return {name.removeprefix(place): one for name, one in arrays.items() if name.startswith(place)}

    runs = []
    for here in sorted({name.split("/")[0] for name in arrays if "/" in name}):
        own = under(f"{here}/")
        runs.append(
            Series(
                str(own["name"]),
                bool(own["fitted"]),
                under(f"{here}/inputs/"),
                own["reading"],
                own["base"],
                under(f"{here}/states/"),
            )
        )
    return Given(str(arrays["rig"]), float(arrays["step"]), tuple(runs))
