"""An effect that reads an entry of the wire's history which nothing keeps is named in the error, whatever equation it changes."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import jax.numpy as jnp
import pytest

from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.history_errors import history_entries_named
from smajax.model.presets import build
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.heat import HeatState, HeatTerm
from smajax.model.wire.history import HistoryTerm
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import simulate


class Worked(AbstractEffect, ConstitutiveTerm):
    """Reads what no effect writes, in a comprehension and without `HistoryTerm`."""

    effect_name: ClassVar[str] = "worked"

    def strain(self, wire: Any, at: WireState) -> Scalar | float:
        return 1e-6 * sum(at.history[name] for name in ("work",))


class Soaked(AbstractEffect, HeatTerm, HistoryTerm):
    """Reads another entry than the one that it has."""

    effect_name: ClassVar[str] = "soaked"

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        return {"soak": jnp.zeros_like(at.stress)}

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        return {"soak": old.history["soak"]}

    def heat_loss(self, wire: Any, at: HeatState) -> Scalar | float:
        return 1e-3 * _of(at)


class Wrong(Worked):
    """Looks up something else that is not there."""

    effect_name: ClassVar[str] = "wrong"

    def strain(self, wire: Any, at: WireState) -> Scalar | float:
        return {"here": 1.0}["elsewhere"] * at.stress


def _of(at: HeatState) -> Scalar:
    return at.old.history["soaking"]


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        (
            Worked(),
            r"effect `worked`: the wire's history has no entry 'work' \(there are: none\)\. The effect has to inherit from HistoryTerm",
        ),
        (
            Soaked(),
            r"effect `soaked`: the wire's history has no entry 'soaking' \(there are: soak\)\. .*history_at_start to return each",
        ),
    ],
)
@pytest.mark.parametrize("run", [simulate_compiled, simulate])
def test_an_entry_that_nothing_keeps_is_named_with_its_effect(effect: AbstractEffect, message: str, run: Any) -> None:
    system = dataclasses.replace(build("flexinol_table_3_2", "dead_weight", "voltage"), effects=(effect,))
    with pytest.raises(ValueError, match=message):
        run(system, {"voltage": jnp.full(11, 3.0)}, 0.01)


def test_a_coupon_says_so_too() -> None:
    system = dataclasses.replace(build("flexinol_table_3_2", "coupon", "none"), effects=(Worked(),))
    with pytest.raises(ValueError, match="effect `worked`: the wire's history has no entry 'work'"):
        simulate(system, {"temperature": jnp.full(11, 30.0), "stress": jnp.full(11, 1e8)}, 0.01)


def test_any_other_key_that_is_not_there_is_the_error_that_it_was() -> None:
    with pytest.raises(KeyError, match="elsewhere"), history_entries_named():
        raise KeyError("elsewhere")
    system = dataclasses.replace(build("flexinol_table_3_2", "dead_weight", "voltage"), effects=(Wrong(),))
    with pytest.raises(KeyError, match="elsewhere"):
        simulate(system, {"voltage": jnp.full(11, 3.0)}, 0.01)
