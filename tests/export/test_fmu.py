"""An FMU of the plant and of a controller, run by FMPy and by a master in C: valid, equal to the package, rolled back, many at once."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.loop_around import loop_around
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import clock, steps
from smajax.export import fmu as units
from smajax.export.controller import controller_block
from smajax.export.errors import ExportError
from smajax.export.fmu import fmu
from smajax.export.model_description import Variables, exponents
from smajax.export.plant import plant_block
from smajax.export.source import CSource, c_source
from smajax.model.presets import build
from smajax.model.rigs import arm
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.steppers import Integration
from studies.exported_code.slave import Slave
from tests.helpers.c_programs import STRICT, needs_gcc
from tests.helpers.machine_code import by_machine_code

pytestmark = needs_gcc
ARM, PERIOD, TOLERANCE = arm(), 0.01, 1e-5


@pytest.fixture(scope="module")
def fmpy() -> Any:
    return pytest.importorskip("fmpy", reason="needs FMPy, an FMU's client that is not ours: pip install fmpy")


@pytest.fixture(scope="module")
def plant() -> CSource:
    return c_source(lambda: plant_block(ARM, "actuator", "arm", TOLERANCE), "actuator")


@pytest.fixture(scope="module")
def controller() -> CSource:
    loop = loop_around(ARM, "pid")
    known = CONTROLLERS["pid"].known
    return c_source(lambda: controller_block(loop.system, loop.controller, None, PERIOD, 0, "pid", known), "pid")


@pytest.fixture(scope="module", autouse=True)
def quick_binaries() -> Iterator[None]:
    """The compiler takes seconds to optimise what these tests run for milliseconds."""
    flags = units.FLAGS
    units.FLAGS = tuple("-O0" if one == "-O2" else one for one in flags)
    yield
    units.FLAGS = flags


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def files(
    request: pytest.FixtureRequest, plant: CSource, controller: CSource, tmp_path_factory: Any
) -> dict[str, Path]:
    """The units in one version of the interface."""
    folder = tmp_path_factory.mktemp("units")
    paths = {source.name: folder / f"{source.name}.fmu" for source in (plant, controller)}
    for source in (plant, controller):
        paths[source.name].write_bytes(fmu(source, request.param))
    return paths


def volts(time: np.ndarray) -> np.ndarray:
    return np.where(time < 0.9, 14.0, np.where(time < 1.4, 2.0, 12.0))


def test_the_checker_of_fmpy_finds_nothing(fmpy, files):
    from fmpy.validation import validate_fmu

    for path in files.values():
        assert validate_fmu(str(path)) == []
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
        assert any(name.startswith("binaries/") for name in names)
        assert f"sources/{path.stem}.c" in names


SHOWN = ("reading", "temperature", "martensite_fraction", "stress")


def open_loop(slave: Slave, seconds: float) -> dict[int, list[float]]:
    """Two seconds by communication steps of `seconds`: the outputs by their number of 5 ms."""
    slave.begin(voltage=float(volts(np.zeros(1))[0]))
    found = {0: slave.get(*SHOWN)}
    for k in range(round(2.0 / seconds)):
        slave.set(voltage=float(volts(np.asarray(k * seconds + 1e-9))))
        slave.step(k * seconds, seconds)
        at = (k + 1) * seconds / 0.005
        if abs(at - round(at)) < 1e-6:
            found[round(at)] = slave.get(*SHOWN)
    slave.close()
    return found


def test_an_open_loop_is_the_packages_whatever_the_communication_step(fmpy, files, tmp_path):
    inputs = {"voltage": jnp.asarray(volts(np.arange(401) * 0.005))}
    run, exact = (
        np.stack([getattr(one, name) for name in SHOWN], axis=1)
        for one in (simulate_compiled(ARM, inputs, 0.005, tolerance=size) for size in (TOLERANCE, 1e-3 * TOLERANCE))
    )
    assert np.ptp(run[:, 2]) > 0.9, "the wire transforms"
    # What the integration leaves in the package's own run at this tolerance.
    left = np.max(np.abs(run - exact), axis=0)
    assert left[0] < 3e-4 * np.ptp(exact[:, 0])
    for seconds in (0.001, 0.005, 0.05):
        found = open_loop(Slave(files["actuator"], tmp_path), seconds)
        rows, places = np.asarray(list(found.values())), list(found)
        assert len(places) == {0.001: 401, 0.005: 401, 0.05: 41}[seconds]
        assert np.all(np.max(np.abs(rows - exact[places]), axis=0) <= 2.0 * left)
        if seconds >= 0.005:  # the package's own steps
            np.testing.assert_allclose(rows, run[places], rtol=1e-9, atol=1e-9)


def test_parameters_inputs_and_a_state_that_is_gone_back_to(fmpy, files, tmp_path):
    slave = Slave(files["actuator"], tmp_path).begin(voltage=14.0, payload_mass=0.08, ambient_temperature=30.0)
    assert slave.get("temperature")[0] == 30.0
    slave.step(0.0, 0.6)
    saved, before = slave.state(), slave.get("reading", "temperature", "time")
    slave.step(0.6, 0.4)
    there = slave.get("reading", "temperature")
    assert abs(there[0] - before[0]) > 1e-3
    slave.back_to(saved)
    assert slave.get("reading", "temperature", "time") == before
    slave.step(0.6, 0.4)
    assert slave.get("reading", "temperature") == there
    data = slave.unit.serializeFMUState(saved) if slave.three else slave.unit.serializeFMUstate(saved)
    other = Slave(files["actuator"], tmp_path).begin()
    other.back_to(other.unit.deserializeFMUState(data) if slave.three else other.unit.deSerializeFMUstate(data))
    other.step(0.6, 0.4)
    assert other.get("reading", "temperature") == there
    # A fixed parameter is not set any more; one out of its bounds ends the initialization.
    with pytest.raises(Exception, match="Set"):
        slave.set(payload_mass=0.1)
    with pytest.raises(Exception, match="ExitInitializationMode"):
        Slave(files["actuator"], tmp_path).begin(wire_length=-1.0)


def test_a_closed_loop_of_two_units_is_the_packages(fmpy, files, tmp_path):
    wanted = steps(clock(2.0, 0.5 * PERIOD), [0.2, -0.4], 1.0)
    loop = loop_around(ARM, "pid")
    integration = Integration(jnp.asarray(TOLERANCE))
    run = by_machine_code(simulate_closed_loop)(
        loop.system, loop.controller, wanted, 0.5 * PERIOD, 2, integration=integration
    )
    plant, pid = (Slave(files[name], tmp_path) for name in ("actuator", "pid"))
    plant.begin()
    pid.begin()
    readings, commands = plant.get("reading"), []
    # At each sample the controller goes first: it acts at the start of its step, and the plant has its command over the same one.
    # The controller's step is cut into two, of which it acts in the first.
    for k in range(200):
        pid.set(reading=readings[-1], set_point=float(wanted.position[2 * k]))
        pid.step(k * PERIOD, 0.3 * PERIOD)
        pid.step((k + 0.3) * PERIOD, 0.7 * PERIOD)
        commands += pid.get("command")
        plant.set(voltage=commands[-1])
        plant.step(k * PERIOD, PERIOD)
        readings += plant.get("reading")
    assert np.ptp(commands) > 5.0
    np.testing.assert_allclose(readings, run.run.reading[::2], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(commands, run.voltage[:-1:2], rtol=0.0, atol=1e-7)


MASTER = r"""
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "unit.c"
#include "fmi2.c"

#define MANY 10000

static void message(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text, ...)
{
    va_list more;
    (void)e; (void)s; (void)category;
    fprintf(stderr, "%s: ", name);
    va_start(more, text);
    vfprintf(stderr, text, more);
    va_end(more);
}

static double reading(fmi2Component c)
{
    const fmi2ValueReference output = READING;
    double value = 0.0;
    fmi2GetReal(c, &output, 1, &value);
    return value;
}

int main(void)
{
    static const fmi2CallbackFunctions callbacks = {message, calloc, free, NULL, NULL};
    static fmi2Component all[MANY];
    const fmi2ValueReference input = VOLTAGE;
    int wrong = 0;
    size_t k;
    for (k = 0; k < MANY; k++) {
        const double volts = 2.0 + 6.0 * (double)k / MANY;
        all[k] = fmi2Instantiate("one", fmi2CoSimulation, UNIT_TOKEN, "", &callbacks, 0, 0);
        fmi2SetupExperiment(all[k], 0, 0.0, 0.0, 0, 0.0);
        fmi2EnterInitializationMode(all[k]);
        fmi2SetReal(all[k], &input, 1, &volts);
        wrong += fmi2ExitInitializationMode(all[k]) != fmi2OK;
    }
    for (k = 0; k < MANY; k++) {
        fmi2FMUstate saved = NULL, copy = NULL;
        size_t size = 0;
        char *bytes;
        double there;
        wrong += fmi2DoStep(all[k], 0.0, 0.02, 0) != fmi2OK;
        fmi2GetFMUstate(all[k], &saved);
        fmi2DoStep(all[k], 0.02, 0.02, 0);
        there = reading(all[k]);
        fmi2SerializedFMUstateSize(all[k], saved, &size);
        bytes = calloc(size, 1);
        fmi2SerializeFMUstate(all[k], saved, bytes, size);
        wrong += fmi2DeSerializeFMUstate(all[k], bytes, size, &copy) != fmi2OK;
        bytes[0] ^= 1;
        if (k == 0) {
            wrong += fmi2DeSerializeFMUstate(all[k], bytes, size, &copy) == fmi2OK;
        }
        fmi2SetFMUstate(all[k], copy);
        fmi2DoStep(all[k], 0.02, 0.02, 0);
        wrong += reading(all[k]) != there;
        fmi2FreeFMUstate(all[k], &saved);
        fmi2FreeFMUstate(all[k], &copy);
        free(bytes);
    }
    wrong += !(reading(all[MANY - 1]) > reading(all[0]) + 1e-6);
    for (k = 0; k < MANY; k++) {
        fmi2Terminate(all[k]);
        fmi2FreeInstance(all[k]);
    }
    printf("%d\n", wrong);
    return wrong != 0;
}
"""


def test_ten_thousand_instances_leak_nothing_and_touch_only_their_own(plant, tmp_path):
    """Under the compiler's own checks of memory, of leaks and of what C leaves undefined."""
    for name, text in units._sources(plant, "2.0", "{token}").items():
        (tmp_path / name).write_text(text)
    names = ["time", *(one.name for one in Variables(plant).quantities)]
    places = [f"-D{macro}={names.index(name)}" for macro, name in (("VOLTAGE", "voltage"), ("READING", "reading"))]
    (tmp_path / "master.c").write_text(MASTER)
    sanitizers = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    files = ["master.c", "actuator.c", "-o", "master", "-lm"]
    subprocess.run(["gcc", *STRICT, "-O1", *sanitizers, *places, *files], cwd=tmp_path, check=True)
    done = subprocess.run(["./master"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "0\n"), done.stderr
    assert "not a state of this unit" in done.stderr


def test_the_sources_compile_without_a_warning_for_both_versions(controller, tmp_path):
    for version in units.VERSIONS:
        for name, text in units._sources(controller, version, "{token}").items():
            (tmp_path / name).write_text(text)
        interface = f"fmi{version[0]}"
        prefix = [f"-D{interface.upper()}_FUNCTION_PREFIX=pid_"]
        for more in ([], prefix):
            for file in (f"{interface}.c", "unit.c"):
                subprocess.run(["gcc", *STRICT, *more, "-c", file, "-o", "x.o"], cwd=tmp_path, check=True)


def test_a_coupon_is_a_unit_too(fmpy, tmp_path):
    system = build("niti_table_3_1", "coupon", "none")
    source = c_source(lambda: plant_block(system, "coupon"), "coupon")
    path = tmp_path / "coupon.fmu"
    path.write_bytes(fmu(source))
    time = np.arange(101) * 0.1
    warmth, pull = 20.0 + 80.0 * np.sin(0.3 * time) ** 2, np.full(101, 1e8)
    inputs = {"temperature": jnp.asarray(warmth), "stress": jnp.asarray(pull)}
    run = simulate_compiled(system, inputs, 0.1)
    slave = Slave(path, tmp_path).begin(temperature=warmth[0], stress=pull[0])
    readings = slave.get("reading")
    for k in range(100):
        slave.set(temperature=warmth[k + 1], stress=pull[k + 1])
        slave.step(0.1 * k, 0.1)
        readings += slave.get("reading")
    assert np.ptp(readings) > 0.01
    # The unit goes along straight lines in 32 parts, the package's run in one.
    assert np.max(np.abs(readings - np.asarray(run.reading))) < 2e-3 * np.ptp(readings)


def test_what_is_no_unit_says_so(plant, monkeypatch):
    with pytest.raises(ExportError, match=r"FMI '1.0' is not written; expected 2.0 or 3.0"):
        fmu(plant, "1.0")
    monkeypatch.setattr("shutil.which", lambda name: None)
    with pytest.raises(ExportError, match="a binary needs a C compiler"):
        fmu(plant)
    with zipfile.ZipFile(__import__("io").BytesIO(fmu(plant, binary=False))) as archive:
        assert not any(name.startswith("binaries/") for name in archive.namelist())


def test_units_of_parameters_are_powers_of_si():
    assert exponents("W/(m^2 K)") == (1, 0, -3, 0, -1, 0)
    assert exponents("N m s/rad") == (1, 2, -1, 0, 0, -1)
    assert exponents("V/(rad s)") == (1, 2, -4, -1, 0, -1)
    assert exponents("rad or m") is None
