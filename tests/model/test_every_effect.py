"""Every effect of the library, by machine code: nothing at its base, something off it, and its derivatives."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.config import AttributionConfig
from smajax.core.parameters import get_parameters, parameters, set_parameters, set_vector
from smajax.core.units import convert
from smajax.engine import program
from smajax.model.effects.candidate import Extent
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System
from smajax.simulation.simulate import simulate
from tests.model.test_effects_material import RIGS as ELSEWHERE

NUDGE = AttributionConfig().nudge

DT = 0.05
# The first on which an effect applies shows it.
RIGS: dict[str, tuple[System, str, float]] = {
    "dead_weight": (build("flexinol_table_3_2", "dead_weight", "voltage"), "voltage", 7.4),
    "bias_spring": (build("flexinol_ht_500um", "bias_spring", "duty"), "duty", 0.35),
    "arm": (build("niti_table_3_1", "arm", "amplified_voltage"), "voltage", 7.0),
    "one modulus": (
        set_parameters(build("flexinol_table_3_2", "dead_weight", "voltage"), {"young_modulus_austenite": 28e9}),
        "voltage",
        7.4,
    ),
}
# Those of kinetics, constitutive law and sensor are together in one model a rig in `test_effects_material`.
HERE = sorted(set(LIBRARY) - {name for *_, names in ELSEWHERE.values() for name in names})
Array = np.ndarray
Shown = tuple[Array, Array]  # reading and temperature, (members, samples) each


def _rig(effect: str) -> str:
    return next(name for name, (system, _, _) in RIGS.items() if LIBRARY[effect].candidate.applies(system))


def _along(asked: Any, own: dict[str, jax.Array]) -> tuple[Any, Any]:
    """(reading, temperature) and their derivatives, at the values and along the direction in `own`."""
    system, inputs = asked
    names = [name.removeprefix("value ") for name in own if name.startswith("value ")]

    def shown(values: jax.Array) -> tuple[jax.Array, jax.Array]:
        run = simulate(set_vector(system, names, values), inputs, DT)
        return run.reading, run.temperature

    values, towards = (jnp.stack([own[f"{what} {name}"] for name in names]) for what in ("value", "towards"))
    return jax.jvp(shown, (values,), (towards,))


def _shown(rig: str, effects: tuple[str, ...], names: list[str], points: Array, ways: Array) -> tuple[Shown, Shown]:
    """Of one rig with `effects`, heated and cooled: what it shows at `points` (M, P), and how that moves along `ways`."""
    system, channel, top = RIGS[rig]
    shares = [jnp.full(120, 1.0), jnp.full(60, 0.6), jnp.full(60, 0.95), jnp.full(120, 0.0)]
    asked = extended(system, effects), {channel: top * jnp.concatenate(shares)}
    own = {f"value {name}": points[:, k] for k, name in enumerate(names)}
    own |= {f"towards {name}": ways[:, k] for k, name in enumerate(names)}
    return program(_along, asked, tuple(own), engine="native")(asked, own, 1)


@cache
def _plain(rig: str) -> Array:
    """The reading of the base model, by a program that asks for derivatives as well."""
    some = ["convection_coefficient"]
    at = np.asarray(get_parameters(RIGS[rig][0], some))[None]
    return _shown(rig, (), some, at, np.zeros_like(at))[0][0][0]


def _features(shown: Shown) -> Array:
    """(members, 4): means over parts of the run, smooth where a single sample has a kink."""
    reading, temperature = shown
    return np.stack([part.mean(axis=1) for part in (reading, reading[:, 150:], reading[:, -100:], temperature)], axis=1)


class _Told(NamedTuple):
    """Of one effect, by a program that all of its rig share: readings (samples,), and derivatives of features by coefficient, (C, 4) by share."""

    at_base: Array
    at_starts: Array
    names: list[str]
    forward: dict[float, Array]
    difference: dict[float, Array]
    rounding: dict[float, list[float]]


@cache
def _told(effect: str) -> _Told:
    rig, starts_of = _rig(effect), LIBRARY[effect].candidate.initial_guess
    everything = tuple(name for name in HERE if _rig(name) == rig)
    full = extended(RIGS[rig][0], everything)
    table = parameters(full)
    all_of_it = [name for name in table if "." in name]
    names = [name for name in all_of_it if name.startswith(f"{effect}.")]
    base = np.asarray(get_parameters(full, names))
    starts = np.asarray([starts_of[_short(name)] for name in names])
    switch = np.asarray([_short(name) in LIBRARY[effect].candidate.switches for name in names])
    shares = {NUDGE: np.where(switch, NUDGE * starts, starts), 1.0: starts}
    points, ways, steps = [base, starts], [np.zeros_like(base)] * 2, {}
    for share, at in shares.items():
        for k, name in enumerate(names):
            room, one = table[name].high - table[name].low, np.eye(len(names))[k]
            # Wide enough to rise above rounding, and not across zero.
            steps[share, k] = min(1e-5 * room, 0.1 * abs(at[k]) or 1e-5 * room)
            points += [at, at - steps[share, k] * one, at + steps[share, k] * one]
            ways += [one, 0.0 * one, 0.0 * one]
    own = [all_of_it.index(name) for name in names]
    at = np.tile(np.asarray(get_parameters(full, all_of_it)), (len(points), 1))
    along = np.zeros_like(at)
    at[:, own], along[:, own] = np.stack(points), np.stack(ways)
    shown, slopes = _shown(rig, everything, all_of_it, at, along)
    features, slope = _features(shown)[2:], _features(slopes)[2:]
    forward, difference, rounding = {}, {}, {}
    for number, share in enumerate(shares):
        mine = range(3 * len(names) * number, 3 * len(names) * (number + 1), 3)
        wide = [steps[share, k] for k in range(len(names))]
        forward[share] = slope[mine]
        difference[share] = np.stack(
            [(features[at + 2] - features[at + 1]) / (2.0 * step) for at, step in zip(mine, wide, strict=True)]
        )
        rounding[share] = [1e-13 * np.abs(features[at]).max() / step for at, step in zip(mine, wide, strict=True)]
    return _Told(shown[0][0], shown[0][1], names, forward, difference, rounding)


@pytest.mark.parametrize("effect", sorted(LIBRARY))
def test_an_experiment_file_can_give_the_coefficients_of_every_effect(effect: str) -> None:
    """Their units are ones that the reader knows, and `switches` and `starts` name coefficients within their bounds."""
    table = parameters(LIBRARY[effect].base())
    for name, entry in table.items():
        assert convert(1.0, entry.unit, entry.unit) == 1.0
        low, high = entry.low, entry.high
        assert low <= LIBRARY[effect].candidate.initial_guess[_short(name)] <= high
    assert {f"{effect}.{name}" for name in LIBRARY[effect].candidate.switches} <= set(table)


@pytest.mark.parametrize(
    "effect", sorted(name for name, one in LIBRARY.items() if one.candidate.bounds(Extent(1.0, 1.0, 0.0)))
)
def test_a_coefficient_in_the_unit_of_the_reading_is_bounded_by_the_runs(effect: str) -> None:
    """An arm turns by radians where a slider moves by millimetres: a bound in metres is none in radians."""
    table = {_short(name): entry for name, entry in parameters(LIBRARY[effect].base()).items()}
    arm, slider = (
        LIBRARY[effect].candidate.bounds(Extent(20.0, 2.0, 0.0)),
        LIBRARY[effect].candidate.bounds(Extent(20.0, 2e-3, 0.0)),
    )
    assert arm.keys() == slider.keys() <= table.keys()
    for name, (low, high) in arm.items():
        assert table[name].low <= low <= 0.0 < high <= table[name].high
        assert np.array([low, high]) == pytest.approx(1e3 * np.array(slider[name]))
    # Beyond a stroke a run, or a play of a whole stroke, a sensor shows nothing of the motion.
    (most,) = (high for _, high in arm.values())
    assert most == {"sensor_drift": 2.0 / 20.0, "sensor_offset": 2.0, "sensor_backlash": 1.0}[effect]


def _short(name: str) -> str:
    return name.split(".", 1)[1]


@pytest.mark.parametrize("effect", HERE)
def test_every_effect_at_its_base_value_is_the_base_model(effect: str) -> None:
    plain = _plain(_rig(effect))
    # The same equations in another program: products and sums are put together otherwise, to the last bit but one.
    np.testing.assert_allclose(_told(effect).at_base, plain, rtol=0.0, atol=1e-10 * np.ptp(plain))


@pytest.mark.parametrize("effect", HERE)
def test_every_effect_at_its_initial_guess_changes_the_reading(effect: str) -> None:
    told = _told(effect)
    assert np.abs(told.at_starts - told.at_base).max() > 1e-4 * np.ptp(told.at_base)


# Their derivative is that of a staircase with round edges (see the effect); a difference sees samples change their step.
STAIRS = {"sensor_resolution.increment", "sensor_resolution.zero"}


@pytest.mark.parametrize("share", [NUDGE, 1.0], ids=["next to nothing", "switched on"])
@pytest.mark.parametrize("effect", HERE)
def test_derivatives_of_every_effect_agree_with_differences(effect: str, share: float) -> None:
    """Where its score is taken, and where a refit begins: at exactly zero a tail has no derivative (see `scores_at`)."""
    told = _told(effect)
    for k, name in enumerate(told.names):
        if name in STAIRS:
            continue
        forward, difference = told.forward[share][k], told.difference[share][k]
        if _short(name) in LIBRARY[effect].candidate.switches:
            assert np.abs(forward).max() > 0.0, f"{name} cannot be told"
        error = np.abs(forward - difference).max()
        assert error <= 1e-4 * np.abs(difference).max() + told.rounding[share][k], (
            f"{name}: automatic {forward}, differences {difference}"
        )
