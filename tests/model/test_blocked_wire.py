"""A wire clamped between a frame and a load cell: its force is that of a closed form at rest, and of an independent integration on the way."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from smajax.core.parameters import get_parameters, parameter_values, set_parameters, set_vector
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.form import AbstractForm, IntegratedForm, RateForm
from smajax.simulation.batch.axes import grid
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.dataset import simulate_dataset
from smajax.simulation.sensors import sensor_output, sensors_of
from smajax.simulation.simulate import simulate
from tests.helpers.machine_code import by_machine_code

STIFFNESSES = (1e2, 1e3, 1e5, 1e7)  # N/m, from bound to bound


def bench(form: AbstractForm | None = None, drive: str = "voltage", **values: float) -> System:
    system = build("flexinol_table_3_2", "blocked_wire", drive)
    law = dataclasses.replace(system.wire.constitutive, form=form or IntegratedForm())
    return set_parameters(
        dataclasses.replace(system, wire=dataclasses.replace(system.wire, constitutive=law)), {**values}
    )


@pytest.mark.parametrize(
    ("form", "moduli"), [(IntegratedForm(), (75e9, 28e9)), (RateForm(), (60e9, 60e9))], ids=["integrated", "rate"]
)
@pytest.mark.parametrize("stiffness", STIFFNESSES)
def test_at_rest_the_force_is_that_of_two_springs_in_series(
    form: AbstractForm, moduli: tuple[float, float], stiffness: float
) -> None:
    r"""All austenite, eq. 4.51 from rest at F_0 says sigma = E_A (sigma_0/E_M + eps_L - x/L) + theta_T (T - T_inf); with F_0 + K x = A sigma

        K x = K L eps/(1 + K L/(E_A A)),   eps = eps_L + theta_T (T - T_inf)/E_A + sigma_0 (1/E_M - 1/E_A).

    Under the rate form (eq. 3.2) that is so with one modulus for both phases; with two it depends on the way.
    """
    austenite, martensite = moduli
    system = bench(
        form,
        "power",
        cell_stiffness=stiffness,
        recoverable_strain=0.003,
        young_modulus_austenite=austenite,
        young_modulus_martensite=martensite,
    )
    run = simulate_compiled(system, {"power": jnp.full(1201, 9.0)}, 0.05)
    v = parameter_values(system)
    area = 0.25 * np.pi * v["wire_diameter"] ** 2
    warmed = float(run.temperature[-1]) - v["ambient_temperature"]
    stress = v["pretension"] / area
    strain = 0.003 + v["thermal_modulus"] * warmed / austenite + stress * (1.0 / martensite - 1.0 / austenite)
    rise = stiffness * v["wire_length"] * strain / (1.0 + stiffness * v["wire_length"] / (austenite * area))
    assert float(run.martensite_fraction[-1]) == 0.0
    assert warmed == pytest.approx(9.0 / 0.537 / (150.0 * np.pi * 150e-6), rel=1e-6)
    assert float(run.reading[0]) == 2.0
    assert float(run.reading[-1]) - 2.0 == pytest.approx(rise, rel=1e-6)
    assert float(run.reading[-1]) == pytest.approx(area * float(run.stress[-1]), rel=1e-9)


def _integrated(system: System, volts: Callable[[float], float], off: float, times: np.ndarray) -> np.ndarray:
    """Force (N) at `times` of a wire heated until `off` (s) and then cooled, without mass or damping: scipy and the paper's equations."""
    v = parameter_values(system)
    area = 0.25 * np.pi * v["wire_diameter"] ** 2
    length, air, pretension = v["wire_length"], v["ambient_temperature"], v["pretension"]
    first = pretension / area / v["young_modulus_martensite"]

    def on_curve(temperature: float, stress: float, heated: float | None) -> float:
        if heated is None:  # eq. 3.3 from all martensite
            start, finish = v["austenite_start"], v["austenite_finish"]
            share = (temperature - stress / v["stress_slope_austenite"] - start) / (finish - start)
            return 0.5 * (1.0 + np.cos(np.pi * np.clip(share, 0.0, 1.0)))
        start, finish = v["martensite_start"], v["martensite_finish"]
        share = (temperature - stress / v["stress_slope_martensite"] - finish) / (start - finish)
        return 0.5 * (1.0 - heated) * np.cos(np.pi * np.clip(share, 0.0, 1.0)) + 0.5 * (1.0 + heated)  # eq. 3.5

    def wire(temperature: float, heated: float | None) -> tuple[float, float]:
        """(stress, fraction) where the wire's pull is the load cell's."""

        def miss(stress: float) -> float:
            fraction = on_curve(temperature, stress, heated)
            modulus = fraction * v["young_modulus_martensite"] + (1.0 - fraction) * v["young_modulus_austenite"]
            strain = -(area * stress - pretension) / v["cell_stiffness"] / length
            elastic = strain + first + v["recoverable_strain"] * (1.0 - fraction)
            return stress - modulus * elastic - v["thermal_modulus"] * (temperature - air)

        stress = brentq(miss, 0.0, 3e9, xtol=1.0, rtol=1e-12)
        return stress, on_curve(temperature, stress, heated)

    def rate(time: float, state: np.ndarray, heated: float | None) -> list[float]:
        _, fraction = wire(state[0], heated)
        resistivity = fraction * v["resistivity_martensite"] + (1.0 - fraction) * v["resistivity_austenite"]
        given = (volts(time) / length) ** 2 * area / resistivity
        lost = v["convection_coefficient"] * np.pi * v["wire_diameter"] * (state[0] - air)
        return [(given - lost) / (v["density"] * area * v["specific_heat"])]

    exact = {"rtol": 1e-9, "atol": 1e-9, "max_step": 0.05}
    hot = times <= off + 1e-9
    up = solve_ivp(rate, (0.0, off), [air], args=(None,), t_eval=times[hot], **exact).y[0]
    heated = wire(up[-1], None)[1]
    down = solve_ivp(rate, (off, times[-1]), [up[-1]], args=(heated,), t_eval=times[~hot], **exact).y[0]
    forces = [wire(one, None)[0] for one in up] + [wire(one, heated)[0] for one in down]
    return area * np.asarray(forces)


@pytest.mark.parametrize("stiffness", [2e3, 1e5])
def test_on_the_way_the_force_is_that_of_an_independent_integration(stiffness: float) -> None:
    """Heated within the transformation, held, and cooled; mass and damping are so small here that the load cell follows within 0.05 ms."""
    system = bench(cell_stiffness=stiffness, damping=5e-5 * stiffness, fixture_mass=1e-4)
    times = 0.02 * np.arange(601)
    run = simulate_dataset(system, {"voltage": jnp.where(times < 6.0 - 1e-9, 9.6, 0.0)}, 0.02)
    expected = _integrated(system, lambda time: 9.6 if time < 6.0 else 0.0, 6.0, times)
    assert 0.2 < float(run["martensite_fraction"].min()) < 0.9
    assert np.ptp(expected) > 4.0
    assert np.abs(run["reading"].to_numpy() - expected).max() < 2e-4 * np.ptp(expected)


@pytest.mark.parametrize("stiffness", STIFFNESSES)
def test_a_stiff_load_cell_is_integrated_within_the_tolerance(stiffness: float) -> None:
    """The motion is up to a million times as quick as the heat: error-controlled steps, and one step a sample at any clock."""
    system = bench(drive="current", cell_stiffness=stiffness)
    for dt in (0.005, 0.1):
        times = dt * np.arange(round(16.0 / dt) + 1)
        current = {"current": jnp.where(times < 8.0, 0.42, 0.0)}
        run = simulate_dataset(system, current, dt)
        error = json.loads(run.attrs["integration_error"])
        moved = float(np.ptp(run["reading"].to_numpy()))
        assert run.attrs["unsolved_stages"] in (0, "0")
        assert error["largest_rms_over_stroke"] < 3e-4
        assert error["outputs"]["reading"]["rms"] < 1e-4 * moved
        assert error["outputs"]["reading"]["largest"] < 1e-3 * moved
        once = simulate_compiled(system, current, dt)
        assert float(once.unsolved[-1]) == 0.0
        assert np.sqrt(np.mean((np.asarray(once.reading) - run["reading"].to_numpy()) ** 2)) < 2e-3 * moved


def test_its_sensor_shows_the_force_and_the_others_what_they_are_named_after() -> None:
    system = bench()
    run = simulate_compiled(system, {"voltage": jnp.full(201, 9.6)}, 0.02)
    assert sensors_of(system) == {
        "force": "N",
        "temperature": "degC",
        "stress": "Pa",
        "strain": "-",
        "resistance": "ohm",
    }
    np.testing.assert_array_equal(sensor_output(system, run, "force"), run.reading)
    np.testing.assert_allclose(run.reading, 2.0 + 1e5 * np.asarray(run.position), rtol=1e-12)
    assert float(sensor_output(system, run, "resistance")[0]) == pytest.approx(
        76e-8 * 0.537 / (0.25 * np.pi * 150e-6**2), rel=1e-9
    )
    kept = ("position", "velocity", "reading")
    batch = run_batch(system, {"voltage": jnp.full(201, 9.6)}, grid({"pretension": [1.0, 2.0]}), dt=0.02, keep=kept)
    assert [batch[name].attrs["units"] for name in kept] == ["m", "m/s", "N"]


def test_the_force_has_the_derivatives_of_differences() -> None:
    inputs = {"voltage": jnp.where(jnp.arange(81) < 50, 9.6, 0.0)}
    system, names = bench(), ("cell_stiffness", "pretension", "recoverable_strain", "wire_length")
    values = get_parameters(system, names)

    def force(shares: jax.Array) -> jax.Array:
        return simulate(set_vector(system, names, values * shares), inputs, 0.1).reading

    def at(number: int, share: float) -> np.ndarray:
        changed = set_vector(system, names, values * jnp.ones(4).at[number].set(share))
        return np.asarray(simulate_compiled(changed, inputs, 0.1).reading)

    along = by_machine_code(lambda way: jax.jvp(force, (jnp.ones(4),), (way,))[1])
    columns = np.stack([along(way) for way in np.eye(4)], axis=1)
    for number in range(4):
        differences = (at(number, 1.0 + 1e-5) - at(number, 1.0 - 1e-5)) / 2e-5
        np.testing.assert_allclose(columns[:, number], differences, atol=1e-4 * np.abs(differences).max())
