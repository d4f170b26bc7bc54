"""A controller in C, with its estimator, commands what the package's own commands, and compiles without a warning anywhere."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.loop_around import loop_around
from smajax.control.loop_dataset import Loop
from smajax.control.measured_state import Sensor
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import clock, sine, steps
from smajax.export.controller import SHORT, check_reads, controller_block
from smajax.export.errors import ExportError
from smajax.export.single_precision import DOUBLE, ENOUGH, SINGLE, measured, single_build
from smajax.export.source import CSource, c_source
from smajax.model.presets import build
from smajax.model.rigs import arm
from tests.helpers.c_programs import STRICT, Running, compiled_c, needs_gcc
from tests.helpers.machine_code import by_machine_code

RUN = by_machine_code(simulate_closed_loop)
ARM = arm()
PERIOD, NAME = 0.01, "own"
SANITIZED = ["-O1", "-g", "-fsanitize=undefined", "-fno-sanitize-recover=undefined", "-ffp-contract=off"]


def source_of(loop: Loop, controller: str, delay: int = 0) -> CSource:
    known = CONTROLLERS[controller].known
    return c_source(
        lambda: controller_block(loop.system, loop.controller, loop.estimator, PERIOD, delay, NAME, known), NAME, SHORT
    )


def rounded(readings: np.ndarray) -> np.ndarray:
    """What single-precision numbers hold of them."""
    return readings.astype(np.float32).astype(float)


def loop_and_readings(loop: Loop, number: int, delay: int, noise: float = 1e-4) -> tuple[Any, np.ndarray]:
    """A closed loop of the package, steps or a sine with a noisy sensor, and what its sensor read at each call. noise: of the stroke."""
    low, stroke = (-0.6, 0.9) if loop.system.load.reading[1] == "rad" else (0.0, 0.008)
    time, key = clock(3.0, PERIOD), jax.random.key(number)
    positions = [low + 0.5 * stroke, low + 0.9 * stroke, low + 0.2 * stroke]
    wanted = sine(time, low + 0.5 * stroke, 0.3 * stroke, 0.4) if number % 2 else steps(time, positions, 1.0)
    sensor = Sensor(noise_sigma=noise * stroke)
    between = {"estimator": loop.estimator, "sensor": sensor, "key": key, "delay": delay}
    run = RUN(loop.system, loop.controller, wanted, PERIOD, **between)
    drawn = jax.random.normal(key, (len(time) - 1,))
    return run, np.asarray(sensor.reading(jnp.asarray(run.run.reading[:-1]), drawn))


def commands(instance: Running, run: Any, readings: np.ndarray) -> np.ndarray:
    """What the C commands where it reads what the package's controller read."""
    wanted = run.wanted
    series = np.stack(
        [readings, *(np.asarray(one)[:-1] for one in (wanted.position, wanted.velocity, wanted.acceleration))]
    )
    names = ("reading", "set_point", "set_point_rate", "set_point_acceleration")
    return np.asarray([instance.run(dict(zip(names, row, strict=True)))["command"] for row in series.T])


SPRING = build("flexinol_table_3_2", "bias_spring", "flexinol_voltage")
QUICK = [("pid", None, 0), ("vsc3", None, 2), ("sld", "printed", 0)]
OTHERS = [
    ("backstepping2", "model", 1),
    *((name, None, 0) for name in ("vsc1", "vsc2")),
    *((name, "model", 0) for name in ("pid", "nvsc", "sld", "backstepping1")),
    ("sld", "adaptive", 1),
    ("receding_horizon", "model", 1),
    *((name, "printed", 0) for name in ("nvsc", "backstepping1", "backstepping2")),
]


Made = tuple[Loop, Callable[[], Running]]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Made]:
    """(the loop, its controller in C) of a load, each translated and compiled once."""

    @cache
    def source(load: str, controller: str, estimator: str | None, delay: int) -> tuple[Loop, CSource]:
        loop = loop_around({"arm": ARM, "spring": SPRING}[load], controller, estimator=estimator, delay=delay)
        return loop, source_of(loop, controller, delay)

    @cache
    def of(
        controller: str,
        estimator: str | None,
        delay: int = 0,
        load: str = "arm",
        kind: str = DOUBLE,
        arithmetic: str = "",
    ) -> Made:
        loop, text = source(load, controller, estimator, delay)
        return loop, compiled_c(text, tmp_path_factory.mktemp("c"), kind, SANITIZED, arithmetic)

    return of


def with_last_bits_changed(make: Callable[[], Running], run: Any, readings: np.ndarray) -> np.ndarray:
    """How far the commands so far come from `commands` if every other reading has its last bits changed."""
    changed = commands(make(), run, readings * np.where(np.arange(len(readings)) % 2, 1.0, 1.0 + 4e-16))
    return np.maximum.accumulate(np.abs(changed - commands(make(), run, readings)))


def hold_against_the_package(case: Made, delay: int = 0, amplifies: bool = False) -> None:
    """Commands equal to 1e-9 of the largest in double precision.

    amplifies: of a loop that makes up to 1e-7 of a reading's last bits, also to ten times what it makes of them.
    """
    loop, make = case
    for number in range(2):
        run, readings = loop_and_readings(loop, number, delay)
        expected = np.asarray(run.voltage)[:-1]
        assert np.ptp(expected) > 1.0
        allowed, largest = np.full(len(expected), 1e-9), np.max(np.abs(expected))
        if amplifies:
            grown = with_last_bits_changed(make, run, readings) / largest
            assert grown[-1] < 1e-7
            allowed = np.maximum(allowed, 10.0 * grown)
        assert np.all(np.abs(commands(make(), run, readings) - expected) <= allowed * largest)


@needs_gcc
@pytest.mark.parametrize(("controller", "estimator", "delay"), QUICK)
def test_a_controller_in_c_commands_what_the_package_commands(controller, estimator, delay, made):
    hold_against_the_package(made(controller, estimator, delay), delay)


@pytest.mark.slow
@needs_gcc
@pytest.mark.parametrize(("controller", "estimator", "delay"), OTHERS)
def test_every_other_controller_does_too(controller, estimator, delay, made):
    hold_against_the_package(made(controller, estimator, delay), delay)


@pytest.mark.slow
@needs_gcc
@pytest.mark.parametrize("controller", ["pid", "vsc3", "nvsc", "sld", "backstepping2"])
def test_on_another_load_too(controller, made):
    case = made(controller, None if controller in ("pid", "vsc3") else "model", load="spring")
    hold_against_the_package(case, amplifies=controller == "sld")


@pytest.mark.slow
@needs_gcc
def test_a_loop_that_makes_volts_of_a_rounding_is_equal_until_it_has(made):
    """Backstepping I on the spring: it differences the estimated stress, and the filter believes the command that follows.

    With a noisy sensor a change of a reading by its last bit doubles with every call, to volts after 40. So these commands have no
    value that could be held to 1e-9, whoever computes them; those of the calls before have, and all of a loop without noise.
    """
    loop, make = made("backstepping1", "model", load="spring")
    for number, noise in ((0, 0.0), (0, 1e-4), (1, 1e-4)):
        run, readings = loop_and_readings(loop, number, 0, noise)
        found, expected = commands(make(), run, readings), np.asarray(run.voltage)[:-1]
        grown = with_last_bits_changed(make, run, readings) / np.max(expected)
        equal = grown < 1e-10
        assert np.all(equal) if noise == 0.0 else 10 <= np.sum(equal) < 60
        assert grown[-1] < 1e-9 if noise == 0.0 else grown[-1] > 0.1
        assert np.ptp(expected[equal]) > 1.0
        assert np.max(np.abs(found - expected)[equal]) < 1e-9 * np.max(expected)


def test_a_controller_that_reads_states_needs_an_estimator():
    with pytest.raises(
        ExportError, match=r"`sld` cannot be exported without an estimator: it reads the velocity, stress"
    ):
        check_reads(source_of(loop_around(ARM, "sld"), "sld"), "`sld`", estimated=False)


def hold_single_against_double(
    of: Callable[..., Made], case: tuple[Any, ...], arithmetic: str, load: str = "arm"
) -> None:
    """At readings that single precision holds: to 1e-5 of the largest; where the arithmetic is double, rounded commands and no more."""
    controller, estimator, delay = case
    loop, double = of(controller, estimator, delay, load)
    _, single = of(controller, estimator, delay, load, SINGLE, arithmetic)
    run, readings = loop_and_readings(loop, 1, delay)
    expected, found = (commands(make(), as_single(run), rounded(readings)) for make in (double, single))
    assert np.ptp(expected) > 1.0
    assert np.max(np.abs(found - expected)) < 1e-5 * np.max(np.abs(expected))
    if arithmetic == DOUBLE:
        np.testing.assert_array_equal(found, rounded(expected))


def as_single(run: Any) -> Any:
    """The run with the set points that single precision holds."""
    return eqx.tree_at(lambda one: one.wanted, run, jax.tree.map(lambda one: rounded(np.asarray(one)), run.wanted))


@needs_gcc
@pytest.mark.parametrize("case", QUICK)
def test_with_single_inputs_and_outputs_commands_are_the_doubles_rounded(case, made):
    hold_single_against_double(made, case, DOUBLE)


@pytest.mark.slow
@needs_gcc
@pytest.mark.parametrize("case", OTHERS)
def test_so_they_are_of_every_other_pair(case, made):
    hold_single_against_double(made, case, DOUBLE)


@needs_gcc
@pytest.mark.parametrize("case", [("vsc2", None, 0), *QUICK])
def test_in_single_arithmetic_these_commands_are_within_its_rounding(case, made):
    """`printed` makes more of a reading's rounding than of its own (the study)."""
    hold_single_against_double(made, case, SINGLE)


def test_single_arithmetic_is_what_was_measured_to_be_enough_for_every_loop():
    assert single_build("vsc2", "", 0.01).arithmetic == SINGLE
    assert single_build("vsc2", "", 0.001).arithmetic == DOUBLE  # a shorter period than was measured
    for known, found in measured().items():
        assert single_build(*known, 0.01).arithmetic == (SINGLE if found.largest < ENOUGH else DOUBLE)
    asked, unknown = single_build("sld", "model", 0.01, SINGLE), single_build("of my own", "", 0.01)
    assert asked.arithmetic == SINGLE
    assert asked.measured is not None
    assert asked.measured.within < 1.0
    assert f"in {100 * asked.measured.within:.4g} % of 10,000 closed loops" in asked.accuracy()
    assert unknown.arithmetic == DOUBLE
    assert unknown.accuracy() == "How far results of single-precision arithmetic are off was not measured."


@needs_gcc
def test_a_command_that_is_no_number_is_zero_from_there_on(tmp_path):
    instance = compiled_c(source_of(loop_around(ARM, "pid"), "pid"), tmp_path)()
    assert instance.run({"reading": 0.0, "set_point": 0.3})["command"] > 0.0
    assert instance.run({"reading": float("nan")})["command"] == 0.0
    assert instance.run({"reading": 0.0})["command"] == 0.0
    instance.call("init")
    assert instance.run({"reading": 0.0})["command"] > 0.0


BOARD = r"""
#include <math.h>
#include "bench.c"
static double position = 0.0, volts = 0.0;
static int left = 600;
float read_position(void) { return (float)position; }
void write_voltage(float value) { volts = value; }
int wait_for_the_next_period(void)
{
    position += 0.01 * (0.001 * volts - position); /* something that follows */
    return left-- > 0;
}
static void at_end(void) { if (!(fabs(position - 0.004) < 1e-4) || volts != 0.0) { _Exit(1); } }
__attribute__((constructor)) static void ask(void) { atexit(at_end); }
"""


@needs_gcc
@pytest.mark.parametrize("single", [0, 1])
def test_the_bench_of_the_how_to_page_runs_in_twenty_lines(single, tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "to-a-microcontroller.md").read_text("utf-8")
    bench = page.partition('```c title="bench.c"\n')[2].partition("```")[0]
    assert len(bench.splitlines()) <= 20
    pid = loop_around(SPRING, "pid").controller
    source = c_source(lambda: controller_block(SPRING, pid, None, PERIOD, 0, "pid"), "pid", SHORT)
    files = {
        "bench.c": bench,
        "board.c": f"#include <stdlib.h>\n{BOARD}",
        "pid.h": source.header,
        "pid.c": source.source,
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    sanitizers = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", f"-DSMAJAX_SINGLE={single}"]
    subprocess.run(["gcc", *STRICT, *sanitizers, "board.c", "pid.c", "-o", "bench", "-lm"], cwd=tmp_path, check=True)
    refused = subprocess.run(
        ["gcc", "-ffast-math", "-c", "pid.c", "-o", "fast.o"], cwd=tmp_path, capture_output=True, text=True
    )
    assert refused.returncode != 0
    assert "without -ffast-math" in refused.stderr
    subprocess.run(["./bench"], cwd=tmp_path, check=True, timeout=20)


@needs_gcc
def test_the_files_around_a_controller_of_the_simulink_page_call_it(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "to-simulink.md").read_text("utf-8")
    pid = loop_around(SPRING, "pid").controller
    source = c_source(lambda: controller_block(SPRING, pid, None, PERIOD, 0, "pid"), "pid", SHORT)
    files = {name: page.partition(f'```c title="{name}"\n')[2].partition("```")[0] for name in ("loop.h", "loop.c")}
    for name, text in {**files, "pid.h": source.header, "pid.c": source.source}.items():
        (tmp_path / name).write_text(text)
    subprocess.run(
        ["gcc", *STRICT, "-fPIC", "-shared", "loop.c", "pid.c", "-o", "loop.so", "-lm"], cwd=tmp_path, check=True
    )
    library = ctypes.CDLL(str(tmp_path / "loop.so"))
    library.loop_call.restype = ctypes.c_double
    library.loop_start()
    direct = compiled_c(source, tmp_path)()
    found = [library.loop_call(ctypes.c_double(reading), ctypes.c_double(0.004)) for reading in (0.0, 1e-4, 3e-4)]
    expected = [direct.run({"reading": reading, "set_point": 0.004})["command"] for reading in (0.0, 1e-4, 3e-4)]
    assert found == expected
    assert min(found) > 0.0
