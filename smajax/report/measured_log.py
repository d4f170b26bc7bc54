"""A run held against a log: how far it is off, and the log in its picture."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from smajax.control.run_request import MEASURED
from smajax.control.run_result import RunResult
from smajax.core.display_units import digits, display, label
from smajax.report.drawing import GREY


def measured_of(data: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    """Sensor -> (variable of the run, measured series (n,)) of the logs that the run is held against."""
    return {
        str(name).removeprefix(MEASURED): (str(one.attrs["of"]), one.to_numpy())
        for name, one in data.data_vars.items()
        if str(name).startswith(MEASURED)
    }


def measured_sentences(result: RunResult) -> list[str]:
    """How far the run is off from the logs that it is held against; and without the mean, which may be a sensor's zero."""
    sentences = []
    for name, (of, _) in measured_of(result.data).items():
        unit, found = display(result.data[of].attrs["units"], name), result.data[f"{MEASURED}{name}"].attrs
        off, about = (digits(unit.of(found[key]), 3) for key in ("error_rms", "error_rms_without_mean"))
        sentences.append(
            f"The measured {label(name)} is off by {off} {unit.unit} (rms), by {about} {unit.unit} without its mean."
        )
    return sentences


def draw_measured(axes: Axes, data: xr.Dataset, name: str, path: str) -> None:
    """The measured series of a variable, in grey and wide behind the run's; path: the variable that the load's own sensor shows."""
    for of, logged in measured_of(data).values():
        if of == name or (of == "reading" and name == path):
            shown = display(data[of].attrs["units"], name).of(logged)
            axes.plot(data["time"].to_numpy(), shown, color=GREY, linewidth=2.6, alpha=0.55, zorder=1)
