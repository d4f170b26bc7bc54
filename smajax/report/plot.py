"""A run at a glance: its main series one below the other, in the units that a reader sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from smajax.core.names import close_matches

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

INPUTS = ("voltage", "duty", "current", "power")
MOVED = ("position", "temperature", "martensite_fraction", "stress")
HELD = ("force", *MOVED[1:])  # of a load whose sensor is a load cell
PULLED = ("temperature", "stress", "strain", "martensite_fraction")  # of a coupon


def plot(result: xr.Dataset, names: Sequence[str] = ()) -> Figure:
    """Draw `names` of a data set over time, one panel each, and return the figure of `pyplot`, for `plt.show()`.

    found: of `simulate_dataset` or `simulate_loop_dataset`. names: by default what the drive is given, position (with the set
    point, dashed; of a load cell the force), temperature, martensite fraction and stress; of a coupon temperature, stress, strain and fraction. Raises
    ValueError for a name that the data set has not, and for one that is no series over time, such as a whole batch;
    TypeError for what is no data set.
    """
    import matplotlib.pyplot as plt

    from smajax.core.display_units import axis_label, display
    from smajax.report.drawing import BLUE, GREY, RED, named, styled

    if not hasattr(result, "data_vars"):
        raise TypeError(
            f"plot takes a data set, of `simulate_dataset` or `simulate_loop_dataset`, not a {type(result).__name__}, whose arrays are "
            "its attributes."
        )
    chosen = [*names] or main_series(result)
    for name in chosen:
        if name not in result:
            raise ValueError(f"no series {name!r}{close_matches(name, map(str, result.data_vars), 'there are')}")
        if result[name].dims != ("time",):
            raise ValueError(
                f"{name!r} has the dimensions {', '.join(map(str, result[name].dims)) or 'none'}, expected time alone: take one "
                "run of a batch, `found.isel(sample=0)`."
            )
    figure, axes = plt.subplots(
        len(chosen), 1, sharex=True, squeeze=False, figsize=(7.0, 1.0 + 1.5 * len(chosen)), layout="constrained"
    )
    time = result["time"].to_numpy()
    for one, name in zip(styled(*axes.flat), chosen, strict=True):
        unit = display(result[name].attrs.get("units", ""), name)
        one.plot(time, unit.of(result[name].to_numpy()), color=RED if name in INPUTS else BLUE, linewidth=1.3)
        if name == "position" and "wanted" in result:
            one.plot(time, unit.of(result["wanted"].to_numpy()), color=GREY, linewidth=1.0, linestyle="--")
        named(one, "", axis_label(name, unit))
    axes[-1, 0].set_xlabel("time (s)", fontsize=9)
    return figure


def main_series(result: xr.Dataset) -> list[str]:
    """What a look at a run is about, of the variables that are there."""
    moves = "position" not in result or result["position"].attrs.get("units") in ("m", "rad")
    held = moves and {"force", "reading"} <= set(result) and result["reading"].equals(result["force"])
    return [name for name in (*INPUTS, *(HELD if held else MOVED if moves else PULLED)) if name in result]
