"""The shapes in the signatures of `import smajax as sma` are those of what the functions take and give."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest
from jaxtyping import Array, Float

import smajax as sma
from smajax.control.closed_loop import ClosedLoop
from smajax.model.types import Scalar, Series, Trajectory
from tests.helpers.shapes import WrongShape, checked

SAMPLES, DT = 21, 0.01
VOLTS = jnp.full(SAMPLES, 5.0)
TIME = DT * jnp.arange(SAMPLES)
WEIGHT = sma.build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
COUPON = sma.build("flexinol_isobaric", "coupon", "none")
ARM = sma.build("niti_table_3_1", "arm", "amplified_voltage")
PULLED = {"temperature": jnp.linspace(30.0, 95.0, SAMPLES), "stress": jnp.full(SAMPLES, 100e6)}


def loop() -> ClosedLoop:
    controller = sma.CONTROLLERS["pid"].make(ARM)
    disturbance = {"load_torque": jnp.zeros(SAMPLES)}
    return checked(sma.simulate_closed_loop)(ARM, controller, jnp.full(SAMPLES, 0.2), DT, 2, disturbance=disturbance)


# A call of each public function whose signature names a shape.
CALLS: dict[str, Callable[[], Any]] = {
    "simulate": lambda: checked(sma.simulate)(WEIGHT, {"voltage": VOLTS}, DT),
    "simulate_compiled": lambda: checked(sma.simulate_compiled)(COUPON, PULLED, DT),
    "simulate_dataset": lambda: checked(sma.simulate_dataset)(WEIGHT, {"voltage": VOLTS}, DT),
    "simulate_closed_loop": loop,
    "merit": lambda: checked(sma.merit)(loop(), ARM, 0.01),
    "run_batch": lambda: checked(sma.run_batch)(
        WEIGHT, {"voltage": VOLTS, "ambient_temperature": 20.0}, sma.grid(load_mass=[0.05, 0.1]), dt=DT
    ),
    "get_parameters": lambda: checked(sma.get_parameters)(WEIGHT, ["load_mass", "wire_length"]),
    "reference.clock": lambda: checked(sma.reference.clock)(0.2, DT),
    "reference.resting": lambda: checked(sma.reference.resting)(TIME),
    "reference.constant": lambda: checked(sma.reference.constant)(TIME, 0.5),
    "reference.steps": lambda: checked(sma.reference.steps)(TIME, [0.1, 0.2], 0.1),
    "reference.ramp": lambda: checked(sma.reference.ramp)(TIME, 0.0, jnp.asarray(0.5), 0.1),
    "reference.sine": lambda: checked(sma.reference.sine)(TIME, 0.0, 0.5, 2.0),
    "reference.sampled": lambda: checked(sma.reference.sampled)(TIME, DT),
}


def public() -> dict[str, Callable[..., Any]]:
    """Functions of `sma`, and of `sma.reference`, by name."""
    found = {name: getattr(sma, name) for name in sma.NAMES}
    found |= {f"reference.{name}": one for name, one in vars(sma.reference).items() if not name.startswith("_")}
    return {name: one for name, one in found.items() if inspect.isfunction(one)}


def test_every_public_function_with_a_shape_in_its_signature_is_called() -> None:
    def shaped(function: Callable[..., Any]) -> bool:
        told = " ".join(
            map(str, function.__annotations__.values())
        )  # as text: some names are imported for checkers alone
        return any(word in told for word in ("Scalar", "Series", "Sampled", "[Array", "Trajectory", "ClosedLoop"))

    assert {name for name, one in public().items() if shaped(one)} == set(CALLS)


@pytest.mark.parametrize("name", CALLS)
def test_what_a_public_function_takes_and_gives_has_the_shapes_of_its_signature(name: str) -> None:
    CALLS[name]()


def test_a_result_of_another_length_than_its_inputs_is_found() -> None:
    """The test of the test, of each kind of annotation."""

    def last(inputs: dict[str, Series]) -> Series:
        return inputs["voltage"][1:]

    def mean(time: Series, at: Scalar | float = 0.0) -> Scalar:
        return time

    def table(names: list[Scalar]) -> Float[Array, "names 2"]:
        return jnp.zeros((len(names), 3))

    def run(inputs: dict[str, Series]) -> Trajectory:
        return jax.tree.map(lambda leaf: leaf[:-1], sma.simulate(WEIGHT, inputs, DT))

    wrong: list[tuple[Any, Any]] = [(last, {"voltage": VOLTS}), (mean, TIME), (table, [1.0]), (run, {"voltage": VOLTS})]
    for function, given in wrong:
        with pytest.raises(WrongShape, match="the result"):
            checked(function)(given)
    with pytest.raises(WrongShape, match=r"`at` has the shape \(2,\)"):
        checked(mean)(TIME, jnp.zeros(2))
    with pytest.raises(WrongShape, match=r"`inputs`\['current'\] has the shape \(3,\)"):
        checked(last)({"voltage": VOLTS, "current": jnp.zeros(3)})
    heavier = eqx.tree_at(lambda system: system.load.load_mass, WEIGHT, jnp.zeros(2))
    with pytest.raises(WrongShape, match=r"`system`.load.load_mass has the shape \(2,\)"):
        checked(sma.simulate)(heavier, {"voltage": VOLTS}, DT)
