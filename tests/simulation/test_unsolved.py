"""A stage whose solver does not converge is counted, by both engines, and marks its run in a batch."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import smajax as sma
from smajax.simulation.observers import GOOD, UNSOLVED
from smajax.simulation.simulate import UnsolvedWarning
from tests.helpers.machine_code import by_machine_code

ARM = sma.build("niti_table_3_1", "arm", "amplified_voltage")
LONG = 0.5  # s, in which the arm snaps through and transforms
ON_AND_OFF = {"voltage": jnp.where((jnp.arange(120) >= 20) & (jnp.arange(120) < 80), 8.0, 0.0)}


def test_stages_that_do_not_converge_are_counted_by_both_engines() -> None:
    with pytest.warns(UnsolvedWarning, match=r"of 119 steps did not converge, the first of them before \d+(\.5)? s"):
        ours = sma.simulate_compiled(ARM, ON_AND_OFF, LONG)
    with pytest.warns(UnsolvedWarning, match="Take a shorter `dt`"):
        sma.simulate(ARM, ON_AND_OFF, LONG)
    theirs = jax.jit(sma.simulate)(ARM, ON_AND_OFF, LONG)  # traced: without a warning
    assert ours.unsolved[0] == 0.0
    assert ours.unsolved[-1] > 0.0
    assert (np.diff(ours.unsolved) >= 0.0).all()
    np.testing.assert_array_equal(ours.unsolved, theirs.unsolved)
    found = sma.simulate_dataset(ARM, ON_AND_OFF, LONG, None)
    assert found.attrs["unsolved_stages"] == str(int(ours.unsolved[-1]))


def test_every_stage_of_a_shorter_or_an_error_controlled_step_converges() -> None:
    run = sma.simulate_compiled(ARM, {"voltage": jnp.repeat(ON_AND_OFF["voltage"], 5)}, LONG / 5)
    assert (run.unsolved == 0.0).all()
    assert sma.simulate_dataset(ARM, ON_AND_OFF, LONG).attrs["unsolved_stages"] == "0"


def test_a_run_of_a_batch_with_such_a_stage_is_marked_from_there_on() -> None:
    axes = sma.zipped(amplifier_gain=[0.1, float(sma.parameter_values(ARM)["amplifier_gain"])])
    found = sma.run_batch(ARM, ON_AND_OFF, axes, dt=LONG, tolerance=None)
    assert found["status"].values.tolist() == [GOOD, UNSOLVED]
    with pytest.warns(UnsolvedWarning):
        run = sma.simulate_compiled(ARM, ON_AND_OFF, LONG)
    assert found["first_bad_time"].values.tolist() == [np.inf, run.time[np.argmax(run.unsolved > 0.0)]]
    assert np.isnan(sma.good(found)["position"].values[1]).all()


def test_the_count_has_no_derivative() -> None:
    def last(gain: jax.Array) -> jax.Array:
        run = sma.simulate(sma.set_parameters(ARM, {"amplifier_gain": gain}), ON_AND_OFF, LONG)
        return jnp.stack([run.unsolved[-1], run.temperature[-1]])

    gain = jnp.asarray(sma.parameter_values(ARM)["amplifier_gain"])
    count, slope = by_machine_code(lambda at: jax.jvp(last, (at,), (jnp.ones_like(at),)))(gain)
    assert count[0] > 0.0
    assert slope[0] == 0.0
    assert jnp.isfinite(slope[1])
