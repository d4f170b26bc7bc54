"""What holds of every run within the declared bounds: no numbers that are none, heat that adds up, one result a seed."""

from __future__ import annotations

import dataclasses
import itertools
from importlib import resources
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from smajax.attribution.close_loop import close_loop
from smajax.attribution.findings import pooled_rmse
from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.measured_state import Sensor
from smajax.control.presets import CONTROLLERS, model_filter
from smajax.control.reference import clock, constant
from smajax.core.parameters import parameter_values, parameters, set_parameters
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System, heating_power, initial_state
from smajax.model.wire.heat import HeatState, heat_rate, mass_per_metre, stored_heat
from smajax.model.wire.order import ORDER
from smajax.model.wire.resistance import resistance_per_metre
from smajax.report.narrative import narrate
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.measures import Largest, Smallest
from smajax.simulation.observers import COLDEST, GOOD, HOTTEST, NOT_FINITE, RUNAWAY
from smajax.simulation.simulate import simulate
from tests.helpers.machine_code import by_machine_code
from tests.helpers.often import often
from tests.helpers.whole_box import whole_box

RIGS = {
    "arm": (build("niti_table_3_1", "arm", "amplified_voltage"), "voltage", 9.0),
    "dead_weight": (build("flexinol_table_3_2", "dead_weight", "voltage"), "voltage", 12.0),
    "bias_spring": (build("flexinol_ht_500um", "bias_spring", "duty"), "duty", 0.3),
}
FAST, SLOW = 1024, 40_000  # members of each rig
RUN = simulate_compiled


@pytest.mark.filterwarnings("ignore:The balance properties of Sobol:UserWarning")
@pytest.mark.parametrize("count", [FAST, pytest.param(SLOW, marks=pytest.mark.slow)])
@pytest.mark.parametrize("rig", RIGS)
def test_every_point_of_the_declared_box_gives_finite_numbers(rig: str, count: int) -> None:
    """Nor a fraction outside of 0 to 1, nor a wire that pushes. Wires that melt are told, and melt by the power they get."""
    system, channel, top = RIGS[rig]
    levels = np.zeros(400)
    levels[50:200], levels[250:300] = top, 0.5 * top
    box = whole_box(system, count, 1 if count == FAST else 2)
    measures = [kind(of) for of in ("martensite_fraction", "temperature", "position") for kind in (Smallest, Largest)]
    settings: dict[str, Any] = {"dt": 0.02, "tolerance": None, "keep": (), "measures": (*measures, Smallest("stress"))}
    found = run_batch(system, {channel: jnp.asarray(levels)}, zipped(box), **settings)  # fixed steps, as the limits say
    status = found["status"].values
    assert not (status == NOT_FINITE).any()
    for name in found.data_vars:
        assert np.isfinite(found[name].values).all(), name
    assert found["smallest_martensite_fraction"].values.min() >= 0.0
    assert found["largest_martensite_fraction"].values.max() <= 1.0
    assert found["smallest_stress"].values.min() >= 0.0

    def at_rest(values: dict[str, jax.Array]) -> jax.Array:
        one = set_parameters(system, values)
        rest, ohms = [], []
        for fraction in (0.0, 1.0):
            ohms.append(resistance_per_metre(one.wire, (), jnp.asarray(0.0), jnp.asarray(fraction)))
            power = heating_power(one, ohms[-1], {channel: jnp.asarray(top)})
            rest.append(power / (one.wire.heat.convection_coefficient * jnp.pi * one.wire.wire_diameter))
        return one.wire.heat.ambient_temperature + jnp.maximum(*rest)

    hottest = np.asarray(jax.vmap(at_rest)({name: jnp.asarray(values) for name, values in box.items()}))
    ambient = box["ambient_temperature"]
    coldest, warmest = found["smallest_temperature"].values, found["largest_temperature"].values
    # No temperature beyond the air's and that of rest under the highest input, where a step is no longer than half of the wire's
    # time constant; where it is, the scheme steps over its aim.
    surface = 4.0 * box["convection_coefficient"] / box["wire_diameter"]
    slow = box["density"] * box["specific_heat"] / surface > 2.0 * 0.02
    rounding = 1e-6 * (1.0 + np.abs(ambient)) + 1e-9 * np.abs(warmest)
    # A wire that runs away is one that its highest input would bring there.
    assert np.all(hottest[(status == RUNAWAY) & slow & (coldest > COLDEST)] > HOTTEST)
    well = (status == GOOD) & slow
    assert np.all((ambient - coldest <= rounding)[well])
    assert np.all((warmest - np.maximum(hottest, ambient) <= rounding)[well])
    assert slow.mean() > 0.5
    assert (status == RUNAWAY).any()
    assert (status == GOOD).mean() > 0.5


def _spread(system: System, shares: list[float]) -> System:
    """Every parameter moved by up to half of itself, within its declared bounds."""
    table, values = parameters(system), parameter_values(system)
    moved = {
        name: float(np.clip(values[name] * (0.5 + shares[k % len(shares)]), table[name].low, table[name].high))
        for k, name in enumerate(table)
    }
    for lower, higher, _ in ORDER:
        if lower in moved and not moved[lower] < moved[higher]:
            moved[lower], moved[higher] = values[lower], values[higher]
    return set_parameters(system, moved)


SHARES = st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7)


@pytest.mark.parametrize(
    ("rig", "effects"), often(itertools.product(sorted(RIGS), [False, True]), [("arm", False), ("dead_weight", True)])
)
@settings(max_examples=3, deadline=None)
@given(shares=SHARES, level=st.floats(0.1, 1.0))
def test_the_heat_balance_closes(rig: str, effects: bool, shares: list[float], level: float) -> None:
    """What is stored at the end is what came in less what went out, to 1e-6 of what came in: eq. 3.1 summed over the run."""
    system, channel, top = RIGS[rig]
    system = _spread(system, shares)
    if effects:
        # Latent heat, radiation and a resistance that depends on temperature, each at a value that is felt.
        names = ("latent_heat", "radiation", "temperature_resistance")
        values = {"latent_heat.enthalpy": 2e4, "radiation.emissivity": 0.8, "temperature_resistance.coefficient": 1e-3}
        system = extended(system, names, values)
    heat, wire = system.wire.heat, system.wire
    constant_of_time = float(
        mass_per_metre(wire) * heat.specific_heat / (heat.convection_coefficient * jnp.pi * wire.wire_diameter)
    )
    count, dt = 8000, constant_of_time / 4000.0
    inputs = {channel: top * level * jnp.where(jnp.arange(count + 1) < 0.6 * count, 1.0, 0.3)}
    run, rest = RUN(system, inputs, dt), initial_state(system, {channel: inputs[channel][0]}).wire
    t, temperature, fraction = run.time, run.temperature, run.martensite_fraction
    # One that would melt crosses its range within some steps, and the sum over them is no integral any more.
    assume(float(jnp.max(temperature)) < HOTTEST)

    def flows(
        level: jax.Array, temperature: jax.Array, fraction: jax.Array, time: jax.Array
    ) -> tuple[jax.Array, jax.Array]:
        ohms = resistance_per_metre(wire, system.terms.resistance, temperature, fraction)
        power = heating_power(system, ohms, {channel: level})
        at = HeatState(temperature, heat.ambient_temperature, fraction, time, rest, jnp.asarray(dt))
        return power, heat_rate(wire, system.terms.heat, at, power)

    held = inputs[channel][:-1]
    begin = jax.vmap(flows)(held, temperature[:-1], fraction[:-1], t[:-1])
    end = jax.vmap(flows)(held, temperature[1:], fraction[1:], t[1:])
    came_in, stayed = (
        float(np.sum(0.5 * dt * (np.asarray(a) + np.asarray(b)))) for a, b in zip(begin, end, strict=True)
    )
    stored = jax.vmap(lambda T, xi: stored_heat(wire, system.terms.heat, T, xi))(
        temperature[jnp.array([0, -1])], fraction[jnp.array([0, -1])]
    )
    assert came_in > 0.0
    assert abs(float(stored[1] - stored[0]) - stayed) < 1e-6 * came_in


@settings(max_examples=20, deadline=None)
@given(rig=st.sampled_from(sorted(RIGS)), shares=SHARES)
def test_without_power_nothing_heats_up_and_no_swing_grows(rig: str, shares: list[float]) -> None:
    """A cold wire stays cold, and what swings at its start swings less; a heated one that is switched off cools all the way."""
    system, channel, top = RIGS[rig]
    system = _spread(system, shares)
    ambient = float(system.wire.heat.ambient_temperature)
    still = RUN(system, {channel: jnp.zeros(2001)}, 0.02)
    np.testing.assert_allclose(still.temperature, ambient, rtol=0.0, atol=1e-9)
    early, late = np.asarray(still.velocity)[:1000], np.asarray(still.velocity)[1000:]
    assert np.abs(late).max() <= np.abs(early).max() + 1e-12
    run = RUN(system, {channel: top * jnp.where(jnp.arange(2001) < 400, 1.0, 0.0)}, 0.02)
    cooling = np.asarray(run.temperature)[401:]
    assert np.all(np.diff(cooling) <= 1e-9 * np.abs(cooling[:-1] - ambient) + 1e-12)
    assert cooling.min() >= ambient - 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("rig", RIGS)
def test_float32_follows_float64_nearly_from_any_parameters(rig: str) -> None:
    """To rounding in nine of ten random systems; where a run just meets a branch it may meet it a step apart, in one of fifty at most."""
    base, channel, top = RIGS[rig]
    random = np.random.default_rng(7)
    systems = [_spread(base, list(shares)) for shares in random.random((256, 7))]
    system = jax.tree.map(lambda *leaves: jnp.stack(leaves) if eqx.is_array(leaves[0]) else leaves[0], *systems)
    levels = jnp.asarray(random.random((256, 4)))

    @eqx.filter_jit
    @eqx.filter_vmap
    def run(system: System, levels: jax.Array) -> tuple[jax.Array, jax.Array]:
        found = simulate(system, {channel: top * jnp.repeat(levels, 100)}, 0.02)
        return found.temperature, found.martensite_fraction

    temperature, fraction = (np.asarray(series) for series in run(system, levels))
    with jax.enable_x64(False):
        narrow = jax.tree.map(lambda leaf: leaf.astype(jnp.float32) if eqx.is_array(leaf) else leaf, (system, levels))
        single = run(*narrow)
    assert single[0].dtype == single[1].dtype == jnp.float32
    off = np.abs(np.asarray(single[0]) - temperature).max(axis=1) / (1.0 + np.ptp(temperature, axis=1))
    fraction_off = np.abs(np.asarray(single[1]) - fraction).max(axis=1)
    assert ((off < 5e-4) & (fraction_off < 5e-3)).mean() >= 0.98
    assert np.quantile(off, 0.9) < 1e-5
    assert np.quantile(fraction_off, 0.9) < 5e-5


def test_the_same_seed_gives_the_same_bytes() -> None:
    """Noise, filter and controller at work, in two calls; and another seed does not."""
    arm = RIGS["arm"][0]

    @by_machine_code
    def run(key: jax.Array) -> ClosedLoop:
        return simulate_closed_loop(
            arm,
            CONTROLLERS["pid"].make(arm),
            constant(clock(1.0, 0.01), 0.5),
            dt=0.01,
            estimator=model_filter(arm),
            sensor=Sensor(noise_sigma=1e-2),
            key=key,
        )

    def loop(seed: int) -> bytes:
        return b"".join(np.asarray(leaf).tobytes() for leaf in jax.tree.leaves(run(jax.random.key(seed))))

    assert loop(3) == loop(3)
    assert loop(3) != loop(4)


def _demo(name: str) -> Experiment:
    with resources.as_file(resources.files("smajax") / "data" / "demo" / name) as folder:
        return load_experiment(folder / "experiment.toml", CATALOGUE)


@pytest.mark.slow  # a loop each
@pytest.mark.parametrize(("name", "verdict"), [("complete", "adequate"), ("latent", "explained")])
def test_half_the_step_gives_the_same_verdict(tmp_path: Path, name: str, verdict: str) -> None:
    with resources.as_file(resources.files("smajax") / "data" / "demo" / name) as folder:
        text = (folder / "experiment.toml").read_text()
        assert 'step = "100 ms"' in text
        for one in folder.iterdir():
            if one.is_file():
                (tmp_path / one.name).write_bytes(one.read_bytes())
        (tmp_path / "experiment.toml").write_text(text.replace('step = "100 ms"', 'step = "50 ms"'))
    findings = close_loop(load_experiment(tmp_path / "experiment.toml", CATALOGUE), memory=tmp_path / "fits")
    assert findings.verdict == verdict
    assert {one.name for one in findings.effects if one.added} == ({"latent_heat"} if name == "latent" else set())


def _mismatched(experiment: Experiment, shuffled: bool) -> Experiment:
    """Every run with the output of the next; or its own, in an order of chance."""
    outputs = [run.output for run in experiment.runs]
    draw = np.random.default_rng(0)
    runs = []
    for number, run in enumerate(experiment.runs):
        other = draw.permutation(run.output) if shuffled else outputs[(number + 1) % len(outputs)]
        runs.append(dataclasses.replace(run, outputs={experiment.output_name: np.resize(other, run.output.shape)}))
    return dataclasses.replace(experiment, runs=tuple(runs))


@pytest.mark.slow  # a loop each
@pytest.mark.parametrize("shuffled", [True, False])
def test_inconsistent_data_are_not_explained(tmp_path: Path, shuffled: bool) -> None:
    """Neither shuffled samples nor runs with each other's outputs get an effect or an equation."""
    findings = close_loop(_mismatched(_demo("complete"), shuffled), memory=tmp_path)
    assert findings.verdict == "not in the library"
    assert not any(one.added for one in findings.effects)
    assert not any(term.named for term in findings.unknown)
    assert findings.explained_variance < findings.config.least_explained_variance
    assert "belong together" in narrate(findings).summary[0]
    assert pooled_rmse(findings.runs, "held-out", "after") > 50.0 * findings.noise_sigma
    if shuffled:
        assert any(
            "times the declared noise: either the noise was declared too small or" in line
            for line in narrate(findings).summary
        )
