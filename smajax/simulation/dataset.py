"""Trajectories as labelled arrays: an `xarray.Dataset` over time, with units and where it comes from."""

from __future__ import annotations

import json
from collections.abc import Mapping

import jax
import numpy as np
import xarray as xr

from smajax.core.files import json_line
from smajax.core.parameters import check_bounds
from smajax.core.provenance import provenance
from smajax.engine import Engine
from smajax.model.channels import INPUT_UNITS
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Series, State, Trajectory
from smajax.simulation.compiled import measured_run
from smajax.simulation.integration_error import AUTO, IntegrationError, Tolerance
from smajax.simulation.measures import SHOWN
from smajax.simulation.sensors import SENSORS, sensor_output
from smajax.simulation.simulate import DEFAULT_STEP, check_kinds

LABELS = {"martensite_fraction": "martensite fraction", "reading": "reading of the load's sensor"}


def _units(system: System) -> dict[str, str]:
    moves = isinstance(system.load, AbstractMovingLoad)
    length = system.load.position_unit if isinstance(system.load, AbstractMovingLoad) else "-"
    own = {"position": length, "velocity": f"{length}/s" if moves else "1/s", "reading": system.load.reading[1]}
    return {**SHOWN, **SENSORS, "detwinned_fraction": "-", **own}


def labelled_run(
    system: System,
    run: Trajectory,
    inputs: Mapping[str, Series] | None = None,
    error: IntegrationError | None = None,
    **settings: object,
) -> xr.Dataset:
    """A trajectory as a data set over `time` (s), every variable with `units` (SI, degC, rad) and `long_name`.

    inputs: series of shape (n,) that are stored beside it. error: of the integration, which becomes attributes (`with_error`).
    settings: attributes, such as `dt`; `unsolved_stages` counts the stages that did not converge. Force on the wire (N) and its
    resistance (ohm) are computed from the states.
    """
    units = _units(system)
    names = [name for name in units if hasattr(run, name)]
    columns = {name: np.asarray(getattr(run, name)) for name in names}
    columns |= {name: np.asarray(sensor_output(system, run, name)) for name in ("force", "resistance")}
    columns_in = {name: np.asarray(values) for name, values in (inputs or {}).items() if name not in columns}
    units |= {name: INPUT_UNITS.get(name, "N m" if name == "load_torque" else "") for name in columns_in}
    data = {
        name: ("time", values, {"units": units[name], "long_name": LABELS.get(name, name.replace("_", " "))})
        for name, values in {**columns_in, **columns}.items()
    }
    settings = {"unsolved_stages": int(np.asarray(run.unsolved)[-1]), **settings}
    time = ("time", np.asarray(run.time), {"units": "s", "long_name": "time"})
    result = xr.Dataset(data, {"time": time}, provenance(system, **settings))
    return result if error is None else with_error(result, error)


def with_error(result: xr.Dataset, error: IntegrationError) -> xr.Dataset:
    """`result` with what its integration leaves in it: as a whole (JSON), and of each variable the root mean square in its unit.

    A temperature's is in K.
    """
    result.attrs["integration_error"] = json_line(error.record())
    return errors_by_variable(result)


def errors_by_variable(result: xr.Dataset) -> xr.Dataset:
    """The root mean squares of the attribute `integration_error` as attributes of the variables too."""
    error = json.loads(result.attrs.get("integration_error", "{}"))
    for name, one in error.get("outputs", {}).items():
        if name in result and one["rms"] is not None:
            result[name].attrs["integration_error"] = one["rms"]
    return result


def simulate_dataset(
    system: System,
    inputs: Mapping[str, Series],
    dt: float = DEFAULT_STEP,
    tolerance: Tolerance = AUTO,
    initial: State | None = None,
    engine: Engine = "auto",
) -> xr.Dataset:
    """`simulate` as an `xarray.Dataset`: `found["position"].plot()` has axes with units, `sma.plot(found)` draws them all.

    `dt` is the clock of inputs and results. How finely a run is integrated in between follows from its error, measured against a far finer
    integration: less than 3e-4 of a whole transformation is left, and the attribute `integration_error` (JSON; of each variable the root
    mean square) says what was reached. A number for `tolerance` is taken as it is; None is one step a sample, of which nothing is measured.
    Other arguments as `simulate_compiled`'s. For a call by itself: inside `jit`, `vmap` and `grad` take `simulate`. Raises ValueError as these do, and
    for a parameter out of its bounds.
    """
    check_kinds(system, inputs)
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves((system, dict(inputs), dt, initial))):
        raise TypeError(
            "simulate_dataset() gives labelled numbers, and no gradient, jit or vmap goes through it: use `sma.simulate`, which "
            "gives the same series with the `integration` that you choose."
        )
    check_bounds(system)
    run, error = measured_run(system, inputs, dt, tolerance, initial, engine)
    return labelled_run(system, run, inputs, error, dt=dt, tolerance="none" if tolerance is None else tolerance)
