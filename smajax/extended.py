"""From an experiment to its base model, and from a list of effects to the model extended by them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from smajax.effects.library import at_base
from smajax.experiment.record import RUN_STARTS, Experiment
from smajax.parameters import set_parameters
from smajax.presets import build
from smajax.system import System


def base_model(experiment: Experiment) -> System:
    """The preset with the experiment's known values and the starts of its unknowns.

    It has the effects of which the experiment names a parameter (`latent_heat.enthalpy`), and no others.
    """
    system = extended(
        build(experiment.wire, experiment.load, experiment.drive, experiment.law), experiment.declared_effects
    )
    starts = {unknown.name: unknown.start for unknown in experiment.unknowns if unknown.name not in RUN_STARTS}
    return set_parameters(system, {**experiment.parameters, **starts})


def extended(system: System, effects: Sequence[str], coefficients: Mapping[str, float] | None = None) -> System:
    """`system` with the named effects in its equations, at base value or with `coefficients` (`latent_heat.enthalpy`).

    At base value the simulated trajectory is that of `system`.
    """
    return set_parameters(dataclasses.replace(system, effects=at_base(effects)), dict(coefficients or {}))
