"""What the source promises of any wire, any drive, any load: checked on random ones."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smajax.core.parameters import get_parameters, parameters, set_parameters
from smajax.model.effects.library import LIBRARY, at_base
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.wire.constitutive import young_modulus
from smajax.model.wire.kinetics import martensite_left
from smajax.model.wire.kinetics_terms import NO_TERMS
from smajax.model.wire.order import ORDER
from smajax.simulation.compiled import simulate_compiled

RIGS = {
    "arm": (build("niti_table_3_1", "arm", "amplified_voltage"), "voltage", 9.0),
    "dead_weight": (build("flexinol_table_3_2", "dead_weight", "voltage"), "voltage", 12.0),
    "bias_spring": (build("flexinol_ht_500um", "bias_spring", "duty"), "duty", 0.3),
}
SAMPLES = 400
DT = 0.02


def _inputs(channel: str, top: float, levels: list[float]) -> dict[str, jax.Array]:
    steps = jnp.repeat(jnp.asarray(levels), SAMPLES // len(levels))
    return {channel: top * jnp.pad(steps, (0, SAMPLES - len(steps)), mode="edge")}


def _spread(system: eqx.Module, shares: list[float]) -> eqx.Module:
    """Every parameter moved by up to half of itself, within its declared bounds; those in the wrong order, which no run takes, exchanged."""
    table = parameters(system)
    names = list(table)
    moved = {}
    for index, name in enumerate(names):
        value = float(get_parameters(system, [name])[0])
        share = shares[index % len(shares)]
        moved[name] = float(np.clip(value * (0.5 + share), table[name].low, table[name].high))
    for lower, higher, _ in ORDER:
        if lower in moved and higher in moved:
            low, high = sorted((moved[lower], moved[higher]))
            moved[lower], moved[higher] = min(low, high - 1e-3), high
    return set_parameters(system, moved)


# The invariants hold in a step that does not converge as well, which a few of random runs have.
EVERY_STEP = pytest.mark.filterwarnings("ignore:.*did not converge:smajax.simulation.simulate.UnsolvedWarning")


@EVERY_STEP
@settings(max_examples=40, deadline=None)
@given(
    rig=st.sampled_from(sorted(RIGS)),
    levels=st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4),
    shares=st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7),
)
def test_fraction_stays_in_range_and_stress_is_never_negative(
    rig: str, levels: list[float], shares: list[float]
) -> None:
    system, channel, top = RIGS[rig]
    run = simulate_compiled(_spread(system, shares), _inputs(channel, top, levels), DT)
    for name in ("temperature", "stress", "strain", "martensite_fraction", "position", "velocity", "reading"):
        assert np.isfinite(getattr(run, name)).all(), f"{name} is not finite"
    assert run.martensite_fraction.min() >= 0.0
    assert run.martensite_fraction.max() <= 1.0
    assert run.stress.min() >= 0.0


# One of each equation, and those that change the fraction itself.
SOME = (
    "latent_heat",
    "temperature_resistance",
    "input_level",
    "coulomb_friction",
    "thermal_expansion",
    "minor_loops",
    "lagging_transformation",
    "stress_dependent_width",
    "two_part_transformation",
    "transformation_curve",
)


@EVERY_STEP
@pytest.mark.parametrize("library", [SOME, pytest.param(tuple(LIBRARY), marks=pytest.mark.slow)], ids=["some", "all"])
@settings(max_examples=15, deadline=None)
@given(
    levels=st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4),
    shares=st.lists(st.floats(0.05, 0.95), min_size=5, max_size=5),
    data=st.data(),
)
def test_fraction_stays_in_range_with_several_effects_on(
    library: tuple[str, ...], levels: list[float], shares: list[float], data: st.DataObject
) -> None:
    """As many as a search adds; with all of the library at once a step may end in no number (docs/robustness.md)."""
    effects = data.draw(st.lists(st.sampled_from(sorted(library)), min_size=1, max_size=4, unique=True))
    system, channel, top = RIGS["dead_weight"]
    full = extended(system, library)
    names = [name for name in parameters(full) if name.split(".")[0] in effects]
    table = parameters(full)
    # A tenth of each coefficient's box: the whole of it lets expansion alone outrun the recoverable strain.
    on = {
        name: float(
            np.clip(
                0.1 * (table[name].low + shares[k % 5] * (table[name].high - table[name].low)),
                table[name].low,
                table[name].high,
            )
        )
        for k, name in enumerate(names)
    }
    run = simulate_compiled(set_parameters(full, on), _inputs(channel, top, levels), DT)
    assert np.isfinite(run.position).all()
    assert np.isfinite(run.temperature).all()
    assert 0.0 <= float(run.martensite_fraction.min()) <= float(run.martensite_fraction.max()) <= 1.0


@pytest.mark.slow  # one by one in `test_every_effect`
def test_the_library_at_its_base_value_is_the_base_model() -> None:
    """All of it together."""
    for rig, (system, channel, top) in RIGS.items():
        inputs = _inputs(channel, top, [0.8, 0.2, 1.0, 0.0])
        plain, same = (simulate_compiled(one, inputs, DT) for one in (system, extended(system, tuple(LIBRARY))))
        for which in ("temperature", "martensite_fraction", "stress", "reading"):
            np.testing.assert_allclose(
                getattr(same, which), getattr(plain, which), rtol=1e-10, atol=1e-10, err_msg=f"{rig}, {which}"
            )


def test_stored_states_satisfy_the_rate_form_without_drift() -> None:
    """Eq. 3.2 summed over the stored stage ends gives back the stored stress (taut wire), over many cycles."""
    system, channel, top = RIGS["dead_weight"]
    cycle = jnp.concatenate([jnp.full(150, 0.7), jnp.full(150, 0.0)])
    run = simulate_compiled(system, {channel: top * jnp.tile(cycle, 40)}, DT)
    wire = system.wire
    # The wire carries the weight and the guide's damping, whatever happened in the cycles before.
    resting = np.arange(299, 300 * 40, 300)
    expected = (0.075 * 9.81 + 20.0 * run.velocity[resting]) / (0.25 * np.pi * 150e-6**2)
    np.testing.assert_allclose(run.stress[resting], expected, rtol=1e-6)
    # Taut, the wire's own strain is the geometric one: nothing was lost to a clipped fraction. Slack, it is longer.
    geometric = -run.position / wire.wire_length
    taut = np.asarray(run.stress > 0.0)
    assert 0.8 < taut.mean() < 1.0
    np.testing.assert_allclose(run.strain[taut], geometric[taut], rtol=0.0, atol=1e-11)
    assert np.all(run.strain[~taut] >= geometric[~taut] - 1e-11)


def test_one_step_satisfies_the_constitutive_increment() -> None:
    system = build("flexinol_table_3_2", "coupon", "none")
    temperature = jnp.concatenate([jnp.linspace(23.0, 120.0, 200), jnp.linspace(120.0, 23.0, 200)])
    stress = 1e6 * (60.0 + 40.0 * jnp.sin(jnp.linspace(0.0, 9.0, 400)))
    run = simulate_compiled(system, {"temperature": temperature, "stress": stress}, 1.0)
    wire = system.wire
    xi, law = run.martensite_fraction, system.wire.constitutive
    modulus = young_modulus(wire, 0.5 * (xi[1:] + xi[:-1]))
    increment = modulus * (
        jnp.diff(run.strain) - law.recoverable_strain * jnp.diff(xi)
    ) + law.thermal_modulus * jnp.diff(run.temperature)
    np.testing.assert_allclose(jnp.cumsum(increment), run.stress[1:] - run.stress[0], rtol=1e-8, atol=1.0)


def test_an_unknown_effect_has_no_base_value() -> None:
    with pytest.raises(KeyError, match="latent_heat"):
        at_base(("latent_heet",))


def test_float32_follows_float64() -> None:
    """The same run in single precision: same branches, and a fraction within 1e-3."""
    system, channel, top = RIGS["dead_weight"]
    inputs = _inputs(channel, top, [0.75, 0.2, 0.7, 0.0])
    double = simulate_compiled(system, inputs, DT)
    with jax.enable_x64(False):
        narrow = jax.tree.map(lambda leaf: leaf.astype(jnp.float32) if eqx.is_array(leaf) else leaf, (system, inputs))
        single = simulate_compiled(narrow[0], narrow[1], DT)
    assert single.position.dtype == jnp.float32
    assert float(np.abs(np.asarray(single.martensite_fraction) - np.asarray(double.martensite_fraction)).max()) < 1e-3
    assert double.martensite_fraction.min() < 0.2


def test_at_an_end_stop_the_fraction_is_that_of_the_stressed_wire() -> None:
    """Held by the stop the wire is tighter, which keeps it from transforming: xi = h(T - sigma/C_A) still holds."""
    system = set_parameters(RIGS["arm"][0], {"upper_stop": 0.5})
    run = simulate_compiled(system, {"voltage": jnp.full(800, 7.3)}, 0.01)
    stopped = np.asarray(run.position) >= 0.5
    assert stopped.sum() > 100
    assert np.abs(run.velocity[stopped]).max() == 0.0
    law = system.wire.kinetics
    on_curve = martensite_left(law, NO_TERMS, run.temperature, run.stress)
    heating = stopped & (np.gradient(np.asarray(run.temperature)) > 1e-3)
    assert heating.sum() > 50
    np.testing.assert_allclose(run.martensite_fraction[heating], on_curve[heating], atol=1e-9)
