"""What is said of a controller that cannot be called in a loop, and a loop of one without parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import smajax as sma
from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.loop_dataset import SetPointWarning
from smajax.control.reference import clock, constant
from smajax.model.presets import build

HANGING = build("flexinol_table_3_2", "dead_weight", "voltage")


class _Own(AbstractController):
    """PI with gains that are no parameters."""

    answer: Callable[..., Any] = lambda memory, error: (
        memory + 0.02 * error,
        jnp.clip(4e3 * error + 4e3 * memory, 0.0, 9.0),
    )

    def start(self, measured: Any, wanted: Any) -> Any:
        return jnp.zeros_like(measured.position)

    def step(self, memory: Any, measured: Any, wanted: Any, period: Any) -> Any:
        return self.answer(memory, wanted.position - measured.position)


def test_a_controller_without_parameters_has_a_labelled_run() -> None:
    run = sma.simulate_loop_dataset(sma.loop_around(HANGING, _Own()), "2 mm: 8 s", dt=0.02, period=0.02)
    assert run.attrs["gains"] == "{}"
    assert float(run["position"][-1]) == pytest.approx(2e-3, rel=0.1)


FAULTS = {
    "if": (lambda memory, error: (memory, 2.0 if error > 0.0 else 1.0), r"`_Own.step` asks for a number .* `jnp.where"),
    "numpy": (lambda memory, error: (memory, np.clip(error, 0.0, 2.0)), r"functions of `jax.numpy` in the place of"),
    "math": (lambda memory, error: (memory, math.exp(error)), r"`_Own.step` asks for a number"),
    "pair": (lambda memory, error: error, r"gives an array of float64 of shape \(\), expected \(memory, command\)"),
    "command": (
        lambda memory, error: (memory, (error, 1)),
        r"the command of `_Own.step` is a tuple of 2, expected one",
    ),
    "shape": (
        lambda memory, error: (memory, jnp.ones(2)),
        r"the command of `_Own.step` is an array of float64 of shape \(2,\)",
    ),
    "index": (lambda memory, error: (memory, error[error > 0.0].sum()), r"`_Own.step` asks for a number"),
    "complex": (lambda memory, error: (memory, 1.0j * error), r"the command of `_Own.step` is an array of complex128"),
    "text": (lambda memory, error: (memory, "2 V"), r"the command of `_Own.step` is `str`, expected one number"),
    "memory": (lambda memory, error: ((memory, error), error), r"another form than that of `start`: .* expected \(\)"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_wrong_with_the_step_of_a_controller_is_said(fault: str) -> None:
    answer, said = FAULTS[fault]
    with pytest.raises(TypeError, match=said):
        simulate_closed_loop(HANGING, _Own(answer), constant(clock(1.0, 0.01), 2e-3), dt=0.01)


class _Begun(_Own):
    first: Callable[..., Any] = jnp.zeros_like

    def start(self, measured: Any, wanted: Any) -> Any:
        return self.first(wanted.position - measured.position)


@pytest.mark.parametrize(
    ("first", "said"),
    [
        (lambda error: 1.0 if error > 0.0 else 0.0, r"`_Begun.start` asks for a number"),
        (lambda error: "none", r"memory that `_Begun.start` gives has `str` in it"),
        (
            lambda error: jnp.zeros((), int),
            r"is float64 after `_Begun.step` and int64 before: let `start` give it as float64",
        ),
    ],
)
def test_what_is_wrong_with_the_start_of_a_controller_is_said(first: Callable[..., Any], said: str) -> None:
    with pytest.raises(TypeError, match=said):
        sma.simulate_loop_dataset(sma.loop_around(HANGING, _Begun(first=first)), "2 mm: 1 s", dt=0.02, period=0.02)


@pytest.mark.parametrize(
    ("first", "after"),
    [
        (lambda error: jnp.zeros((), jnp.float32), lambda memory: memory + 0.0),
        (lambda error: jnp.zeros(()), lambda memory: 0),
        (lambda error: (jnp.zeros(()), jax.random.key(0)), lambda memory: (0.0, jax.random.split(memory[1])[0])),
        (lambda error: None, lambda memory: None),
    ],
)
def test_a_memory_keeps_its_precision(first: Callable[..., Any], after: Callable[..., Any]) -> None:
    own = _Begun(lambda memory, error: (after(memory), 2.0), first)
    loop = simulate_closed_loop(HANGING, own, constant(clock(0.2, 0.01), 2e-3), dt=0.01)
    np.testing.assert_allclose(loop.voltage[:-1], 2.0)


def test_a_function_is_no_controller() -> None:
    def mine(memory: Any, measured: Any, wanted: Any, period: Any) -> Any:
        return memory, 1.0

    for given, said in ((mine, "got function `mine`, expected a controller"), (_Own, "got the class `_Own`")):
        with pytest.raises(TypeError, match=said):
            sma.loop_around(HANGING, given)  # type: ignore[arg-type]
        with pytest.raises(TypeError, match=said):
            simulate_closed_loop(HANGING, given, constant(clock(1.0, 0.01), 2e-3), dt=0.01)  # type: ignore[arg-type]


def test_a_set_point_in_metres_that_was_meant_in_millimetres_is_a_warning() -> None:
    loop = sma.loop_around(HANGING, "pid")
    with pytest.warns(SetPointWarning, match=r"to 1.9 m, .* of its length: a number is in m; .*`'2 mm'`"):
        sma.simulate_loop_dataset(loop, 1.9, seconds=0.1, dt=0.02, period=0.02)
