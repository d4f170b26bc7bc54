"""Whatever goes wrong with machine code, XLA gives the numbers and one warning says why; asked for by name, it is the error."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from functools import cache as cache_of_calls
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.data.open_experiment import open_experiment
from smajax.engine import (
    EngineError,
    EngineWarning,
    Unsupported,
    arithmetic,
    cache,
    equations,
    jax_versions,
    kernel,
    native,
    translation,
)
from smajax.engine import program as compiled_program
from smajax.engine.facade import _programs
from smajax.fit.experiment_problem import declared_problem
from smajax.fit.outputs_of_runs import predicted_and_derivatives
from smajax.model.presets import build
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.engine_results import summed
from tests.helpers.often import often
from tests.helpers.small_bench import smajax

DEMO = Path(__file__).parents[2] / "smajax" / "data" / "demo" / "latent" / "experiment.toml"
Break = Callable[[pytest.MonkeyPatch], object]


def _demo() -> tuple[np.ndarray, np.ndarray]:
    """What the demo's sensors show at the start of its fit, and all slopes: what every fit of it is made of."""
    experiment = open_experiment(DEMO)
    problem = declared_problem(experiment, [run for run in experiment.runs if run.role == "fit"][:1])
    start = np.asarray(problem.start_values())
    return predicted_and_derivatives(problem, start[None], np.eye(len(start))[None])


def _coupon() -> tuple[np.ndarray, np.ndarray]:
    """Strain and fraction of a heated coupon."""
    coupon = build("flexinol_table_3_2", "coupon", "none")
    run = simulate_compiled(coupon, {"temperature": jnp.linspace(20.0, 110.0, 50), "stress": jnp.full(50, 1e8)}, 1.0)
    return np.asarray(run.strain), np.asarray(run.martensite_fraction)


RUNS: dict[str, Callable[[], tuple[np.ndarray, np.ndarray]]] = {"a coupon": _coupon, "the demo": _demo}


@cache_of_calls
def right(run: str) -> tuple[np.ndarray, np.ndarray]:
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("SMAJAX_ENGINE", "native")
        return RUNS[run]()


def _fails(message: str) -> Callable[..., Any]:
    def failing(*_: Any, **__: Any) -> Any:
        raise RuntimeError(message)

    return failing


def _without_llvmlite(patched: pytest.MonkeyPatch) -> None:
    for name in ("llvmlite", "llvmlite.binding"):
        patched.setitem(sys.modules, name, None)


# What is broken -> (how, what the warning says, the error under "native").
BROKEN: dict[str, tuple[Break, str, type[Exception]]] = {
    "a primitive that is unknown": (
        lambda patched: patched.setattr(
            equations, "ELEMENTWISE", {name: one for name, one in arithmetic.ELEMENTWISE.items() if name != "max"}
        ),
        "the operation `max`",
        Unsupported,
    ),
    "a parameter renamed": (
        lambda patched: patched.setattr(
            jax_versions,
            "TABLE",
            {**jax_versions.TABLE, "scan": {**jax_versions.TABLE["scan"], "carry": ("carried", "borne")}},
        ),
        "`scan` of this version of JAX: it has no parameter that says its carry",
        Unsupported,
    ),
    "a group of a scan's arguments renamed": (
        lambda patched: patched.setattr(
            jax_versions,
            "TABLE",
            {**jax_versions.TABLE, "scan": {**jax_versions.TABLE["scan"], "constants": (jax_versions._counted(7),)}},
        ),
        "no parameter that says its constants",
        Unsupported,
    ),
    "a fault of the translator": (
        lambda patched: patched.setattr(translation, "row", _fails("out of step")),
        "RuntimeError: out of step, while the operation `scan` was translated",
        RuntimeError,
    ),
    "LLVM refuses the text": (
        lambda patched: (
            patched.setattr(native, "compiled", _fails("expected type")),
            patched.setattr(cache, "load", lambda key: None),
        )[0],
        "RuntimeError: expected type",
        RuntimeError,
    ),
    "machine code that does not load": (
        lambda patched: patched.setattr(native, "Kernel", _fails("no such section")),
        "no such section",
        RuntimeError,
    ),
    "no llvmlite": (
        _without_llvmlite,
        "machine code needs llvmlite",
        ImportError,
    ),
}


@pytest.mark.usefixtures("forgetful")
@pytest.mark.parametrize(
    ("run", "what"), often(itertools.product(RUNS, BROKEN), [("a coupon", what) for what in BROKEN])
)
def test_xla_gives_the_same_numbers_when_machine_code_fails(
    run: str, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = right(run)
    _programs.clear()
    broken, said, error = BROKEN[what]
    broken(monkeypatch)
    with pytest.warns(EngineWarning, match=said) as told:
        found = RUNS[run]()
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9 * float(np.abs(other).max()))
    (line,) = {str(one.message) for one in told}
    assert "several times slower" in line
    if error is not ImportError:
        assert f"jax {jax.__version__}" in line
        assert "smajax doctor --json" in line
    _programs.clear()
    monkeypatch.setenv("SMAJAX_ENGINE", "native")
    with pytest.raises(error):
        RUNS[run]()


@pytest.mark.usefixtures("forgetful")
@pytest.mark.slow  # of a coupon in `test_engine_cache`
@pytest.mark.parametrize("run", RUNS)
def test_a_corrupt_cache_entry_is_compiled_again(run: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No warning, the same numbers, and a sound entry afterwards."""
    expected = right(run)
    _programs.clear()
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    RUNS[run]()
    (entry,) = tmp_path.iterdir()
    sound = entry.read_bytes()
    entry.write_bytes(sound[:100] + bytes(len(sound) - 100))
    _programs.clear()
    np.testing.assert_array_equal(RUNS[run]()[0], expected[0])
    assert entry.read_bytes() == sound


@pytest.mark.usefixtures("forgetful")
def test_a_reason_is_warned_of_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two programs of different rigs, with Python's own filters."""
    monkeypatch.setattr(native, "compiled", _fails("expected type"))
    monkeypatch.setattr(cache, "load", lambda key: None)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("default")
        for load, held in (("coupon", {"stress": jnp.full(5, 1e8)}), ("strain_coupon", {"strain": jnp.full(5, 0.01)})):
            rig = build("flexinol_table_3_2", load, "none")
            simulate_compiled(rig, {"temperature": jnp.full(5, 25.0), **held}, 0.01)
    assert sum("expected type" in str(one.message) for one in told) == 1


@pytest.mark.usefixtures("forgetful")
@pytest.mark.parametrize("beside", [False, True])
def test_a_failure_while_machine_code_runs_is_taken_over_by_xla(beside: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a call and beside the caller, with one warning; asked for by name, it is the error."""
    values = np.arange(3.0)

    def run(engine: Any) -> Any:
        made = compiled_program(summed, jnp.asarray(1.0), ("a",), engine=engine)
        if not beside:
            return made(jnp.asarray(1.0), {"a": values})
        devices = tuple(jax.local_devices())
        return made.begin(jnp.asarray(1.0), {"a": values}, 1, devices, 8, 8)()

    monkeypatch.setattr(native.NativeProgram, "__call__", _fails("out of room"))
    with pytest.warns(EngineWarning, match="failed while it ran, so XLA runs it.*RuntimeError: out of room") as told:
        np.testing.assert_allclose(run("auto"), values + 1.0)
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_allclose(run("auto"), values + 1.0)
    with pytest.raises(RuntimeError, match="out of room"):
        run("native")


@pytest.mark.usefixtures("forgetful")
def test_an_unresolved_symbol_does_not_end_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """LLVM's linker ends the process for it; under "auto" XLA runs the program, under "native" it is an error."""
    import llvmlite.binding as llvm

    def nowhere(*_: Any) -> bytes:
        text = "declare double @no_such_function(double)\ndefine double @runs(double %x) {\n"
        text += "  %y = call double @no_such_function(double %x)\n  ret double %y\n}\n"
        return bytes(kernel._machine().emit_object(llvm.parse_assembly(text)))

    if not sys.platform.startswith("linux"):
        pytest.skip("object files of other systems are not read")
    monkeypatch.setattr(native, "compiled", nowhere)
    monkeypatch.setattr(cache, "folder", lambda: None)
    with pytest.raises(kernel.UnresolvedSymbol, match="calls no_such_function, which"):
        compiled_program(summed, jnp.asarray(1.0), ("a",), engine="native")
    with pytest.warns(EngineWarning, match="no_such_function"):
        made = compiled_program(summed, jnp.asarray(1.0), ("a",))
    np.testing.assert_allclose(made(jnp.asarray(1.0), {"a": np.arange(3.0)}), np.arange(3.0) + 1.0)


@pytest.mark.usefixtures("forgetful")
def test_a_program_that_is_compiled_beside_gives_the_same_and_fails_as_any_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    values = np.arange(3.0)
    monkeypatch.setattr(cache, "folder", lambda: None)
    made = compiled_program(summed, jnp.asarray(1.0), ("a",), beside=True)
    made.wait()
    assert made.native is not None
    np.testing.assert_allclose(made(jnp.asarray(1.0), {"a": values}), values + 1.0)
    _programs.clear()
    monkeypatch.setattr(native, "compiled", _fails("no machine"))
    made = compiled_program(summed, jnp.asarray(1.0), ("a",), beside=True)
    made.wait()
    with pytest.warns(EngineWarning, match="RuntimeError: no machine"):
        results = made(jnp.asarray(1.0), {"a": values})
    np.testing.assert_allclose(results, values + 1.0)
    assert made.native is None


@pytest.mark.usefixtures("forgetful")
def test_an_exception_of_the_function_is_raised_by_every_engine() -> None:
    def impossible(model: Any, own: dict[str, Any]) -> Any:
        raise KeyError("no such load")

    for engine in ("auto", "native", "xla"):
        with pytest.raises(KeyError, match="no such load"):
            compiled_program(impossible, None, ("a",), engine=engine)(None, {"a": np.ones(3)})


def test_an_unknown_engine_is_an_error_with_the_valid_choices(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = build("niti_table_3_1", "arm", "amplified_voltage")
    with pytest.raises(EngineError, match=r"engine is 'llvm'; expected one of auto, native, xla"):
        simulate_compiled(arm, {"voltage": jnp.full(5, 5.0)}, engine="llvm")  # type: ignore[arg-type]
    monkeypatch.setenv("SMAJAX_ENGINE", "gpu")
    with pytest.raises(EngineError, match=r"SMAJAX_ENGINE is 'gpu'"):
        simulate_compiled(arm, {"voltage": jnp.full(5, 5.0)})
    told = smajax("doctor")
    assert told.code == 2
    assert "SMAJAX_ENGINE is 'gpu'" in told.said
    assert "Traceback" not in told.said


def test_the_old_name_of_the_engine_works_for_one_version() -> None:
    with pytest.warns(DeprecationWarning, match='"native" now'):
        run = compiled_program(lambda model, own: own["a"] + 1.0, None, ("a",), engine="lanes")  # type: ignore[arg-type]
    assert run.native is not None


def test_the_engine_knows_nothing_of_wires_files_or_reports() -> None:
    code = (
        "import sys\n"
        "for name in ('jinja2', 'pydantic', 'xarray', 'matplotlib', 'pint', 'typer', 'rich', 'llvmlite'): sys.modules[name] = None\n"
        "import smajax.engine\n"
        "print(*sorted(name for name in sys.modules if name.startswith('smajax.')))"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {".".join(name.split(".")[:2]) for name in loaded} == {"smajax.core", "smajax.engine"}


MOVED = """
import sys, warnings
import jax.{module}
del jax.{module}.{name}
import numpy as np
import smajax as sma
from smajax.engine import EngineWarning, program
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    run = program(lambda model, own: model * own["a"], np.float64(2.0), ("a",))
    print(run(np.float64(2.0), dict(a=np.arange(3.0))).tolist(), [str(one.message) for one in told if one.category is EngineWarning])
"""


@pytest.mark.parametrize(
    ("module", "name"),
    [
        pytest.param("extend.random", "threefry_prng_impl", marks=pytest.mark.slow),
        ("interpreters.partial_eval", "dce_jaxpr"),
    ],
)
def test_a_name_that_jax_has_moved_leads_to_xla(module: str, name: str) -> None:
    """The translator imports names of JAX that a release may move: nothing of smajax but machine code needs them."""
    code = MOVED.format(module=module, name=name)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "SMAJAX_ENGINE": "auto"}
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("[0.0, 2.0, 4.0] [")
    assert "machine code of a program could not be made" in done.stdout
    assert name in done.stdout
    assert "llvmlite, which cannot be imported" not in done.stdout


@pytest.mark.usefixtures("forgetful")
def test_a_reason_is_warned_of_once_whatever_changes_the_filters(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python's own memory of what was shown ends where any library changes a filter."""
    monkeypatch.setattr(native, "translate", _fails("out of step"))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for value in (1.0, 2.0):  # a number is part of the program: two programs
            compiled_program(summed, value, ("a",))
    assert len([one for one in told if one.category is EngineWarning]) == 1


@pytest.mark.usefixtures("forgetful")
def test_arithmetic_with_a_parameter_that_is_not_read_is_done_by_xla(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a later release may add one: machine code that passed it over would give other numbers."""
    monkeypatch.setattr(
        jax_versions, "TABLE", {**jax_versions.TABLE, "integer_pow": {}}
    )  # its power is not read any more

    def cubed(model: Any, own: Any) -> Any:
        return model * jax.lax.integer_pow(own["a"], 3)

    with pytest.warns(EngineWarning, match="`integer_pow` with `y=3`"):
        run = compiled_program(cubed, np.array(2.0), ("a",))
    np.testing.assert_allclose(run(np.array(2.0), {"a": np.array([1.0, 2.0])})[1], 16.0)
