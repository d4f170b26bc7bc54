"""Warnings about runs in which hardly anything moves: they teach a fit little, and held out they test little."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.core.display_units import display
from smajax.core.wording import per_cent
from smajax.data.experiment.record import Output, Run
from smajax.data.readers.table import Array

# Of what the output changes by in the fit run where it changes most: below, a held-out run tests little.
TENTH = 0.1
# Standard deviations of the noise: 98 % of it alone lie within 4.7, so an output that changes by less shows next to nothing else.
FEW_NOISES = 8.0


def _change(values: Array) -> float:
    """Width of what 98 % of the values lie in: a single sample far off is no motion."""
    measured = values[np.isfinite(values)]
    return float(np.subtract(*np.percentile(measured, [99.0, 1.0]))) if measured.size else 0.0


def motion_warnings(runs: Sequence[Run], outputs: Sequence[Output]) -> list[str]:
    """One sentence for each output of a run that hardly changes. What is constant as logged has another warning (`plausibility`)."""
    result = []
    for output in outputs:
        changes = {run.name: _change(run.outputs[output.name]) for run in runs if output.name in run.outputs}
        most = max((changes.get(run.name, 0.0) for run in runs if run.role == "fit"), default=0.0)
        unit = display(output.unit, output.name)
        for run in runs:
            change = changes.get(run.name, 0.0)
            noisy = change < FEW_NOISES * output.noise_sigma
            few = run.role != "fit" and change < TENTH * most
            if not change or not (noisy or few):
                continue
            beside = f"{change / output.noise_sigma:.1f} times its noise" if noisy else f"{per_cent(change / most)} of"
            what = unit.with_unit(change, 3) + f", {beside}"
            if run.role == "fit":
                result.append(
                    f"run {run.name!r}: the output {output.name!r} changes by {what}, so the fit learns little from it: was the drive on, "
                    "and is it the right column?"
                )
            else:
                what += "" if noisy else " what it changes by in the fit runs"
                result.append(
                    f"run {run.name!r} is held out, and its output {output.name!r} changes by {what}: an error on it says little of the "
                    "model; hold out a run that goes about as far as the others"
                )
    return result
