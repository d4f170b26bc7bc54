"""A sensor's lag over steps as long as itself: against the filter's own solution of what other code integrates."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from smajax.fit.integration import choose_integration, with_integration
from smajax.fit.packed_runs import predict_compiled
from smajax.model.extended import extended
from studies import integration as study

LAG = 0.05  # s
FINE = 0.001  # s


def _filtered(series: np.ndarray) -> np.ndarray:
    """The solution of tau y' + y = x for an x that is a straight line between samples `FINE` apart, y = x at the start."""
    left = np.exp(-FINE / LAG)
    late = np.empty_like(series)
    late[0] = series[0]
    for k in range(1, len(series)):
        behind = LAG * (series[k] - series[k - 1]) / FINE
        late[k] = series[k] - behind + (late[k - 1] - series[k - 1] + behind) * left
    return late


# By the backward Euler rule 0.66 noises were left of the coupon.
@pytest.mark.slow  # most of it scipy's; derivatives are in `test_every_effect`
@pytest.mark.parametrize("rig", ["coupon", "dead weight"])
def test_a_log_of_100_ms_has_the_lag_of_the_sensor(rig: str) -> None:
    plain = study.RIGS[rig]()
    system = extended(plain.system, ("sensor_lag",), {"sensor_lag.time_constant": LAG})
    problem = study._problem(dataclasses.replace(plain, system=system), 0.1)
    problem = with_integration(problem, choose_integration(problem, system))
    times = np.arange(round(study.SECONDS / FINE) + 1) * FINE
    exact = _filtered(np.asarray(plain.exact(times), dtype=np.float64))[:: round(0.1 / FINE)]
    found = predict_compiled(system, problem.batch)[0]
    error = found - found[0] - (exact - exact[0])
    assert np.sqrt(np.mean(error**2)) < 0.1 * plain.noise
