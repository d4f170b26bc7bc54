"""How finely the runs of a batch are integrated, and what that leaves in them: measured on some of its runs.

What decides is a few runs spread over the batch, by the program of the batch itself. The error of a run in between may be larger.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from smajax.core.files import json_line
from smajax.engine import program
from smajax.model.load.base import AbstractMovingLoad
from smajax.simulation.batch.axes import Axes
from smajax.simulation.batch.impossible import marked
from smajax.simulation.batch.single_run import Recipe, single_run, slope_name
from smajax.simulation.integration_error import (
    LARGEST,
    IntegrationError,
    Outputs,
    Tolerance,
    coarse_to_fine,
    described,
    integrated,
    reference,
    whole_transformation,
    with_tolerance,
)
from smajax.simulation.measures import MeanSquare
from smajax.simulation.observers import GOOD
from smajax.simulation.steppers import Integration

INTEGRATION, ERROR = "integration", "integration_error"  # attributes
RUNS = 16  # on which the error is measured
SLOPES = 0.02  # of the largest slope on these runs: what integration may leave in any of them
MOST_BYTES = 1 << 27  # that these store


def _some(axes: Axes, most: int) -> dict[str, np.ndarray]:
    """The first and the last run of a batch, and others of it that are drawn."""
    count = min(most, axes.size)
    drawn = np.random.default_rng(0).choice(axes.size, count, replace=False)
    drawn[: min(2, count)] = (0, axes.size - 1)[: min(2, count)]
    runs = [axes.runs(number, number + 1) for number in np.unique(drawn)]
    return {name: np.concatenate([np.asarray(one[name], dtype=float) for one in runs]) for name in axes.names}


def _ways(recipe: Recipe) -> dict[str, float]:
    """How far what is stored moves in a whole transformation, of what does; times move by whole samples."""
    ways = whole_transformation(recipe.system)
    found = {name: ways[name] for name in recipe.keep if name in ways}
    for one in recipe.measures:
        way = ways.get(getattr(one, "of", ""), 0.0)
        if one.smooth and way > 0.0:
            found[one.name] = (way / float(one.scale)) ** 2 if isinstance(one, MeanSquare) else way
    return found


def _outputs(result: Mapping[str, np.ndarray], names: Sequence[str]) -> Outputs:
    """The values of `names`, NaN of runs that went wrong."""
    wrong = np.asarray(result["status"]) != GOOD
    values = {name: np.array(result[name], dtype=float) for name in names}
    for one in values.values():
        one[wrong] = np.nan
    return values


def integrated_recipe(recipe: Recipe, axes: Axes, tolerance: Tolerance) -> tuple[Recipe, IntegrationError]:
    """(the recipe with the integration that `tolerance` asks for, what that leaves in what is stored)."""
    ways = _ways(recipe)
    # A moving load's slopes are found along error-controlled steps: those through equal ones are slopes of where the branches happen to begin in them.
    slopes = recipe.slopes if isinstance(recipe.system.load, AbstractMovingLoad) else ()
    # Where nothing that is stored can decide, the sensor's reading does.
    plain = dataclasses.replace(recipe, slopes=slopes, keep=recipe.keep if ways else (*recipe.keep, "reading"))
    ways = ways or _ways(plain)
    smooth = [one.name for one in recipe.measures if one.smooth]
    of_slopes = [slope_name(name, by) for name in smooth for by in slopes]
    names = [*plain.keep, *smooth, *of_slopes]
    stored = recipe.steps // recipe.every + 1
    most = max(1, MOST_BYTES // (8 * stored * max(len(plain.keep), 1)))
    some = _some(axes, min(RUNS, most)) if tolerance is not None else {}

    ran: dict[
        str, Outputs
    ] = {}  # by the description of the integration: the reference tells the size of slopes as well

    def run(integration: Integration) -> tuple[None, Outputs]:
        if tolerance is None:
            return None, {}
        if (how := described(integration)) not in ran:
            own = dataclasses.replace(plain, integration=integration)
            found = program(single_run, own, tuple(axes.names))(own, some, threads=1)
            # Runs with impossible values decide nothing.
            ran[how] = _outputs(marked(recipe.system, some, found), names)
        return None, ran[how]

    choices = coarse_to_fine(recipe.system, bool(recipe.slopes) and not slopes)
    if slopes:
        choices = (one for one in choices if one.tolerance is not None)
        exact = run(reference(recipe.system))[1]
        ways |= {name: _largest(exact[name]) * SLOPES / LARGEST for name in of_slopes if name in exact}
    integration, error, _ = integrated(run, recipe.system, tolerance, choices, ways)
    return dataclasses.replace(recipe, integration=integration), error


def _largest(values: np.ndarray) -> float:
    """Of the finite ones, not zero."""
    return max(float(np.abs(values[np.isfinite(values)]).max(initial=0.0)), 1e-300)


def attributes_of(recipe: Recipe, error: IntegrationError) -> dict[str, str]:
    """For a result: how its runs were integrated, and what that leaves."""
    one = recipe.integration
    tolerance = None if one.tolerance is None else float(one.tolerance)
    return {
        INTEGRATION: json_line({"tolerance": tolerance, "substeps": one.substeps}),
        ERROR: json_line(error.record()),
    }


def as_stored(recipe: Recipe, attributes: Mapping[str, Any]) -> tuple[Recipe, dict[str, str]]:
    """(the recipe integrated as the batch with these attributes was begun, the attributes of that)."""
    one = json.loads(attributes[INTEGRATION])
    integration = Integration(substeps=one["substeps"])
    if one["tolerance"] is not None:
        integration = with_tolerance(one["tolerance"])
    own = {name: str(attributes[name]) for name in (INTEGRATION, ERROR)}
    return dataclasses.replace(recipe, integration=integration), own
