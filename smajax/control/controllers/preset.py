"""A controller with its gains, as a sweep runs it and as tuning changes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from smajax.control.controllers.base import AbstractController
from smajax.model.system import System
from smajax.model.types import Scalar

Box = Mapping[str, tuple[float, float]]  # gain -> its positive bounds; the box is searched by logarithm
ANGLE, STATE = "angle", "angle, rate, stress, temperature, fraction"


def _same(system: System) -> System:
    return system


@dataclass(frozen=True)
class ControllerPreset:
    """A controller by name: how it is made for a plant, and which of its gains are varied and tuned within which bounds."""

    make: Callable[[System], AbstractController]  # of the system that the controller is to assume
    main_gain: str  # the gain that a sweep varies
    reads: str  # what it reads of the plant: ANGLE or STATE
    box: Box  # the gains that are tuned
    plant: Callable[[System], System] = _same  # the plant that its section is written for
    # One that switches -> one with a derivative, of a width that goes to nothing.
    smoothed: Callable[[AbstractController, Scalar], AbstractController] | None = None
