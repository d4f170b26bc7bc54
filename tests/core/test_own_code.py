"""The digest of what a user's parts do: other code or another value is another one, the same code in another process the same."""

from __future__ import annotations

import functools
import subprocess
import sys
import threading
import types
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.presets import CONTROLLERS, FILTERS
from smajax.core.own_code import UnreadableCodeError, code_digest, own_parts
from smajax.core.provenance import UnreadableCodeWarning, digest
from smajax.model.rigs import arm

PART = """
import dataclasses
import functools
import equinox as eqx
import jax
import jax.numpy as jnp
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.preset import ANGLE, ControllerPreset
from smajax.core.parameters import parameter
from smajax.model.types import Scalar

SHARE = 0.9
TABLE = {"a": [1.0, 2.0]}

@jax.jit
def share(voltage):
    return SHARE * voltage

class Base(AbstractController):
    def start(self, measured, wanted):
        return jnp.zeros_like(measured.position)

    @functools.cached_property
    def twice(self):
        return 2.0

class Own(Base):
    gain: Scalar = parameter("V/rad", 0.0, 10.0, "gain")

    def step(self, memory, measured, wanted, period):
        held = lambda one: jnp.clip(one, 0.0, TABLE["a"][1])
        return memory, held(share(self.gain * (wanted.position - measured.position)))

def made(gain):
    return ControllerPreset(lambda system: Own(gain=gain), "gain", ANGLE, {"gain": (0.1, 10.0)})

PRESET = made(3.0)
"""


def loaded(text: str = PART) -> Any:
    module = types.ModuleType("own_part")
    sys.modules["own_part"] = module  # as equinox and dataclasses look up a class's module
    try:
        exec(compile(text, "own_part.py", "exec", dont_inherit=True), vars(module))
    finally:
        del sys.modules["own_part"]
    return module


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("self.gain *", "2.0 * self.gain *"),  # the class
        ("SHARE = 0.9", "SHARE = 0.8"),  # a value of the module
        ("return SHARE", "return -SHARE"),  # a function that it calls, below `jax.jit`
        ("[1.0, 2.0]", "[1.0, 3.0]"),  # a value within a table, read by a function within a method
        ("jnp.clip", "jnp.minimum"),
        ("zeros_like", "ones_like"),  # the class that it is derived from
        ("return 2.0", "return 3.0"),
        ("made(3.0)", "made(4.0)"),  # a value in a closure
        ('10.0, "gain"', '20.0, "gain"'),  # the bounds of a parameter
        ("(0.1, 10.0)", "(0.2, 10.0)"),  # those of the search
    ],
)
def test_other_code_or_another_value_is_another_digest(before: str, after: str) -> None:
    assert before in PART
    assert code_digest(loaded(PART.replace(before, after)).PRESET) != code_digest(loaded().PRESET)


def test_the_same_code_is_the_same_digest_in_another_process(tmp_path: Path) -> None:
    (tmp_path / "own_part.py").write_text("# moved by a line\n" + PART, encoding="utf-8")
    program = (
        "from smajax.core.own_code import code_digest\n"
        "import own_part, sys\n"
        "sys.stdout.write(code_digest(own_part.PRESET))\n"
    )
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{program}"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert run.stdout == code_digest(loaded().PRESET) == code_digest(loaded().PRESET)


def test_every_controller_and_filter_of_the_package_can_be_read() -> None:
    marks = [code_digest(one) for one in (*CONTROLLERS.values(), *FILTERS.values())]
    assert len(set(marks)) == len(marks)


@pytest.mark.parametrize("function", [len, str.upper, np.add, jnp.sin, jax.vmap, [].append, functools.partial(max, 1)])
def test_functions_of_installed_packages_can_be_read(function: Callable[..., Any]) -> None:
    assert code_digest(lambda: function) == code_digest(lambda: function)


def test_a_controller_of_ones_own_within_a_model_counts_in_the_digest_of_it() -> None:
    one, other = (loaded(PART.replace("self.gain *", f"{k} * self.gain *")).PRESET.make(arm()) for k in (2.0, 3.0))
    assert [part.__qualname__ for part in own_parts((arm(), [one]))] == ["Own"]
    assert list(own_parts(arm())) == []
    assert digest(one) == digest(one) != digest(other)


def test_code_that_cannot_be_read_is_another_digest_every_time() -> None:
    lock = threading.Lock()

    def held() -> Any:
        return lock

    with pytest.raises(UnreadableCodeError, match="lock"):
        code_digest(held)
    with pytest.warns(UnreadableCodeWarning, match=r"The code of .*held cannot be read \(lock: .*is not used again"):
        assert digest([held]) != digest([held])


class _Scaled:
    """A decorator of a user, with a number that begins with an underscore."""

    def __init__(self, function: Callable[..., Any], gain: float) -> None:
        self._gain = gain
        vars(self)["__wrapped__"] = function


def _with(**attributes: float) -> Callable[..., Any]:
    def step(x: float) -> float:
        return x

    vars(step).update(attributes)
    return step


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (jax.nn.initializers.constant(0.1), jax.nn.initializers.constant(0.2)),  # a library's function with a value
        (_Scaled(loaded, 1.0), _Scaled(loaded, 2.0)),
        (_with(gain=1.0), _with(gain=2.0)),
        (defaultdict(int), defaultdict(list)),
    ],
)
def test_what_holds_another_value_is_another_digest(one: Any, other: Any) -> None:
    assert code_digest([one]) == code_digest([one]) != code_digest([other])


def _module(name: str, text: str) -> types.ModuleType:
    made = types.ModuleType(name)
    sys.modules[name] = made
    exec(text, vars(made))
    return made


def test_modules_that_import_each_other_and_imports_within_a_function_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    marks = []
    for gain in (1.0, 2.0, 2.0):
        for name in ("own_first", "own_second"):
            monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        first = _module("own_first", "def step(x):\n    import own_second\n    return own_second.scaled(x)\n")
        second = _module("own_second", f"GAIN = {gain}\ndef scaled(x):\n    return GAIN * x * other.PART\n")
        vars(first)["PART"], vars(second)["other"] = 3.0, first
        marks.append(code_digest(vars(first)["step"]))
    assert marks[0] != marks[1] == marks[2]


def test_the_digest_of_a_model_with_a_function_is_the_same_wherever_that_is_in_memory() -> None:
    class Holder(eqx.Module):
        law: Callable[..., Any] = eqx.field(static=True)
        leaf: Callable[..., Any]

    several = [Holder(_with(gain=gain), _with()) for gain in (1.0, 1.0, 2.0)]
    first, same, other = (digest(one) for one in several)
    assert first == same != other
