"""Slopes of measures by parameters, along error-controlled steps and backwards through equal ones: those of differences, and kept as all else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import get_parameters, parameters, set_parameters
from smajax.core.units import convert
from smajax.engine import program
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System
from smajax.simulation.batch.axes import Axes, grid, sampled, zipped
from smajax.simulation.batch.recipe import BatchSettings, recipe_of
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.batch.single_run import Recipe, slope_name, without_slopes
from smajax.simulation.measures import AbstractMeasure, Last, Mean, MeanSquare, TimeAbove
from tests.helpers.engine_results import same_batch
from tests.model.test_every_effect import RIGS, _rig

ARM = build("niti_table_3_1", "arm", "amplified_voltage")
TRACKED = MeanSquare("position", jnp.linspace(-0.7, 0.2, 101), 0.1)
BY = ("voltage", "wire_diameter", "payload_mass", "austenite_start")
SPREAD: dict[str, Any] = {"seconds": 2.0, "dt": 0.02, "keep": (), "tolerance": None}
WARMTH: dict[str, Any] = {"measures": (Last("temperature"),), "slopes": ("voltage", "damping"), **SPREAD}


def _along(asked: tuple[Recipe, dict[str, float]], own: dict[str, jax.Array]) -> dict[str, jax.Array]:
    """The measures' derivatives along a direction, forwards."""
    recipe, way = asked
    at = {name: own[name] if name in own else get_parameters(recipe.system, [name])[0] for name in way}

    def measured(at: dict[str, jax.Array]) -> dict[str, jax.Array]:
        found = without_slopes(recipe, own | at)
        return {one.name: found[one.name] for one in recipe.measures}

    return jax.jvp(measured, (at,), ({name: jnp.asarray(step) for name, step in way.items()},))[1]


def _same_as_forward(
    system: System,
    inputs: dict[str, Any],
    axes: Axes,
    measures: tuple[AbstractMeasure, ...],
    by: tuple[str, ...],
    **more: Any,
) -> None:
    """Along a way that moves every parameter by about its own size, or a little of its room where it is zero."""
    found = run_batch(system, inputs, axes, measures=measures, slopes=by, engine="native", keep=(), **more)
    members, table = axes.runs(0, axes.size), parameters(system)
    sizes = {
        name: abs(float(members[name][0] if name in members else get_parameters(system, [name])[0])) for name in by
    }
    sizes = {name: size or 1e-2 * (table[name].high - table[name].low) for name, size in sizes.items()}
    rng = np.random.default_rng(1)
    way = {name: size * rng.uniform(0.5, 1.0) * rng.choice([-1.0, 1.0]) for name, size in sizes.items()}
    recipe = recipe_of(system, inputs, axes, BatchSettings(measures=measures, slopes=by, keep=(), **more))
    ahead = program(_along, (recipe, way), tuple(members), engine="native")((recipe, way), members, 1)
    for one in measures:
        parts = [found[slope_name(one.name, name)].to_numpy().ravel() * step for name, step in way.items()]
        scale = np.abs(parts).sum(axis=0).max()
        assert scale > 0.0
        np.testing.assert_allclose(
            np.sum(parts, axis=0), ahead[one.name], rtol=0.0, atol=1e-9 * scale, err_msg=one.name
        )


@pytest.mark.slow
def test_reverse_mode_slopes_agree_with_forward_mode() -> None:
    axes = sampled(13, voltage=(5.5, 8.5), payload_mass=(0.05, 0.09), seed=1)
    _same_as_forward(ARM, {}, axes, (TRACKED, Mean("temperature")), BY, seconds=2.0, dt=0.02, tolerance=None)


def test_slopes_agree_with_differences() -> None:
    change = 1e-4
    volts, mass = np.array([6.0, 7.0, 8.0]), np.array([0.05, 0.06, 0.07])
    found = run_batch(ARM, {}, zipped(voltage=volts, payload_mass=mass), measures=(TRACKED,), slopes=BY, **SPREAD)

    at = {name: np.full(3, float(get_parameters(ARM, [name])[0])) for name in BY[1:]} | {
        "voltage": volts,
        "payload_mass": mass,
    }

    def moved(**by: np.ndarray) -> np.ndarray:
        axes = zipped({**at, **by})  # every one of them: one program
        return run_batch(ARM, {}, axes, measures=(TRACKED,), **SPREAD)[TRACKED.name].to_numpy()

    for name in BY:
        value = at[name]
        step = change * np.abs(value)
        difference = (moved(**{name: value + step}) - moved(**{name: value - step})) / (2.0 * step)
        np.testing.assert_allclose(
            found[slope_name(TRACKED.name, name)], difference, rtol=2e-3, atol=1e-3 * np.abs(difference).max()
        )


def test_slopes_have_the_unit_of_the_measure_over_that_of_the_parameter() -> None:
    measures = (Last("position"), Last("velocity"), Mean("temperature"), TRACKED)
    by = (*BY, "convection_coefficient", "start_fraction")
    recipe = recipe_of(ARM, {}, grid(voltage=[6.0]), BatchSettings(measures=measures, slopes=by, **SPREAD))
    units = recipe.units()
    assert units["last_position_by_voltage"] == "rad/V"
    assert (units["last_velocity"], units["last_velocity_by_start_fraction"]) == ("rad/s", "rad/s")
    assert units["mean_square_position_by_start_fraction"] == "-"
    assert units["mean_temperature_by_austenite_start"] == "K/K"
    assert units["mean_square_position_by_wire_diameter"] == "1/m"
    # One that a program can read.
    assert convert(1.0, units["mean_temperature_by_convection_coefficient"], "K m^2 K/mW") == pytest.approx(1e-3)


@pytest.mark.slow  # measures are in `test_batch`
def test_slopes_are_streamed_to_disk_and_resumed(tmp_path: Path) -> None:
    axes = sampled(40, voltage=(5.5, 8.5), seed=2)
    here = run_batch(ARM, {}, axes, **WARMTH)
    for _ in range(2):
        there = run_batch(ARM, {}, axes, out=tmp_path / "batch", **WARMTH)
        for name in here.data_vars:
            np.testing.assert_array_equal(here[name], there[name])
            assert here[name].attrs["units"] == there[name].attrs["units"]
    with pytest.raises(ValueError, match="another batch"):
        run_batch(ARM, {}, axes, out=tmp_path / "batch", **{**WARMTH, "slopes": ("voltage",)})


def test_slopes_are_the_models_where_a_wire_transforms_fully() -> None:
    """Those through equal steps of 5 ms had the wrong sign in a seventh of these runs, and differences of the same runs agreed with them."""
    volts = np.linspace(7.4, 8.0, 25)  # from 8.3 V on it meets its end stop
    by = ("convection_coefficient", "payload_mass")
    about = {name: float(get_parameters(ARM, [name])[0]) for name in by}
    measures = (Last("position"), Mean("position"))
    found = run_batch(ARM, {}, grid(voltage=volts), seconds=20.0, keep=(), measures=measures, slopes=by)
    for name, value in about.items():
        # Differences of runs that are integrated far more finely, over steps that are large beside what is left of the integration.
        ends = [value * (1.0 + share) for share in (-1e-3, 1e-3)]
        axes = grid({"voltage": volts, name: ends})
        ahead = run_batch(ARM, {}, axes, seconds=20.0, keep=(), measures=measures, tolerance=1e-9)
        for one in measures:
            differences = np.diff(ahead[one.name], axis=1)[:, 0] / (ends[1] - ends[0])
            slopes = found[slope_name(one.name, name)].to_numpy()
            assert np.abs(slopes - differences).max() < 0.03 * np.abs(differences).max()
            sure = np.abs(differences) > 0.1 * np.abs(differences).max()
            assert sure.sum() > 10
            np.testing.assert_array_equal(np.sign(slopes[sure]), np.sign(differences[sure]))
    assert "last_position_by_payload_mass" in json.loads(found.attrs["integration_error"])["outputs"]


def test_slopes_past_an_end_stop_have_the_shift_of_the_impact() -> None:
    """The arm snaps, meets its upper stop and falls back: what comes after shifts with the time of the impact. Differences over a part of the time are
    large beside the step in which the impact is."""
    volts, by = np.linspace(8.45, 9.0, 8), ("convection_coefficient", "payload_mass")
    measures = (Mean("position"), MeanSquare("position", 0.2, 0.1))
    given: dict[str, Any] = {"seconds": 20.0, "keep": ("position",), "measures": measures}
    found = run_batch(ARM, {}, grid(voltage=volts), slopes=by, **given)
    assert float(found["position"].max()) > np.radians(94.0)
    for name in by:
        value = float(get_parameters(ARM, [name])[0])
        ends = [value * (1.0 + share) for share in (-3e-3, 3e-3)]
        ahead = run_batch(ARM, {}, grid({"voltage": volts, name: ends}), tolerance=1e-9, **given)
        for one in measures:
            differences = np.diff(ahead[one.name], axis=1)[:, 0] / (ends[1] - ends[0])
            slopes = found[slope_name(one.name, name)].to_numpy()
            np.testing.assert_allclose(slopes, differences, atol=0.03 * np.abs(differences).max())


def test_slopes_at_a_tolerance_and_through_equal_steps_agree_where_no_branch_ends() -> None:
    given: dict[str, Any] = {"measures": (TRACKED,), "slopes": BY, "seconds": 2.0, "dt": 0.02, "keep": ()}
    along, back = (run_batch(ARM, {}, grid(voltage=[3.0, 4.0]), tolerance=one, **given) for one in (1e-7, None))
    for name in BY:
        name = slope_name(TRACKED.name, name)
        np.testing.assert_allclose(along[name], back[name], rtol=5e-3, atol=5e-3 * float(np.abs(back[name]).max()))


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"slopes": ("volts",)}, "inputs that `axes` vary .voltage."),
        ({"slopes": ("damping", "damping")}, "twice"),
        ({"slopes": ("damping",), "measures": ()}, "give `measures`"),
        (
            {"slopes": ("damping",), "measures": (TimeAbove("position", 0.1),)},
            "time_above_position moves by whole steps",
        ),
        ({"slopes": ("ambient_temperature",), "inputs": {"ambient_temperature": 25.0}}, "stands in for the parameter"),
    ],
)
def test_measures_and_settings_without_slopes_are_errors(more: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        run_batch(ARM, axes=grid(voltage=[6.0]), **{"inputs": {}, "measures": (TRACKED,), **SPREAD, **more})


def test_a_run_that_goes_wrong_spoils_no_slope_of_another() -> None:
    """A wire that melts has no slopes to trust; those beside it are as without it."""
    alone = run_batch(ARM, {}, zipped(voltage=[6.0, 7.0]), **WARMTH)
    beside = run_batch(ARM, {}, zipped(voltage=[6.0, 1e200, 7.0]), **WARMTH)
    assert beside["status"].values.tolist()[1] != 0
    np.testing.assert_array_equal(beside["last_temperature_by_voltage"][[0, 2]], alone["last_temperature_by_voltage"])


@pytest.mark.slow
def test_slopes_equal_xla() -> None:
    axes = sampled(13, voltage=(5.5, 8.5), payload_mass=(0.05, 0.09), seed=1)
    asked: dict[str, Any] = {"measures": (TRACKED, Mean("temperature")), "slopes": BY, **SPREAD}
    same_batch(
        run_batch(ARM, {}, axes, engine="native", **asked), run_batch(ARM, {}, axes, engine="xla", **asked), 1e-9
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect",
    [name for name in sorted(LIBRARY) if any(LIBRARY[name].candidate.applies(rig[0]) for rig in RIGS.values())],
)
def test_with_each_effect_reverse_mode_agrees_with_forward_mode(effect: str) -> None:
    system, channel, top = RIGS[_rig(effect)]
    full = extended(system, (effect,))
    table = parameters(full)
    starts = {f"{effect}.{key}": value for key, value in LIBRARY[effect].candidate.initial_guess.items()}
    full = set_parameters(full, {name: value for name, value in starts.items() if name in table})
    command = top * np.concatenate([np.ones(60), np.full(30, 0.6), np.zeros(30)])
    middle = float(get_parameters(full, ["convection_coefficient"])[0])
    axes = sampled(5, convection_coefficient=(0.7 * middle, 1.3 * middle), seed=3)
    inputs = {channel: jnp.asarray(command)}
    _same_as_forward(full, inputs, axes, (Mean("reading"), Mean("temperature")), tuple(table), dt=0.05, tolerance=None)
