"""What the package registers is complete: an effect changes an equation, a preset says where each of its numbers comes from."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from smajax.control.presets import CONTROLLERS
from smajax.core.parameters import parameters
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Width
from smajax.model.effects.library import _OWN, _wrong
from smajax.model.preset_sources import ORIGINS
from smajax.model.presets import _LOADS, WIRES
from smajax.model.wire.heat import HeatTerm


@pytest.mark.parametrize("name", _OWN)
def test_an_effect_of_the_library_is_held_to_what_a_plug_in_is(name: str) -> None:
    assert _wrong(name, _OWN[name]) == ""


def test_a_misspelt_method_is_a_fault() -> None:
    latent = _OWN["latent_heat"]

    class Misspelt(AbstractEffect, HeatTerm):
        effect_name = "misspelt"
        candidate = dataclasses.replace(latent.candidate, switches=(), initial_guess={}, widths={})

        def heat_los(self) -> float:
            return 1.0

    assert "is one misspelt?" in _wrong("misspelt", Misspelt)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"prior_class": "weather"}, "is of the class 'weather'; expected one of material, bench, event"),
        ({"widths": {"entalpy": Width(1.0, "")}}, "has a width of what is none of its parameters: entalpy"),
        ({"widths": {"enthalpy": Width(0.0, "")}}, "for enthalpy; expected a sigma above 0"),
        (
            {"widths": {"enthalpy": Width(1.0, "", of="hour")}},  # type: ignore[arg-type]
            "'stroke', 'increment', 'run', 'load', '1/run', 'stroke/run'",
        ),
    ],
)
def test_a_prior_that_cannot_be_read_is_a_fault(changed: dict[str, Any], message: str) -> None:
    latent = _OWN["latent_heat"]

    class Changed(latent):  # type: ignore[misc, valid-type]
        candidate = dataclasses.replace(latent.candidate, **changed)

    assert message in _wrong("latent_heat", Changed)


@pytest.mark.parametrize("name", [*WIRES, *_LOADS])
def test_a_preset_says_where_its_numbers_come_from(name: str) -> None:
    made = (WIRES | _LOADS)[name]()
    entries = parameters(made)
    missing = sorted(set(entries) - set(ORIGINS.get(name, {})))
    assert not missing, f"give {name} an entry in ORIGINS of smajax/model/preset_sources.py for {missing}"


def test_controllers_are_presets_with_a_main_gain() -> None:
    assert all(one.main_gain for one in CONTROLLERS.values())
