"""Step-size check: does what an effect gains depend on the step of the integration?

A load that sticks and jumps may jump a step earlier or later by rounding alone. A fit can choose the coefficients whose
row of jumps happens to fall where the log's does, and gains what no wire does: at half the step the gain is gone.
"""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np

from smajax.attribution.model_fits import Model, Search, Start, base_value
from smajax.fit.integration import (
    LARGEST,
    MARGIN,
    IntegrationError,
    begin_integration_error,
    choose_integration,
    described,
    integration_error,
)
from smajax.fit.outputs_of_runs import misfits, predicted_at
from smajax.fit.packed_runs import RunBatch, halved
from smajax.fit.problem import Problem
from smajax.model.effects.library import LIBRARY
from smajax.model.system import System
from smajax.simulation.steppers import Integration

MUCH_FINER = 30.0  # tolerances: what a jump gains by chance at one is gone at the other


def gain_kept_at_half_step(setting: Search, new: Model, old: Model) -> float:
    """Share of what lets the load jump gains in the squared error of all fit runs that it keeps, unfitted, at half the step.

    The gain is of `new` on `old`, or on `old` with the partner that was added beside it: a partner's gain is not its own.
    1 where nothing that was added can jump.
    """
    jumping = {effect for effect in new.effects if effect not in old.effects and LIBRARY[effect].candidate.stick_slip}
    if not jumping:
        return 1.0
    without = old.cost
    partner = tuple(effect for effect in new.effects if effect not in jumping)
    if partner != old.effects:
        values = np.array(new.values)
        for effect in jumping:
            for name in setting.coefficients(effect):
                values[setting.problem.names.index(name)] = base_value(name)
        _, (left,) = setting.fit([Start(partner, values)], "checking at half the step", width_factors=new.width_factors)
        without = min(without, float(np.sum((left / np.asarray(setting.problem.noise)) ** 2)))
    problem, index = setting.restricted(new.effects)
    fine = problem.with_system(problem.system, _finer(problem.batch), problem.per_run)
    misfit = problem.centred(problem.measured - predicted_at(fine, [new.values[index]])[0][:, ::2])
    cost = float(np.sum((np.asarray(misfit) / np.asarray(problem.noise)) ** 2))
    return (without - cost) / (without - new.cost) if without > new.cost else 0.0


def _finer(batch: RunBatch) -> RunBatch:
    """At half the step; error-controlled steps, which half a step alone changes little, at a far smaller tolerance too."""
    fine, tolerance = halved(batch), batch.integration.tolerance
    if tolerance is None:
        return fine
    return dataclasses.replace(
        fine, integration=dataclasses.replace(fine.integration, tolerance=tolerance / MUCH_FINER)
    )


def _at(problem: Problem, values: np.ndarray) -> tuple[System, np.ndarray]:
    """(the model, each run's own values) at parameters (P,)."""
    here = jnp.asarray(values)
    return problem.system_at(here), np.asarray(problem.per_run_at(here))


def _left(problem: Problem, values: np.ndarray) -> float:
    """Root mean square that a model with `values` (P,) leaves, in noises, on the run and output of which it leaves least; 1 where that is less."""
    (misfit,), mask = misfits(problem, [values]), np.asarray(problem.batch.mask) > 0.0
    rms = np.sqrt((np.asarray(misfit) ** 2).sum(axis=1) / np.maximum(mask.sum(axis=1), 1))[mask.any(axis=1)]
    return max(1.0, float((rms / np.asarray(problem.noise)[mask.any(axis=1), 0]).min()))


def integration_error_of(setting: Search, final: Model) -> IntegrationError:
    """What the integration leaves in the output of the final model on the fit runs; small is a tenth of what the model leaves itself."""
    problem, index = setting.restricted(final.effects)
    values = final.values[np.asarray(index)]
    found = integration_error(problem, *_at(problem, values))
    return dataclasses.replace(found, limit=LARGEST * _left(problem, values))


def begin_finer_integration(setting: Search, effects: tuple[str, ...], values: np.ndarray) -> None:
    """Have a second process, where there is one, make the programs with which `finer_integration` looks at a model."""
    problem, index = setting.restricted(effects)
    begin_integration_error(problem, _at(problem, values[np.asarray(index)])[0])


def finer_integration(
    setting: Search, effects: tuple[str, ...], values: np.ndarray, beside_what_is_left: bool = False
) -> Integration | None:
    """The integration that a model with these values (P,) asks for, where the present one leaves more than a tenth of the noise on the fit runs.

    None where it does not, or where none leaves less. `beside_what_is_left`: a tenth of what the model itself leaves in every run and output, where that is more than the noise.
    """
    problem, index = setting.restricted(effects)
    own = values[np.asarray(index)]
    here, level = _at(problem, own), _left(problem, own) if beside_what_is_left else 1.0
    if integration_error(problem, *here).share <= LARGEST * level:
        return None
    finer = choose_integration(problem, *here, MARGIN * LARGEST * level)
    return None if described(finer) == described(problem.batch.integration) else finer
