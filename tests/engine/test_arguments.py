"""Arguments of a program: of another kind than it was made for, NumPy's types, any order of dimensions, random keys."""

from __future__ import annotations

import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.engine import (
    EngineWarning,
)
from smajax.engine import program as compiled_program
from tests.helpers.engine_results import summed


@pytest.mark.usefixtures("forgetful")
@pytest.mark.parametrize("engine", ["auto", "native", "xla"])
@pytest.mark.parametrize(
    ("model", "own", "message"),
    [
        (
            np.zeros(4),
            {"a": np.arange(3.0)},
            r"Leaf 0 of the model is an array of the shape \(4,\), float64; .* \(3,\)",
        ),
        (np.zeros(3, np.float32), {"a": np.arange(3.0)}, "float32; the program was made for .* float64"),
        (2.5, {"a": np.arange(3.0)}, "is the number 2.5; the program was made for an array"),
        ((np.zeros(3), np.zeros(3)), {"a": np.arange(3.0)}, "has another structure"),
        (np.zeros(3), {"b": np.arange(3.0)}, r"named \['b'\]; the program was made for \['a'\]"),
        (np.zeros(3), {"a": np.zeros((3, 2))}, r"shapes \{'a': \(3, 2\)\}; expected one number a run"),
        (np.zeros(3), {"a": np.zeros(0)}, "expected one number a run"),
    ],
)
def test_arguments_of_another_kind_than_the_program_was_made_for_are_refused(
    engine: Any, model: Any, own: Any, message: str
) -> None:
    """Machine code would read beyond the end of an array; no engine takes the blame for it."""
    made = compiled_program(summed, np.zeros(3), ("a",), engine=engine)
    native_before = made.native
    with pytest.raises(ValueError, match=message):
        made(model, own)
    with pytest.raises(ValueError, match=message):
        made.begin(model, own, 1, tuple(jax.local_devices()), 8, 8)
    assert made.native is native_before
    np.testing.assert_allclose(made(np.ones(3), {"a": np.arange(2.0)})[1], np.full(3, 2.0))


@pytest.mark.usefixtures("forgetful")
def test_an_error_of_the_caller_leaves_machine_code_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """What no engine can do is the caller's error: it is raised as it is, and the next call runs machine code."""
    made = compiled_program(summed, jnp.asarray(1.0), ("a",))
    assert made.native is not None
    texts: Any = {"a": np.array(["one", "two"])}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError, match="could not convert"):
            made(jnp.asarray(1.0), texts)
        with pytest.raises(ValueError, match="`threads` is 'all'; expected a whole number"):
            made(jnp.asarray(1.0), {"a": np.ones(2)}, threads="all")  # type: ignore[arg-type]
    assert made.native is not None
    with pytest.raises(TypeError, match="hold a value that has no hash"):
        compiled_program(summed, jnp.asarray(1.0), ["a"])  # type: ignore[arg-type]


@pytest.mark.usefixtures("forgetful")
def test_random_keys_of_another_kind_run_by_xla() -> None:
    def draw(key: Any, own: dict[str, Any]) -> Any:
        return jax.random.normal(key) + own["a"]

    key = jax.random.key(0, impl="rbg")
    with pytest.warns(EngineWarning, match="random keys of the kind"):
        drawn = compiled_program(draw, key, ("a",))(key, {"a": np.zeros(1)})
    np.testing.assert_allclose(drawn, [jax.random.normal(key)])


@pytest.mark.usefixtures("forgetful")
def test_numpy_scalars_of_other_types_are_other_programs() -> None:
    """int8(100) is equal to int64(100) and has its hash, but not its square."""
    with np.errstate(over="ignore"):
        found = [
            float(
                compiled_program(lambda model, own: own["a"] + model * model, one, ("a",))(one, {"a": np.zeros(2)})[0]
            )
            for one in (np.int64(100), np.int8(100))
        ]
    assert found == [10000.0, 16.0]


@pytest.mark.usefixtures("forgetful")
def test_an_array_in_another_order_of_its_dimensions_is_read_right() -> None:
    matrix = np.arange(300.0).reshape(20, 15)

    def turned(model: Any, own: Any) -> Any:
        return jax.lax.reshape(model * own["a"], (300,), dimensions=(1, 0))

    with pytest.warns(EngineWarning, match="`reshape` in another order of the dimensions"):
        run = compiled_program(turned, matrix, ("a",))
    np.testing.assert_allclose(run(matrix, {"a": np.ones(2)})[1], matrix.T.ravel())
