"""Batches by machine code: XLA's numbers, and a run is the same to the bit whatever runs beside it."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smajax.engine import Engine, EngineWarning, Unsupported, program
from smajax.model.rigs import arm
from smajax.simulation.batch.axes import sampled, zipped
from smajax.simulation.batch.chunks import chunks
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.measures import Largest, Last, Mean, MeanSquare
from tests.helpers.engine_results import by_machine_code, same_batch


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40), st.sampled_from([2, 4, 8, 16, 32]))
def test_any_number_of_runs_in_any_number_of_lanes_is_right(values, lanes):
    own = np.array(values)
    found = by_machine_code(lambda a: jnp.where(a > 1.0, a * a, -a), own, lanes=lanes)
    np.testing.assert_array_equal(found, np.where(own > 1.0, own * own, -own))


def _runs(engine: Engine):
    axes = sampled(37, voltage=(5.5, 8.5), payload_mass=(0.05, 0.09), seed=1)
    keep = ("position", "temperature", "martensite_fraction", "stress")
    measures = (
        Last("position"),
        Largest("stress"),
        Mean("temperature"),
        MeanSquare("position", jnp.linspace(0, 1, 401)),
    )
    return run_batch(arm(), {}, axes, seconds=2.0, every=8, keep=keep, measures=measures, engine=engine, tolerance=None)


def test_a_batch_of_arms_equals_xla():
    same_batch(_runs("native"), _runs("xla"), 1e-10)


def test_a_run_is_the_same_to_the_bit_whatever_runs_beside_it():
    axes = sampled(50, voltage=(5.5, 8.5), payload_mass=(0.05, 0.09), seed=2)
    box = axes.runs(0, 50)

    def run(first: int, last: int, threads: int) -> np.ndarray:
        part = zipped({name: series[first:last] for name, series in box.items()})
        measures, devices = (Last("stress"),), jax.local_devices() * threads
        found = run_batch(arm(), {}, part, seconds=1.0, keep=(), measures=measures, devices=devices, tolerance=None)
        return found["last_stress"].to_numpy()

    whole = run(0, 50, 1)
    np.testing.assert_array_equal(run(0, 50, 3), whole)
    np.testing.assert_array_equal(run(17, 18, 1), whole[17:18])
    np.testing.assert_array_equal(run(31, 50, 2), whole[31:])


def test_a_run_that_becomes_nan_does_not_change_the_others():
    load = np.linspace(0.0, 0.1, 20)  # N m
    asked: dict[str, Any] = {"seconds": 1.0, "keep": ("stress",), "every": 20, "tolerance": None}
    good = run_batch(arm(), {"voltage": 7.0}, zipped({"load_torque": load}), **asked)
    load[3] = 1e300
    mixed = run_batch(arm(), {"voltage": 7.0}, zipped({"load_torque": load}), **asked)
    others = np.arange(20) != 3
    assert mixed["status"].to_numpy()[3] == 1
    np.testing.assert_array_equal(mixed["stress"].to_numpy()[others], good["stress"].to_numpy()[others])


def test_a_function_with_no_translation_runs_by_xla_or_says_why():
    def sorted_pair(model, own):
        return {"least": jnp.sort(jnp.stack([own["a"], own["b"]]))[0]}

    axes = zipped({"a": np.array([1.0, 2.0, 3.0]), "b": np.array([3.0, 1.0, 2.0])})
    with pytest.raises(Unsupported, match="sort"):
        program(sorted_pair, None, ("a", "b"), engine="native")
    with pytest.warns(EngineWarning, match="`sort`"):
        ((_, found),) = chunks(sorted_pair, None, axes, 3, [0])
    np.testing.assert_array_equal(found["least"], [1.0, 1.0, 2.0])
    with pytest.raises(Unsupported, match="`sort`"):
        list(chunks(sorted_pair, None, axes, 3, [0], engine="native"))


def test_numpy_arrays_of_any_layout_and_numbers_of_any_kind_are_read_right():
    def total(model, own):
        return {"sum": own["a"] * model["t"].sum() + jnp.asarray(model["n"]).astype(float)}

    axes = zipped(a=[1.0, 2.0])
    for number in (1, 1.5, True):
        for array in (np.arange(10.0)[::2], np.arange(12.0).reshape(3, 4).T[1], np.arange(5, dtype="float32")):
            ((_, found),) = chunks(total, {"t": array, "n": number}, axes, 2, [0], engine="native")
            np.testing.assert_allclose(found["sum"], np.array([1.0, 2.0]) * array.sum() + float(number))
