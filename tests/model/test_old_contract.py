"""Effects of the form of version 0.1: every old method does what its successor does, and a warning says what to write instead."""

from __future__ import annotations

import warnings
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import parameter
from smajax.model.drive.supply import Circuit
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.contract_check import CONTRACTS, methods
from smajax.model.effects.grouping import grouped
from smajax.model.effects.old_contract import OLD
from smajax.model.load.force import EndMotion
from smajax.model.presets import build
from smajax.model.system import initial_state
from smajax.model.wire.heat import HeatState, convection
from smajax.model.wire.kinetics_terms import PlaceTerm


def _old(**methods: Any) -> AbstractEffect:
    """An effect with these methods of the old form, adopted; the warning is part of it."""
    names = {"__annotations__": {"x": Any}, "x": parameter("-", 0.0, 1.0, "x", default=0.5), "__module__": __name__}
    effect = type("Old", (AbstractEffect,), {"effect_name": "old", **names, **methods})()
    with pytest.warns(DeprecationWarning, match="is an effect of the old form"):
        grouped([effect])
    return effect


SYSTEM = build("flexinol_table_3_2", "dead_weight", "voltage")
STATE = initial_state(SYSTEM, {"voltage": jnp.asarray(0.0)}).wire
WIRE = SYSTEM.wire
AT = HeatState(jnp.asarray(60.0), jnp.asarray(20.0), jnp.asarray(0.4), jnp.asarray(3.0), STATE, jnp.asarray(0.1))


def test_every_method_of_old_belongs_to_a_contract() -> None:
    # The place on the shape is newer than that class.
    assert set(OLD.values()) == set(CONTRACTS) - {PlaceTerm}
    assert max(len(methods(contract)) for contract in CONTRACTS) <= 3


def test_three_methods_of_the_heat_balance_are_one_loss() -> None:
    effect = _old(
        heat_loss=lambda self, wire, temperature, ambient: self.x * (temperature - ambient),
        convection_change=lambda self, time: 0.1 * time,
        heat_of_change=lambda self, wire, old, temperature, fraction: 2.0 * (fraction - old.martensite_fraction),
    )
    (term,) = grouped([effect]).heat
    wanted = 0.5 * 40.0 + 0.3 * convection(WIRE, AT.temperature, AT.ambient) + 2.0 * (0.4 - 1.0) / 0.1
    np.testing.assert_allclose(term.heat_loss(WIRE, AT), wanted, rtol=1e-12)
    assert term.stored_heat(WIRE, AT.temperature, AT.fraction) == 0.0


def test_kept_values_of_an_old_effect_are_history() -> None:
    effect = _old(
        kept_at_start=lambda self, temperature, stress, fraction: {"q": temperature + fraction},
        kept_after=lambda self, old, temperature, stress, fraction: {"q": old.kept["q"] + fraction},
        strain=lambda self, wire, temperature, stress, fraction, detwinned: 1e-3 * detwinned,
        kept_strain=lambda self, at: 1e-6 * at.kept["q"],
    )
    terms = grouped([effect])
    entries = terms.history[0].history_at_start(STATE)
    np.testing.assert_allclose(entries["q"], STATE.temperature + 1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # `kept` for `history`
        system = type(SYSTEM)(WIRE, SYSTEM.load, SYSTEM.drive, (effect,))
        at = initial_state(system, {"voltage": jnp.asarray(0.0)}).wire
        np.testing.assert_allclose(terms.history[0].history_after(at, STATE)["q"], at.history["q"] + 1.0)
        strain = terms.constitutive.changes[0].strain(WIRE, at)
    np.testing.assert_allclose(strain, 1e-3 + 1e-6 * (float(at.temperature) + 1.0), rtol=1e-12)


def test_old_frictions_and_load_changes_belong_to_the_load() -> None:
    effect = _old(friction_share=lambda self: self.x, load_change=lambda self, time: 0.1 * time)
    terms = grouped([effect])
    np.testing.assert_allclose(terms.friction[0].friction_limit(jnp.asarray(3.0)), 1.5)
    at = EndMotion(jnp.asarray(0.0), jnp.asarray(0.0), jnp.asarray(2.0), jnp.asarray(5.0))
    np.testing.assert_allclose(terms.force[0].resisting_force(SYSTEM.load, at), 1.0)
    plain = _old(friction_limit=lambda self: self.x, friction_level=lambda self, speed: 0.7)
    (term,) = grouped([plain]).friction
    assert (float(term.friction_limit(jnp.asarray(3.0))), term.friction_level(jnp.asarray(0.0))) == (0.5, 0.7)


def test_a_supply_loses_a_share_of_its_voltage() -> None:
    circuit = Circuit(*(jnp.asarray(value) for value in (4.0, 2.0, 1.0, 0.5)))
    sagging = _old(current_sag=lambda self: self.x)
    np.testing.assert_allclose(grouped([sagging]).supply.supplies[0].voltage_share(circuit, None), 0.5)
    tiring = _old(
        kept_at_start=lambda self, temperature, stress, fraction: {},
        supply_drop=lambda self, old, current, per_volt: current + per_volt,
        kept_after_current=lambda self, old, current, per_volt: {"i": current},
    )
    (term,) = grouped([tiring]).supply.supplies
    assert term.voltage_share(circuit, None) == 1.0
    np.testing.assert_allclose(term.voltage_share(circuit, STATE), 1.0 - 1.5 / 4.0)
    assert float(term.history_after_supply(circuit, STATE)["i"]) == 1.0


def test_an_old_effect_with_one_method_of_a_pair_leaves_the_other_unchanged() -> None:
    (term,) = grouped([_old(heating_shape=lambda self, z, remaining: 0.5 * remaining)]).kinetics.shapes
    assert (float(term.heating_shape(AT.fraction, AT.fraction)), float(term.cooling_shape(AT.time, AT.fraction))) == (
        0.2,
        0.4,
    )


def test_a_current_effect_is_unchanged_and_gives_no_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        grouped([])
        from smajax.model.effects.library import at_base

        grouped(at_base(["latent_heat", "creep", "sensor_lag"]))
