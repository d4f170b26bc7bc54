"""One run as machine code is the run that XLA compiles, for every load, law and effect."""

from __future__ import annotations

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import get_parameters, parameters, set_parameters, set_vector
from smajax.engine import Engine, facade, program
from smajax.engine.traced import Traced
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.laws import LAWS, under_law
from smajax.simulation.batch.axes import grid
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import simulate
from tests.helpers.often import often

pytestmark = pytest.mark.usefixtures("optimised")  # machine code as users have it
SAMPLES, DT = 241, 0.025
RIGS = {
    "arm": (build("niti_table_3_1", "arm", "amplified_voltage"), "voltage", 8.0),
    "dead_weight": (build("flexinol_table_3_2", "dead_weight", "voltage"), "voltage", 12.0),
    "bias_spring": (build("flexinol_ht_500um", "bias_spring", "duty"), "duty", 0.3),
}


def _inputs(channel: str, top: float) -> dict[str, jax.Array]:
    """On, off and on again, so that it turns around on the way."""
    return {channel: jnp.where((jnp.arange(SAMPLES) // 80) % 2 == 0, top, 0.0)}


def _same(system: System, inputs: dict[str, jax.Array]) -> None:
    ours, theirs = simulate_compiled(system, inputs, DT), eqx.filter_jit(simulate)(system, inputs, DT)
    assert float(np.ptp(theirs.martensite_fraction)) > 0.2
    for name in (
        "time",
        "temperature",
        "stress",
        "strain",
        "martensite_fraction",
        "xi_M",
        "xi_A",
        "position",
        "reading",
    ):
        one, other = np.asarray(getattr(ours, name)), np.asarray(getattr(theirs, name))
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9 * float(np.abs(other).max()), err_msg=name)


@pytest.mark.slow  # the enhanced law's arm is in `test_engine`
@pytest.mark.parametrize("law", LAWS)
def test_every_law_equals_xla(law):
    system, channel, top = RIGS["arm"]
    _same(dataclasses.replace(system, wire=under_law(system.wire, law)), _inputs(channel, top))


# Each effect once, on the rig on which it acts, and few at a time: XLA takes the square of what it compiles.
OF_PULSES, OF_A_WEIGHT = {"pwm_smoothing", "pulsed_voltage"}, {"wrong_load", "load_shift"}
OF_KINETICS = sorted(name for name, effect in LIBRARY.items() if effect.candidate.equation == "kinetics")
ON_A_WEIGHT = (
    OF_A_WEIGHT
    | {name for name, effect in LIBRARY.items() if effect.candidate.equation in ("input", "electrical", "sensor")}
    - OF_PULSES
)
ON_A_SPRING = set(LIBRARY) - ON_A_WEIGHT - {*OF_KINETICS}
OF_MOTION = {name for name in ON_A_SPRING if LIBRARY[name].candidate.equation in ("constitutive", "mechanics")}
EFFECTS = {
    "with a memory": (
        "dead_weight",
        {"supply_memory", "lagging_transformation", "sensor_backlash"},
    ),
    "circuit, input and sensor": ("dead_weight", ON_A_WEIGHT),
    "kinetics, one half": ("dead_weight", {*OF_KINETICS[::2]}),
    "kinetics, the other": ("dead_weight", {*OF_KINETICS[1::2]}),
    "heat": ("bias_spring", ON_A_SPRING - OF_MOTION),
    "stress and motion": ("bias_spring", OF_MOTION),
}


@pytest.mark.parametrize(
    ("rig", "names"),
    [
        *(
            pytest.param(*part, id=name, marks=() if name == "with a memory" else pytest.mark.slow)
            for name, part in EFFECTS.items()
        ),
        pytest.param("dead_weight", set(LIBRARY), id="dead_weight, all", marks=pytest.mark.slow),
        pytest.param("bias_spring", set(LIBRARY), id="bias_spring, all", marks=pytest.mark.slow),
    ],
)
def test_every_effect_equals_xla(rig, names):
    """Many effects of the library at once, each a little on."""
    system, channel, top = RIGS[rig]
    full = extended(system, tuple(name for name in LIBRARY if name in names))
    table = parameters(full)
    coefficients = [name for name in table if "." in name]
    values = get_parameters(full, coefficients)
    on = {name: 0.99 * float(value) + 0.01 * table[name].high for name, value in zip(coefficients, values, strict=True)}
    _same(set_parameters(full, on), _inputs(channel, top))


def test_derivatives_along_any_direction_agree_with_differences():
    """Forward mode through the whole run, by machine code: every parameter of the arm at once."""
    system, channel, top = RIGS["arm"]
    names = tuple(parameters(system))
    inputs = _inputs(channel, top)
    at = np.asarray(get_parameters(system, names))
    towards = at * np.random.default_rng(0).uniform(-1.0, 1.0, len(at))

    def along(model, own):
        def reading(share):
            there = jnp.asarray(at) + share * jnp.asarray(towards)
            return simulate(set_vector(model, names, there), inputs, DT).reading

        return jax.jvp(reading, (own["share"],), (jnp.ones_like(own["share"]),))

    run = program(along, system, ("share",), engine="native")
    step = 1e-6
    values, slopes = run(system, {"share": np.array([-step, 0.0, step])}, 1)
    difference = (values[2] - values[0]) / (2.0 * step)
    # Where a sample lies within a difference's reach of a kink, one of the two is on the other side.
    close = np.abs(difference - slopes[1]) < 2e-4 * np.abs(difference).max()
    assert close.mean() > 0.98


def test_error_controlled_and_fixed_steps_are_programs_of_their_own():
    system, channel, _ = RIGS["arm"]
    few, many = np.full(31, 7.0), np.full(301, 7.0)
    own = simulate_compiled(system, {channel: jnp.asarray(few)}, 0.1, 1e-4)
    fixed = simulate_compiled(system, {channel: jnp.asarray(many)}, 0.01)
    assert 0.0 < np.abs(own.position - fixed.position[::10]).max() < np.radians(0.2)
    with pytest.raises(ValueError, match="1e-4"):
        simulate_compiled(system, {channel: jnp.asarray(few)}, 0.1, 0.0)
    with pytest.raises(ValueError, match="voltage"):
        simulate_compiled(system, {}, 0.1)


COUPON = build("flexinol_table_3_2", "coupon", "none")


def _warmed(samples: int, top: float) -> dict[str, jax.Array]:
    return {"temperature": jnp.linspace(20.0, top, samples), "stress": jnp.full(samples, 1e8)}


@pytest.fixture
def traces(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """One entry for each function that is traced, in a process that has no programs yet."""
    traces: list[object] = []

    class Counted(Traced):
        def __init__(self, *arguments: Any) -> None:
            traces.append(arguments)
            super().__init__(*arguments)

    monkeypatch.setattr(facade, "Traced", Counted)
    monkeypatch.setattr(facade, "_programs", {})
    return traces


@pytest.mark.parametrize("engine", often(["auto", "native"], ["auto"]))
def test_a_program_is_traced_once_for_runs_of_one_kind(engine: Engine, traces: list[object]) -> None:
    """Other values trace nothing; another length of the series, or another effect, traces once more."""
    for top, start in ((100.0, 68.0), (120.0, 68.0), (120.0, 60.0)):
        other = set_parameters(COUPON, {"austenite_start": start})
        simulate_compiled(other, _warmed(20, top), 0.01, engine=engine)
    assert len(traces) == 1
    simulate_compiled(COUPON, _warmed(21, 120.0), 0.01, engine=engine)
    assert len(traces) == 2
    simulate_compiled(extended(COUPON, ("minor_loops",)), _warmed(21, 120.0), 0.01, engine=engine)
    assert len(traces) == 3


def test_batches_of_every_size_share_a_trace(traces: list[object]) -> None:
    """A sweep of three runs, of seventy and in chunks: one program, and one more of what the first is checked against."""
    for count in (3, 70):
        axes = grid(austenite_start=np.linspace(60.0, 68.0, count))
        batch = run_batch(COUPON, _warmed(20, 120.0), axes, keep=("strain",))
        assert batch.sizes["austenite_start"] == count
    assert len(traces) == 2
