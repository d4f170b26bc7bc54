"""Experiment: measured runs on uniform clocks, what is known, what is to be found. The record all later stages read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from smajax.measured.table import Array


@dataclass(frozen=True)
class Unknown:
    """A parameter to be found, in the program's own unit (SI, degC, rad): low < high, low <= start <= high."""

    name: str
    unit: str
    low: float
    high: float
    start: float


@dataclass(frozen=True)
class Run:
    """One measured run on the experiment's clock.

    role: "fit" or "held-out". time (n,): seconds as measured, one step apart. inputs: channel -> (n,), each value
    holding for the step that begins at its time. output (n,): the sensor at those times. parameters: this run's own
    values, which go before the experiment's. files, sha256: what was read, and the digest of their bytes in order.
    """

    name: str
    role: str
    time: Array
    inputs: dict[str, Array]
    output: Array
    parameters: dict[str, float]
    files: tuple[Path, ...]
    sha256: str


@dataclass(frozen=True)
class Experiment:
    """A validated experiment; every number is in the program's own units (SI, degC, rad).

    noise_sigma: white measurement noise of the output on the clock; noise_how: where that number is from.
    offset: whether each run has an unknown sensor zero. effects_only None: every effect is a candidate.
    warnings: what is allowed and looks wrong, one sentence each.
    """

    name: str
    title: str
    path: Path
    wire: str
    load: str
    drive: str
    parameters: dict[str, float]
    unknowns: tuple[Unknown, ...]
    offset: bool
    step: float
    output_name: str
    output_unit: str
    noise_sigma: float
    noise_how: str
    effects_only: tuple[str, ...] | None
    effects_excluded: tuple[str, ...]
    runs: tuple[Run, ...]
    warnings: tuple[str, ...]

    @property
    def declared_effects(self) -> tuple[str, ...]:
        """Effects that the base model has already: those of which a parameter is given or unknown."""
        named = [*self.parameters, *(unknown.name for unknown in self.unknowns)]
        return tuple(dict.fromkeys(name.split(".", 1)[0] for name in named if "." in name))
