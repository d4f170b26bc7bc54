"""What a tuning was asked for, in sentences."""

from __future__ import annotations

from smajax.control.tune.scenarios import HELD_OUT, beside
from smajax.control.tune.settings import TuneSettings
from smajax.control.tune.terms import terms_in

OBJECTIVES = {
    "nominal": "mean over the set points, plant as believed",
    "worst": "largest of all loops",
    "mean-variance": "mean of all loops plus one standard deviation",
}


def plants_sentence(settings: TuneSettings, air: float = 20.0) -> str:
    """On which plants gains are tuned. `air`: degC as believed, of which a share is told in kelvins."""
    sizes = {name: f"{100 * share:g} %" for name, share in settings.variation.items()}
    if "ambient" in sizes:
        sizes["ambient"] = f"{settings.variation['ambient'] * abs(air):.3g} K"
    wrong = [f"{name} ±{size}" for name, size in sizes.items()]
    plants = f"the plant as believed and with {', '.join(wrong)} at once" if wrong else "the plant as believed"
    if settings.batch:
        several = f"three of every four of a batch of {settings.batch}" if settings.batch >= HELD_OUT else "the others"
        plants = f"the plant as believed and {'another one' if settings.batch == 1 else several}"
    points = ", ".join(f"{point:g}{settings.shown.symbol}" for point in settings.set_points)
    return f"{plants}; set points {points}"


def held_out_sentence(settings: TuneSettings) -> str:
    """On what the gains are checked that tuning never saw."""
    where = "set points between those tuned"
    if len(settings.set_points) == 1:
        where = f"a set point {beside(settings.set_points[0], settings.shown):.3g}{settings.shown.symbol} beside"
    if settings.batch >= HELD_OUT:
        return f"every fourth plant of the batch, {where}"
    if settings.batch:
        return f"{where}, {'the other plant' if settings.batch == 1 else 'the other plants'}"
    return f"plants within the variation, {where}" if settings.variation else f"{where}, the plant as believed"


def goal_sentence(settings: TuneSettings) -> str:
    """What is made small, and what is kept below a limit."""
    terms = terms_in(settings.shown)
    parts = [
        f"{weight:g} x {terms[name].label} ({terms[name].unit})" for name, weight in settings.weights.items() if weight
    ]
    limits = [f"{terms[name].label} ≤ {limit:g} {terms[name].unit}" for name, limit in settings.limits.items()]
    cost = f"Cost: {' + '.join(parts)}, {OBJECTIVES[settings.objective]}"
    return cost + (f"; in every loop {', '.join(limits)}" if limits else "")
