"""A duty is made of a command by the supply that the controller's model has: a lower one heats less."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import pytest

import smajax as sma
from smajax.control.perturbed_plant import Perturbation, perturbed_plant
from smajax.model.drive.duty import Duty
from smajax.model.presets import build
from smajax.model.system import System

VOLTS = 12.0


def _plant(supply: float = VOLTS) -> System:
    return dataclasses.replace(build("flexinol_table_3_2", "dead_weight", "none"), drive=Duty(supply))


@pytest.mark.parametrize("ratio", [0.5, 0.75, 1.0, 2.0])
def test_the_heat_of_a_command_goes_as_the_square_of_the_supply(ratio: float) -> None:
    plant = perturbed_plant(_plant(), {"supply": jnp.asarray(ratio)}, Perturbation(("supply",), ("supply_voltage",)))
    inputs = plant.drive.from_command(jnp.asarray(3.0))
    power, believed = (one.power(jnp.asarray(8.0), jnp.asarray(0.2), inputs) for one in (plant.drive, Duty(VOLTS)))
    assert float(power / believed) == pytest.approx(ratio**2, rel=1e-12)
    assert float(inputs["duty"]) == pytest.approx((3.0 / VOLTS) ** 2)


def test_a_loop_on_half_the_supply_that_is_assumed_is_slower() -> None:
    def position(supply: float) -> float:
        loop = sma.loop_around(_plant(supply), "pid", assumed=_plant())
        return float(sma.simulate_loop_dataset(loop, "3 mm: 2 s", dt=0.02, period=0.02)["position"][-1])

    at_half, at_own = (position(share * VOLTS) for share in (0.5, 1.0))
    assert at_half < 0.5 * at_own


def test_a_loop_without_another_model_is_that_of_its_own_supply() -> None:
    own, alone = (sma.loop_around(_plant(9.0), "pid", **more) for more in ({"assumed": _plant(9.0)}, {}))
    first, second = (sma.simulate_loop_dataset(one, "3 mm: 1 s", dt=0.02, period=0.02) for one in (own, alone))
    assert first["position"].to_numpy().tolist() == second["position"].to_numpy().tolist()
