"""How finely the runs of a fit are integrated: as coarsely as the noise of their outputs allows.

The step of an experiment file is the clock of its logs. What an integration between two of its samples leaves in the outputs is
measured, at the values a fit starts from and again at those it ends at, against an integration that is far finer.
"""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np

from smajax.fit.outputs_of_runs import predicted_at
from smajax.fit.packed_runs import RunBatch, begin_compiled, predict_compiled
from smajax.fit.problem import Problem
from smajax.model.system import System
from smajax.simulation.integration_error import IntegrationError as IntegrationError
from smajax.simulation.integration_error import coarse_to_fine, finest
from smajax.simulation.integration_error import described as described
from smajax.simulation.steppers import ONE_STEP, Integration

LARGEST = 0.1  # of an output's noise: the error, rms over a run, that integration may leave in it
# Steps that a run of a fit may try, on average, at a tolerance of 1e-4, of a smaller one as many more as steps of order 3 need: so many a
# second, and a sample. The rigs of `studies.integration` take 15 a sample at most, on a clock of 250 ms, and 185 at 1e-8; a load that swings
# without damping some 600 a second. A trial point at which a force grows with speed, so that the load shakes, takes 10,000 a second: half a minute
# of one fit's ten. It has no numbers then, and no fit goes there.
TRIES_A_SECOND, TRIES_A_SAMPLE, AT_TOLERANCE = 2000.0, 100.0, 1e-4
# A model that has one smooth function more may need so many times the tries of the one without, or those of a load that then swings; one that
# shakes needs ten times these.
NEARBY, LEAST_SHARE = 8, 64
SWINGING = 1000.0  # a second, at a tolerance of 1e-4
AS_GOOD = 2.0  # times the least error
MARGIN = 0.5  # of that, at the start: by the end of a fit its values have moved


def with_integration(problem: Problem, integration: Integration) -> Problem:
    """The problem with its runs integrated in that way."""
    return dataclasses.replace(problem, batch=dataclasses.replace(problem.batch, integration=integration))


def _predicted(problem: Problem, system: System, integration: Integration, per_run: np.ndarray) -> np.ndarray:
    batch: RunBatch = dataclasses.replace(problem.batch, integration=integration)
    return predict_compiled(system, batch, problem.per_run.names, per_run)


def _exact(problem: Problem, system: System, per_run: np.ndarray) -> np.ndarray:
    """What integrations are measured against, by the program of a fit."""
    return _predicted(problem, system, _finest(problem, system), per_run)


def _finest(problem: Problem, system: System) -> Integration:
    """As fine as what integrations are measured against."""
    return unlimited(_limited(problem, finest(system)))


def _scale(problem: Problem, mask: np.ndarray) -> np.ndarray:
    """Noise of every series; where it has none a tenth of its stroke, so that a hundredth of the stroke may be left."""
    noise, measured = np.asarray(problem.noise)[:, 0], problem.measured * problem.scale_of_series
    high, low = np.where(mask, measured, -np.inf).max(axis=1), np.where(mask, measured, np.inf).min(axis=1)
    stroke = np.where(mask.any(axis=1), high - low, 0.0)
    return np.where(noise > 0.0, noise, np.maximum(0.1 * stroke, 1e-300))


def _error(problem: Problem, difference: np.ndarray, integration: Integration) -> IntegrationError:
    mask = np.asarray(problem.batch.mask) > 0
    centred = np.where(mask, np.asarray(problem.centred(np.where(mask, difference, 0.0))), 0.0)
    rms = np.sqrt((centred**2).sum(axis=1) / np.maximum(mask.sum(axis=1), 1))
    names = problem.batch.outputs
    share = float((rms / _scale(problem, mask)).max())
    own = problem.scale_of_series
    by_output = {name: float((rms / own[:, 0])[k :: len(names)].max()) for k, name in enumerate(names)}
    largest = {name: float(np.abs(centred / own)[k :: len(names)].max()) for k, name in enumerate(names)}
    # A state that is not finite is as wrong as can be.
    share = share if np.isfinite(share) else np.inf
    return IntegrationError(by_output, largest, share, described(integration), limit=LARGEST)


def integration_error(problem: Problem, system: System, per_run: np.ndarray | None = None) -> IntegrationError:
    """What the integration of `problem` leaves in the outputs of `system`, with each run's own values `per_run`."""
    own = np.asarray(problem.per_run.start if per_run is None else per_run)
    chosen = problem.batch.integration
    exact = _exact(problem, system, own)
    return _error(problem, _predicted(problem, system, chosen, own) - exact, chosen)


def begin_integration_error(problem: Problem, system: System) -> None:
    """Have a second process, where there is one, make the programs of `integration_error` of this problem."""
    for integration in (_finest(problem, system), problem.batch.integration):
        batch = dataclasses.replace(problem.batch, integration=integration)
        begin_compiled(system, batch, problem.per_run.names, np.asarray(problem.per_run.start))


def _of_tries(integration: Integration, most: np.ndarray) -> Integration:
    return dataclasses.replace(integration, most_tries=jnp.asarray(most, dtype=float))


def _limited(problem: Problem, integration: Integration) -> Integration:
    """With the tries of a fit, where there is a tolerance."""
    tolerance = integration.tolerance
    if tolerance is None:
        return integration
    dt = float(np.asarray(problem.batch.dt))
    most = max(TRIES_A_SAMPLE, TRIES_A_SECOND * dt) * np.maximum(1.0, AT_TOLERANCE / np.asarray(tolerance)) ** (
        1.0 / 3.0
    )
    return _of_tries(integration, most)


def unlimited(integration: Integration) -> Integration:
    """The same for a run that is no trial point of a fit: as many tries as it takes, by the same program."""
    if integration.most_tries is None:
        return integration
    return _of_tries(integration, np.full(np.shape(integration.most_tries), np.inf))


def limited_near(problem: Problem, values: np.ndarray) -> Integration:
    """The problem's integration with `NEARBY` times the tries that its runs need at `values` (P,), and those of a load that swings, where that is less than it has.

    The need is known to a factor of two, and not below `1 / LEAST_SHARE` of what it has.
    """
    integration, share = problem.batch.integration, LEAST_SHARE
    if integration.most_tries is None or integration.tolerance is None:
        return integration
    most, tolerance = np.asarray(integration.most_tries), np.asarray(integration.tolerance)
    swinging = SWINGING * float(np.asarray(problem.batch.dt)) * (AT_TOLERANCE / tolerance) ** (1.0 / 3.0)
    while share > NEARBY:
        needed = _of_tries(integration, most / share)
        if np.isfinite(predicted_at(with_integration(problem, needed), [values])).all():
            return _of_tries(integration, np.minimum(np.maximum(NEARBY * most / share, swinging), most))
        share //= 2
    return integration


def choose_integration(
    problem: Problem, system: System, per_run: np.ndarray | None = None, largest: float = MARGIN * LARGEST
) -> Integration:
    """The cheapest integration that leaves at most `largest` of the noise in every output, at the values of `system`.

    `per_run`: each run's own values, by default those they start from. Where none leaves so little, the cheapest that leaves it without the `MARGIN`, or at most `AS_GOOD` times
    the least error: where friction lets a load jump, or a reading's scatter turns a wire round, no step length settles at which sample it does.
    """
    own = np.asarray(problem.per_run.start if per_run is None else per_run)
    exact = _exact(problem, system, own)
    tried: list[tuple[Integration, float]] = []
    for choice in (_limited(problem, one) for one in coarse_to_fine(system)):
        error = _error(problem, _predicted(problem, system, choice, own) - exact, choice).share
        tried.append((choice, error))
        if error <= largest:
            return choice
    least, most, present = min(error for _, error in tried), largest / MARGIN, described(problem.batch.integration)
    # A finer one was asked for: none that leaves more than the present one.
    now = next((error for choice, error in tried if described(choice) == present), np.inf)
    enough = most if least <= most else max(least, min(AS_GOOD * least, now))
    return next((choice for choice, error in tried if error <= enough), ONE_STEP)
