"""What the package registers is complete: an effect changes an equation, a preset says where each of its numbers comes from."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
import types
from typing import Any, ClassVar

import jax.numpy as jnp
import pytest

from smajax.control.presets import CONTROLLERS
from smajax.core.parameters import parameters
from smajax.core.plugins import resolved
from smajax.model.effects import base as effects_base
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Width
from smajax.model.effects.contract_check import CONTRACTS, methods
from smajax.model.effects.library import _OWN, _effect_of, _wrong
from smajax.model.load.arm import Arm
from smajax.model.load.dead_weight import DeadWeight
from smajax.model.preset_sources import origins_of
from smajax.model.presets import _LOADS, WIRES, build
from smajax.model.types import Scalar, WireState
from smajax.model.wire.heat import HeatState, HeatTerm
from smajax.model.wire.history import DURATION, HistoryTerm, following
from smajax.simulation.compiled import simulate_compiled


@pytest.mark.parametrize("name", _OWN)
def test_an_effect_of_the_library_is_held_to_what_a_plug_in_is(name: str) -> None:
    assert _wrong(name, _OWN[name]) == ""


def test_an_effect_of_the_library_that_is_not_complete_is_named_with_its_file(monkeypatch: pytest.MonkeyPatch) -> None:
    class Misspelt(AbstractEffect, HeatTerm):
        effect_name = "misspelt"
        canditate = _OWN["latent_heat"].candidate

        def heat_loss(self, wire: Any, at: HeatState) -> float:
            return 1.0

    monkeypatch.setitem(sys.modules, "smajax.model.effects.misspelt", types.SimpleNamespace(Misspelt=Misspelt))
    with pytest.raises(
        TypeError, match=r"the effect in smajax/model/effects/misspelt.py lacks candidate, which every effect"
    ):
        _effect_of("misspelt")
    monkeypatch.setitem(sys.modules, "smajax.model.effects.draught", types.SimpleNamespace())
    with pytest.raises(LookupError, match="has no class with `effect_name = 'draught'`"):
        _effect_of("draught")


def test_a_misspelt_method_of_an_effect_is_an_error() -> None:
    latent = _OWN["latent_heat"]

    class Misspelt(AbstractEffect, HeatTerm):
        effect_name = "misspelt"
        candidate = dataclasses.replace(latent.candidate, switches=(), initial_guess={}, widths={})

        def heat_los(self) -> float:
            return 1.0

    assert "it has heat_los, and overrides none of the methods stored_heat, heat_loss" in _wrong("misspelt", Misspelt)
    with pytest.raises(TypeError, match=r"^Misspelt changes no equation: it has heat_los, .*; is one misspelt\?"):
        dataclasses.replace(build("niti_table_3_1", "arm", "voltage"), effects=(Misspelt(),))


def test_an_effect_without_a_contract_is_an_error_that_names_the_contract_of_its_method() -> None:
    """It would be ignored without a word; a method that a contract has names that contract alone."""

    class Bare(AbstractEffect):
        effect_name = "bare"

    class Loss(Bare):
        def friction_limits(self) -> float:
            return 1.0

    system = build("niti_table_3_1", "arm", "voltage")
    with pytest.raises(
        TypeError, match=r"Bare changes no equation: it inherits from no contract.*HeatTerm \(stored_heat"
    ):
        dataclasses.replace(system, effects=(Bare(),))
    with pytest.raises(TypeError, match=r"Loss changes no equation.*FrictionTerm \(friction_limit"):
        dataclasses.replace(system, effects=(Loss(),))
    with pytest.raises(TypeError, match=r"LatentHeat in the effects of a system is a class; expected an instance"):
        dataclasses.replace(system, effects=(_OWN["latent_heat"],))
    with pytest.raises(TypeError, match=r"str is no effect"):
        dataclasses.replace(system, effects=("latent_heat",))


def test_an_effect_with_memory_that_does_not_say_what_it_keeps_is_an_error() -> None:
    """Of the base class, of the duration, of an entry: what is missing, and of which effect."""

    class Clamp(AbstractEffect, HeatTerm):
        """Follows the temperature, and forgets to inherit from `HistoryTerm`."""

        def history_at_start(self, at: WireState) -> dict[str, Scalar]:
            return {"lagged": at.temperature, DURATION: jnp.zeros_like(at.stress)}

        def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
            return {"lagged": following(old, "lagged", old.temperature, new.temperature, jnp.asarray(2.0))}

        def heat_loss(self, wire: Any, at: HeatState) -> Scalar | float:
            return 1e-3 * (
                at.temperature - following(at.old, "lagged", at.old.temperature, at.temperature, jnp.asarray(2.0))
            )

    class Timeless(Clamp, HistoryTerm):
        effect_name = "timeless"

        def history_at_start(self, at: WireState) -> dict[str, Scalar]:
            return {"lagged": at.temperature}

    class Other(Clamp, HistoryTerm):
        effect_name = "other"

        def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
            return {"laged": new.temperature}

    class Reads(AbstractEffect, HeatTerm):
        heat_loss = Clamp.heat_loss

    system = build("flexinol_table_3_2", "dead_weight", "voltage")
    volts = {"voltage": jnp.full(11, 3.0)}
    with pytest.raises(
        TypeError, match="Clamp has history_at_start, history_after of HistoryTerm, and does not inherit"
    ):
        dataclasses.replace(system, effects=(Clamp(),))
    for effect, message in (
        (Timeless(), r"effect `timeless`: .*no entry 'duration' \(there are: lagged\)\. .* inherit from HistoryTerm"),
        (
            Other(),
            r"effect `other`: .*no entry 'laged' \(there are: duration, lagged\)\. .*each of its entries, and DURATION",
        ),
        (Reads(), r"following 'lagged': .*no entry 'duration' \(there are: none\)"),
    ):
        with pytest.raises(ValueError, match=message):
            simulate_compiled(dataclasses.replace(system, effects=(effect,)), volts, 0.01)


def test_a_part_in_a_file_of_its_own_is_one_line_of_a_table() -> None:
    table = {"one": Arm, "other": "smajax.model.load.dead_weight:DeadWeight"}
    assert resolved(table) == {"one": Arm, "other": DeadWeight}
    with pytest.raises(AttributeError, match="no attribute 'Antagonist'"):
        resolved({"antagonist": "smajax.model.load.dead_weight:Antagonist"})


def test_a_load_states_the_sources_of_its_numbers() -> None:
    class Blade(DeadWeight):
        origins: ClassVar[dict[str, str]] = {
            "load_mass": "chosen: of the bench",
            "damping": "printed: Table 1: no ringing",
        }

    origins = origins_of("blade", Blade(load_mass=0.1, damping=20.0))
    assert (origins["load_mass"].kind, origins["load_mass"].note) == ("chosen", "of the bench")
    assert origins["damping"].note == "Table 1: no ringing"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"prior_class": "weather"}, "is of the class 'weather'; expected one of material, bench, event"),
        ({"widths": {"entalpy": Width(1.0, "")}}, "has a width of what is none of its parameters: entalpy"),
        ({"widths": {"enthalpy": Width(0.0, "")}}, "for enthalpy; expected a sigma above 0"),
        (
            {"widths": {"enthalpy": Width(1.0, "", of="hour")}},  # type: ignore[arg-type]
            "'stroke', 'increment', 'run', 'load', 'command', '1/run', 'stroke/run'",
        ),
    ],
)
def test_a_prior_that_cannot_be_read_is_an_error(changed: dict[str, Any], message: str) -> None:
    latent = _OWN["latent_heat"]

    class Changed(latent):  # type: ignore[misc, valid-type]
        candidate = dataclasses.replace(latent.candidate, **changed)

    assert message in _wrong("latent_heat", Changed)


@pytest.mark.parametrize("name", [*WIRES, *_LOADS])
def test_a_preset_states_the_sources_of_its_numbers(name: str) -> None:
    made = (WIRES | _LOADS)[name]()
    entries = parameters(made)
    origins = origins_of(name, made)
    missing = sorted(set(entries) - set(origins))
    assert not missing, f"say where the numbers of {name} come from, in `origins` of its class, for {missing}"
    assert {one.kind for one in origins.values()} <= {"printed", "corrected", "chosen"}


def test_controllers_are_presets_with_a_main_gain() -> None:
    assert all(one.main_gain for one in CONTROLLERS.values())


def test_the_table_of_contracts_has_every_contract_with_its_methods_and_arguments() -> None:
    """What a contributor reads before any other file (`effects/base.py`, which the reference shows)."""
    rows = re.findall(r"^\| [^|]+ \| `([\w.]+)` \| (.+) \|$", effects_base.__doc__ or "", re.MULTILINE)
    written = {name: re.findall(r"`(\w+)\(([^)]*)\)`", told) for name, told in rows}
    assert written == {
        f"{one.__module__.removeprefix('smajax.model.')}.{one.__name__}": [
            (name, ", ".join([*inspect.signature(getattr(one, name)).parameters][1:])) for name in methods(one)
        ]
        for one in CONTRACTS
    }
