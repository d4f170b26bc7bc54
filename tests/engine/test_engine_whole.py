"""Machine code beside XLA on whole models: every effect, steps of their own, every controller in its loop."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.presets import CONTROLLERS
from smajax.control.tune import evaluate
from smajax.control.tune.evaluate import STEP, TuningProblem
from smajax.control.tune.scenarios import tuned_on
from smajax.core.parameters import get_parameters, parameters, set_parameters
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.rigs import arm
from smajax.simulation.batch.axes import sampled
from smajax.simulation.batch.chunks import chunks
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.step import ORDER_TWO
from tests.helpers.engine_results import same_batch
from tests.model.test_every_effect import RIGS, _rig

pytestmark = pytest.mark.slow
SCENARIOS, SAMPLES, DT = 37, 120, 0.05  # members fill no vector and no group of vectors
KEEP = ("reading", "temperature", "martensite_fraction", "stress")


def both(rig: str, effects: tuple[str, ...], tolerance: float | None) -> tuple[Any, Any]:
    """The same batch by machine code and by XLA."""
    system, channel, top = RIGS[rig]
    full = extended(system, effects)
    table = parameters(full)
    starts = {
        f"{name}.{key}": value for name in effects for key, value in LIBRARY[name].candidate.initial_guess.items()
    }
    full = set_parameters(full, {name: value for name, value in starts.items() if name in table})
    command = top * np.concatenate([np.ones(SAMPLES // 2), np.full(SAMPLES // 4, 0.6), np.zeros(SAMPLES // 4)])
    middle = float(get_parameters(full, ["convection_coefficient"])[0])
    axes = sampled(SCENARIOS, convection_coefficient=(0.7 * middle, 1.3 * middle), seed=3)
    inputs = {channel: jnp.asarray(command)}
    return (
        run_batch(full, inputs, axes, dt=DT, keep=KEEP, tolerance=tolerance, engine="native"),
        run_batch(full, inputs, axes, dt=DT, keep=KEEP, tolerance=tolerance, engine="xla"),
    )


HERE = [
    name for name in sorted(LIBRARY) if any(LIBRARY[name].candidate.applies(system) for system, *_ in RIGS.values())
]


@pytest.mark.parametrize("effect", HERE)
def test_a_batch_with_each_effect_equals_xla(effect: str) -> None:
    ours, theirs = both(_rig(effect), (effect,), None)
    # Where a wire goes slack Newton's method ends on the other side of a kink, within its tolerance: there roundings decide.
    slack = (np.asarray(theirs["stress"]) <= 0.0).any(axis=1) & (theirs["stress"].max() > 0.0).item()
    assert not slack.all()
    same_batch(ours.isel(sample=~slack), theirs.isel(sample=~slack), 1e-9)
    if slack.any():
        same_batch(ours.isel(sample=slack), theirs.isel(sample=slack), 2.0 * ORDER_TWO.enough)


@pytest.mark.parametrize("rig", sorted(RIGS))
def test_error_controlled_steps_equal_xla(rig: str) -> None:
    same_batch(*both(rig, (), 1e-4), 1e-6)


@pytest.mark.parametrize("controller", sorted(CONTROLLERS))
def test_the_loop_of_every_controller_equals_xla(controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    members = tuned_on([0.0, 30.0], {"damping": 0.2, "convection": 0.1}, 0)
    rig = TuningProblem(CONTROLLERS[controller], arm(), seconds=2.0, loops=16)
    points = rig.before + np.asarray([[0.0], [-0.02], [0.03]])
    ours = rig.evaluate(np.clip(points, 0.0, 1.0), members, STEP)

    def by_xla(function: Any, model: Any, axes: Any, size: int, wanted: Any, engine: Any) -> Any:
        return chunks(function, model, axes, size, wanted, engine="xla")

    monkeypatch.setattr(evaluate, "chunks", by_xla)
    theirs = rig.evaluate(np.clip(points, 0.0, 1.0), members, STEP)
    scale = np.abs(theirs.exact).max(axis=(0, 1)) + 1e-3
    # A loop that switches multiplies roundings: most agree to the last digits, and none is another loop.
    off = np.abs(ours.exact - theirs.exact) / scale
    assert np.median(off) < 1e-9
    assert off.max() < 1e-2
