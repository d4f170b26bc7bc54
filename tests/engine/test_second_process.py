"""Programs that a second process makes are those that this one would make."""

from __future__ import annotations

from typing import Any
from unittest import mock

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core import worker_process as module
from smajax.core.worker_process import VARIABLE, begin_call, worker_process
from smajax.engine import Wanted, begin_programs, facade, program, programs
from smajax.engine.traced import Traced
from tests.core.test_worker_process import wait_for

X = {"x": np.linspace(0.0, 1.0, 20)}


def powers(model: Any, own: dict[str, Any]) -> Any:
    x = own["x"]
    return {"square": x**2 * model[0][0], "series": jnp.arange(3) * x}


class Doubled(eqx.Module):
    series: Any
    kind: str = eqx.field(static=True)


def doubled(model: Any, own: dict[str, Any]) -> Any:
    return Doubled(2.0 * own["x"] * model[0][0], "doubled")


def without_tracing() -> Any:
    """In the second process: what it has made for the first one, it does not make again for itself."""
    with mock.patch.object(facade, "Traced", None):
        return program(doubled, (np.asarray([2.0]),), ("x",))((np.asarray([2.0]),), X).series


def roots(model: Any, own: dict[str, Any]) -> Any:
    return jnp.sqrt(own["x"]) + model[0][0]


def fails(model: Any, own: dict[str, Any]) -> Any:
    raise ValueError("the function's own error")


@pytest.fixture
def second(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setattr(module, "available_cores", lambda: 2)
    monkeypatch.setattr(facade, "_programs", {})
    with worker_process(("tests.engine.test_second_process",)):
        yield monkeypatch


def wanted(function: Any) -> Wanted:
    return Wanted(function, (np.asarray([2.0]),), ("x",))


def test_a_program_of_the_second_process_is_taken_and_gives_the_same(second: pytest.MonkeyPatch) -> None:
    begin_programs([wanted(powers)])
    wait_for(wanted(powers).key("auto"))
    second.setattr(facade, "Traced", None)  # nothing is traced here
    made = program(powers, (np.asarray([2.0]),), ("x",))
    found = made((np.asarray([3.0]),), X)
    np.testing.assert_array_equal(found["square"], 3.0 * X["x"] ** 2)
    np.testing.assert_array_equal(found["series"], np.outer(X["x"], np.arange(3)))


def test_a_module_comes_back_whole_and_its_program_is_kept_there(second: pytest.MonkeyPatch) -> None:
    begin_programs([wanted(doubled)])
    wait_for(wanted(doubled).key("auto"))
    call = begin_call(lambda: None, without_tracing)
    wait_for(call)
    np.testing.assert_array_equal(call.result(), 4.0 * X["x"])
    second.setattr(facade, "Traced", None)
    found = program(doubled, (np.asarray([2.0]),), ("x",))((np.asarray([3.0]),), X)
    assert isinstance(found, Doubled)
    assert found.kind == "doubled"
    np.testing.assert_array_equal(found.series, 6.0 * X["x"])


def test_several_programs_are_made_here_and_there(second: pytest.MonkeyPatch) -> None:
    made_here: list[str] = []
    traced = Traced

    def noted(function: Any, *rest: Any) -> Any:
        made_here.append(function.__name__)
        return traced(function, *rest)

    second.setattr(facade, "Traced", noted)
    begin_programs([wanted(roots)])
    wait_for(wanted(roots).key("auto"))
    programs([wanted(roots), wanted(powers)])
    assert made_here == ["powers"]  # what is being made there comes last here
    found = program(roots, (np.asarray([2.0]),), ("x",))((np.asarray([1.0]),), X)
    np.testing.assert_allclose(found, np.sqrt(X["x"]) + 1.0, rtol=1e-15)


def test_what_a_function_raises_is_raised_here(second: pytest.MonkeyPatch) -> None:
    begin_programs([wanted(fails)])
    wait_for(wanted(fails).key("auto"))
    with pytest.raises(ValueError, match="the function's own error"):
        program(fails, (np.asarray([2.0]),), ("x",))


def test_xla_makes_its_programs_here(second: pytest.MonkeyPatch) -> None:
    second.setenv(facade.VARIABLE, "xla")
    begin_programs([wanted(powers)])
    assert not module.is_called(wanted(powers).key("xla"))
    made = program(powers, (np.asarray([2.0]),), ("x",))
    assert made.native is None
