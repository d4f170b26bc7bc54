"""A prediction in sentences and rows: how far off, within which band, and where it extrapolates."""

from __future__ import annotations

import numpy as np

from smajax.core.display_units import digits, display, label
from smajax.core.wording import and_listed, of_those_moving, per_cent, times_noise
from smajax.fit.prediction import Extrapolation, PredictedRun, Prediction
from smajax.fit.prediction_band import MOVED, NEIGHBOURS
from smajax.report.narrative.residual import residual_sentences

MOVES = (
    f"An output moves where the means of the {NEIGHBOURS} neighbours on either side of a sample differ by more than {MOVED:g} noises; at rest most models "
    "are right."
)
LISTED = 3  # spans of time in a sentence
LARGE_ZERO = 10.0  # noises: from here on a fitted zero is said in a sentence
HEAD = (
    "run",
    "output",
    "error (rms)",
    "noise",
    "error over noise",
    "zero, fitted",
    "in the 90 % band",
    "in it while moving",
    "unit",
    "remark",
)


def conclusions(result: Prediction) -> list[str]:
    """The answer first, then what is left, then where the model extrapolates."""
    sentences = []
    for k, (one, errors) in enumerate(zip(result.runs[0].series, result.errors, strict=True)):
        unit = display(one.unit, one.output)
        if not np.isfinite(errors.rmse):
            continue
        size = unit.with_unit(errors.rmse, 3)
        noise = unit.with_unit(one.noise, 3)
        count = len(result.measured_runs(k))
        sentences.append(
            f"The {label(one.output)} of {count} run{'s' if count > 1 else ''} is predicted with an error (rms) of {size}, "
            f"{times_noise(errors.rmse / one.noise, f'the noise of {noise}')}; {per_cent(errors.coverage)} of the samples lie in the 90 % band"
            f"{of_those_moving(errors.coverage, errors.moving_coverage)}."
        )
        found = errors.residual
        if found is not None:
            # The first of its sentences, the size, has been said.
            sentences += ["The residual is white."] if found.white else residual_sentences(found)[1:]
        sentences += zero_sentences(result, k)
    if fitted := [run.name for run in result.runs if run.fitted]:
        sentences.append(f"The model was fitted to {and_listed(fitted)}: the error there says little of other runs.")
    sentences += [extrapolation_sentence(run, one) for run in result.runs for one in run.extrapolation]
    return sentences


def zero_sentences(result: Prediction, output: int) -> list[str]:
    """That a run's own zero, which is fitted to the run, is many noises, with the largest; nothing of smaller ones."""
    large = [run for run in result.measured_runs(output) if _zero_ratio(run, output) >= LARGE_ZERO]
    if not large:
        return []
    worst = max(large, key=lambda run: _zero_ratio(run, output))
    one = worst.series[output]
    unit = display(one.unit, one.output)
    size = unit.with_unit(one.offset, 3)
    count = "" if len(large) == 1 else f"{len(large)} of them are large, "
    return [
        f"The zero of the {label(one.output)} is fitted to each run: {count}{worst.name} has {size}, "
        f"{times_noise(_zero_ratio(worst, output))}. Where the sensor's zero did not move by that much, the model is off by it, and the error above "
        "leaves it out."
    ]


def _zero_ratio(run: PredictedRun, output: int) -> float:
    return abs(run.series[output].offset) / run.series[output].noise


def extrapolation_sentence(run: PredictedRun, one: Extrapolation) -> str:
    unit = display(one.unit, one.quantity)

    def of(value: float) -> str:
        return digits(unit.of(value), 4)

    low, high = one.reached[0] < one.fitted[0], one.reached[1] > one.fitted[1]
    reached = " and ".join([f"down to {of(one.reached[0])}"] * low + [f"up to {of(one.reached[1])}"] * high)
    spans = [f"{start:.4g} s to {end:.4g} s" for start, end in one.spans]
    if len(spans) > LISTED:
        spans = [f"{one.spans[0][0]:.4g} s to {one.spans[-1][1]:.4g} s, with gaps"]
    return (
        f"Extrapolation in {run.name}: {label(one.quantity)} goes {reached} {unit.unit}; the model was fitted to {of(one.fitted[0])} to "
        f"{of(one.fitted[1])} {unit.unit}. {per_cent(one.share)} of the samples, from {and_listed(spans)}."
    ).replace(" ;", ";")


def band_sentence(result: Prediction) -> str:
    """That nothing was fitted, what the band is made of, and on what its share holds."""
    fitted = "Nothing was fitted to these runs"
    if any(one.offset for one in result.model.outputs):
        fitted += ", but for the zero of a sensor that has its own in each run"
    if not any(one.names for one in result.model.likely):
        return f"{fitted}. Nothing in this model was fitted either: the band is the noise's alone, and no range is known beyond which it extrapolates."
    return (
        f"{fitted}. The band is that of the parameters' posterior, of the likely models, and of the error on runs that the fit did not see: nine of "
        "ten samples lie in it on average over runs like the fit's, and in a single run more or fewer."
    )


def run_rows(result: Prediction) -> list[tuple[str, ...]]:
    """A row a run and output, as `HEAD`."""
    rows: list[tuple[str, ...]] = []
    for run in result.runs:
        remarks = ["fitted to it"] * run.fitted + ["extrapolation"] * bool(run.extrapolation)
        for one in run.series:
            unit = display(one.unit, one.output)
            known = np.isfinite(one.rmse)
            rows.append(
                (
                    run.name,
                    label(one.output),
                    digits(unit.of(one.rmse), 3) if known else "not measured",
                    digits(unit.of(one.noise), 3),
                    digits(one.rmse / one.noise, 3) if known else "",
                    digits(unit.of(one.offset), 3) if known and one.offset else "",
                    per_cent(one.coverage) if known else "",
                    per_cent(one.moving_coverage) if np.isfinite(one.moving_coverage) else "",
                    unit.unit,
                    ", ".join(remarks),
                )
            )
    return rows
