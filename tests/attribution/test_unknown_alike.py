"""Unknown functions that look alike about the base model, and one of the drive's command."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.unknown.search import unknown_terms
from smajax.attribution.unknown.term_fits import with_terms
from smajax.attribution.unknown.terms import UNKNOWN
from smajax.model.drive.inputs import CommandTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.library import LIBRARY
from smajax.model.presets import build
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.resistance import ResistanceTerm, resistance_per_metre
from smajax.model.wire.wire import Wire
from tests.helpers.stepped_weight import DT, LEVELS, NOISE, hidden_in_runs


class TiredSupply(AbstractEffect, CommandTerm):
    """An amplifier that gives ever less of what it is asked for."""

    effect_name: ClassVar[str] = "tired_supply"

    def command(self, channel: str, value: Scalar) -> Scalar:
        return value / jnp.sqrt(1.0 + (value / 12.0) ** 2)


class _BentResistance(AbstractEffect, ResistanceTerm):
    """A resistance that goes with the square of the temperature."""

    effect_name: ClassVar[str] = "bent_resistance"

    def resistance_factor(self, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return 8e-5 * (temperature - 23.0) ** 2


class _SteepStrain(AbstractEffect, ConstitutiveTerm):
    """A strain that goes with the square of the fraction: hardly any at one end, twice as much as usual at the other."""

    effect_name: ClassVar[str] = "steep_strain"

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        fraction = at.martensite_fraction
        return 0.9 * wire.constitutive.recoverable_strain * fraction * (fraction - 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [_BentResistance, TiredSupply])
def test_of_two_functions_that_look_alike_the_true_one_is_fitted(hidden: type[AbstractEffect]) -> None:
    """Where the temperature follows the command, about the base model a change of the one looks as one of the other: the score test prefers the command."""
    best = unknown_terms(*hidden_in_runs(hidden(), dt=8.0 * DT)).terms[0]
    true = {_BentResistance: "unknown_resistance_of_temperature", TiredSupply: "unknown_command_of_command"}
    assert best.named
    assert best.name == true[hidden]
    assert best.left_out_after is not None
    assert best.left_out_after < 1.3 * NOISE


def test_a_command_never_changes_its_sign_and_is_sought_where_the_effects_leave_it() -> None:
    plain = LIBRARY["dead_zone"](threshold=1.0)
    setting, model = hidden_in_runs(library=("dead_zone",))
    problem = setting.problem
    values = np.array(model.values)
    values[problem.names.index("dead_zone.threshold")] = 1.0
    found = with_terms(setting, dataclasses.replace(model, effects=("dead_zone",), values=values))[2]
    (term,) = (one for one in found.terms if one.effect_name == "unknown_command_of_command")
    largest = max(max(levels) for levels in LEVELS)
    low, high = float(term.low), float(term.low + term.width)
    assert low == pytest.approx(0.0, abs=0.3)
    assert high == pytest.approx(float(plain.command("voltage", jnp.asarray(largest))), abs=0.3)
    cooling = dataclasses.replace(term, c0=jnp.asarray(-4.0), c1=jnp.asarray(2.0))
    for value in np.linspace(0.0, high, 21):
        assert float(cooling.command("voltage", jnp.asarray(value))) >= 0.0
        assert float(cooling.command("voltage", jnp.asarray(-value))) <= 0.0


@pytest.mark.parametrize("name", ["unknown_resistance_of_temperature", "unknown_resistance_of_fraction"])
def test_a_resistance_stays_above_a_tenth_of_the_base_models(name: str) -> None:
    """With the coefficients at their bounds it was less than none, and the current cooled the wire."""
    term = dataclasses.replace(UNKNOWN[name](c0=jnp.asarray(-4.0), c1=jnp.asarray(4.0)), scale=jnp.asarray(0.5))
    wire = build("flexinol_table_3_2", "dead_weight", "amplified_voltage").wire
    factor = [
        float(resistance_per_metre(wire, [term], at, at) / resistance_per_metre(wire, [], at, at))
        for at in map(jnp.asarray, np.linspace(0.0, 1.0, 21))
    ]
    assert min(factor) == pytest.approx(0.1)
    assert max(factor) > 0.8  # and changes elsewhere
    slope = jax.grad(lambda at: resistance_per_metre(wire, [term], at, at))
    assert all(np.isfinite(float(slope(jnp.asarray(at)))) for at in (0.1, 0.5, 0.9))


@pytest.mark.slow
def test_a_strain_of_the_square_of_the_fraction_is_within_the_bounds() -> None:
    """Its wave of two half periods is three widths of its prior: a bound of two left 1.22 noises, and another formula."""
    best = unknown_terms(*hidden_in_runs(_SteepStrain())).terms[0]
    assert best.named
    assert best.name == "unknown_strain_of_fraction"
    assert best.left_out_after is not None
    assert best.left_out_after < 1.1 * NOISE
    assert best.formulas[0].text.endswith("xi^2")
