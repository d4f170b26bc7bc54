"""An identification in words and rows, no more than its numbers say."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

import numpy as np

from smajax.core.display_units import digits, display, label, p_value, with_error
from smajax.core.names_of_runs import parameter_of
from smajax.core.whiteness import WHITE
from smajax.core.wording import and_listed, counted, times_noise
from smajax.data.experiment.record import Prior
from smajax.fit.identify_result import Estimate, FitEnd, Identified
from smajax.fit.levenberg_marquardt import Status
from smajax.fit.posterior import Posterior
from smajax.fit.uncertainty import clusters
from smajax.report.effect_words import sign_sentences
from smajax.report.identifiability_words import remark_text
from smajax.report.range_words import range_sentences

FAR = 2.0  # standard deviations of what was known before, from which on an estimate contradicts it
NAMED = 3  # parameters of a headline
HELD = 4  # names of held values in a sentence
WORSE = 1.5  # times the fit runs' error, from which on a held-out run is said to be off
OFF = 1.25  # ratio of residual to noise that is worth a sentence
LACKING = 3.0  # noises, from which an autocorrelated residual is the model's and not single samples'


def answer(result: Identified) -> str:
    """The parameters with their standard errors, as a headline; the first few where there are many."""
    known = [one for one in result.estimates if one.standard_error is not None]
    every = counted(len(result.estimates), "parameter")
    if not known:
        return f"Of {every} the runs determine none."
    together = {name for group in correlated_groups(result) for name in group}
    known.sort(key=lambda one: one.name in together)
    values = "; ".join(f"{label(one.name)} {_with_unit(one)}" for one in known[:NAMED])
    more = f"; {len(known) - NAMED} more in the table" if len(known) > NAMED else ""
    among = f", {len(together)} of them correlated" if together else ""
    return f"{len(known)} of {every} determined{among}: {values}{more}."


def correlated_groups(result: Identified) -> list[list[str]]:
    """Parameters with a standard error whose estimates are correlated so much that what one has too much another makes up for."""
    return [[result.correlated[k] for k in group] for group in clusters(result.correlation)]


def _determined(result: Identified) -> list[str]:
    """What "determined" means where estimates are correlated."""
    groups = correlated_groups(result)
    if not groups:
        return []
    place = result.correlated.index
    pairs = [abs(result.correlation[place(a), place(b)]) for group in groups for a in group for b in group if a != b]
    # Cut and not rounded: 0.9996 is not yet 1.
    most = math.floor(1e3 * max(pairs) + 1e-6) / 1e3
    which = "; and ".join(and_listed(group) for group in groups)
    other = "another" if any(len(group) > 2 for group in groups) else "the other"
    return [
        f"Determined means known to the standard error beside the value. Correlated (up to {most:.3f}) are {which}: what one has too much "
        f"{other} makes up for, so use these values together; each by itself is only as good as its standard error."
    ]


def _held(result: Identified) -> list[str]:
    """Which values nobody gave and nothing was fitted to; the first few where there are many."""
    names = result.held_presets
    if not names:
        return []
    shown = (
        [*names[:HELD], f"{len(names) - HELD} more (all are on the page, under Checks)"]
        if len(names) > HELD + 1
        else names
    )
    return [
        f"Held at the preset's value, or at the base that [priors.presets] has, because the file does not give "
        f"{'it' if len(names) == 1 else 'them'}: {and_listed(shown)}. "
        f"`--presets fitted` fits {'it' if len(names) == 1 else 'them'} too."
    ]


def _with_unit(one: Estimate) -> str:
    unit = display(one.unit, one.name)
    error = None if one.standard_error is None else unit.of(one.standard_error)
    return f"{with_error(unit.of(one.value), error)} {unit.unit}".strip()


def _of_held_out(result: Identified) -> list[str]:
    """The values of its own that each held-out run has."""
    units = {parameter_of(one.name): display(one.unit, one.name) for one in result.estimates}
    own = [
        f"{name} {digits((unit := units[parameter_of(name)]).of(value))} {unit.unit}".strip()
        for name, value in result.values_of_held_out_runs.items()
    ]
    if not own:
        return []
    return [f"What is each run's own was found for the held-out runs from themselves, all else held: {'; '.join(own)}."]


def conclusions(result: Identified) -> list[str]:
    """What was found, in sentences that say no more than the numbers."""
    sentences = [
        *_held(result),
        *_determined(result),
        ended_sentence(result.ended),
        *(_error(result, k) for k in range(len(result.outputs))),
        *_of_held_out(result),
        *_worse_held_out(result),
    ]
    larger = [one for one in result.outputs if one.noise_before and one.noise_sigma > OFF * one.noise_before]
    given = [one.noise_before is None for one in result.outputs]
    if not all(np.isfinite(one.ratio) for one in result.outputs):
        sentences.append("The residual of these runs is NaN or infinite: neither it nor the values mean anything.")
    elif result.whiteness_p < WHITE:
        sentences.append(
            f"The residual is {_times(result)} and is autocorrelated ({p_value(result.whiteness_p)}; one "
            f"sample in {result.independent:.0f} is independent): the model lacks something, and the standard errors allow "
            "for the autocorrelation but not for what that does to the values. `smajax close-loop` looks for what it is."
        )
    else:
        sentences.append(
            f"The residual is {_times(result)} and is white "
            f"({p_value(result.whiteness_p)}){'' if larger else ': nothing in these runs speaks against the model'}."
        )
        wrong = [
            one
            for one, was_given in zip(result.outputs, given, strict=True)
            if was_given and not 1.0 / OFF < one.ratio < OFF
        ]
        if wrong and len(result.outputs) == 1:
            sentences.append("The noise is not what was declared: errors were taken from the residual.")
        elif wrong:
            sentences.append(
                f"The noise of {and_listed([one.name for one in wrong])} is not what was declared, so the outputs do not "
                "have the weights they deserve: write noise = 'estimate' for it."
            )
    if larger:
        sentences.append(
            f"The residual of {and_listed([one.name for one in larger])} is larger than the noise that the signal "
            "itself shows: part of it is what the model lacks, and was given the weight of noise."
        )
    # What a model lacks is not normally distributed either, and no other loss makes it less.
    lacking = result.whiteness_p < WHITE and max(one.over_noise for one in result.outputs) > LACKING
    if result.normality_p < WHITE and not result.robust and not lacking:
        sentences.append(
            f"It is not normally distributed ({p_value(result.normality_p)}): if single samples are far off, fit by Huber's "
            "loss (`--robust`)."
        )
    sentences += of_effects(result.estimates)
    if result.model is not None:
        sentences += range_sentences(result.model.values)
    sentences += [said for one in result.estimates if (said := _contradicted(one))]
    edge = [one.name for one in result.estimates if one.note.at_bound and one.standard_error is None]
    not_identifiable = [one.name for one in result.estimates if one.standard_error is None and one.name not in edge]
    if edge:
        sentences.append(
            f"Held by a bound, which the truth may lie beyond: {', '.join(edge)}; the others are estimated with it held."
        )
    if not_identifiable:
        sentences.append(
            f"{', '.join(not_identifiable)} {'is' if len(not_identifiable) == 1 else 'are'} not identifiable from these runs: see the remarks."
        )
    if better := [one.name for one in result.profiles if one.better]:
        sentences.append(
            f"The profile of {', '.join(better)} found a better fit than this one: ask for more `--starts`."
        )
    if result.posterior is not None:
        sentences.append(_chains(result.posterior))
    if result.robust:
        sentences.append("Huber's loss: samples far off count less, and errors are those of that estimate.")
    return sentences


def of_effects(estimates: Sequence[Estimate]) -> list[str]:
    """What coefficients of effects among the estimates say by their sign."""
    by_effect: dict[str, dict[str, tuple[float, float | None]]] = {}
    for one in estimates:
        effect, dot, coefficient = one.name.partition(".")
        if dot:
            by_effect.setdefault(effect, {})[coefficient] = (one.value, one.standard_error)
    return [said for effect, fitted in by_effect.items() for said in sign_sentences(effect, fitted)]


def ended_sentence(end: FitEnd) -> str:
    """Why the fit ended, and how many starts came to the same."""
    reason = {
        Status.RUNNING: f"{end.most_steps} steps were not enough",
        Status.CONVERGED: f"it has converged, no step lowers the cost by more than {end.tolerance:.0e} of it",
        Status.NO_DESCENT: "it has converged, no step lowers the cost any more",
        Status.NOT_FINITE: "the model gives no number at the start",
        Status.NOTHING_FREE: "no parameter is free",
        Status.EXCEEDED: "other fits were far better after as many steps",
    }[end.status]
    compared = (
        "It is the only fit that was run until its end."
        if end.fits == 1
        else f"Of the {end.fits} fits that were run to their end {end.same_cost} ended at the least cost"
        f"{'' if end.same_cost == end.fits else ', the others at a higher one'}."
    )
    return f"The fit stopped after {end.steps} steps: {reason}. {compared}"


def _times(result: Identified) -> str:
    """`1.1 times the noise`, or by output where the fit did not make it one."""
    if len(result.outputs) == 1:
        return times_noise(result.over_noise)
    return and_listed([f"{times_noise(one.over_noise)} ({one.name})" for one in result.outputs])


def _contradicted(one: Estimate) -> str:
    """What is said of an estimate that lies far from what was known before; nothing for one that does not."""
    known: Prior | None = one.prior
    if known is None:
        return ""
    if known.logarithmic:
        off = math.log(max(one.value / known.mean, sys.float_info.min)) / known.sigma
    else:
        off = (one.value - known.mean) / known.sigma
    if abs(off) <= FAR:
        return ""
    unit = display(one.unit, one.name)
    return (
        f"{one.name} ends at {unit.with_unit(one.value, 3)}" + f", {abs(off):.1f} standard deviations "
        f"{'above' if off > 0.0 else 'below'} what was known before ({prior_shown(one)}): the runs speak against that prior. "
        "Either it is wrong, or the model or the runs are; without the prior the estimate would lie further off still."
    )


def rms_by_role(result: Identified, output: int) -> dict[str, float]:
    """Error of one output over all runs of a role, SI."""
    by_role = {}
    for role in dict.fromkeys(run.role for run in result.runs):
        errors = [run.series[output].rmse for run in result.runs if run.role == role]
        known = [error for error in errors if np.isfinite(error)]
        if known:
            by_role[role] = float(np.sqrt(np.mean(np.square(known))))
    return by_role


def _error(result: Identified, output: int) -> str:
    """Error of one output and its noise, in its own unit."""
    one = result.outputs[output]
    unit = display(one.unit, one.name)
    errors = "; ".join(f"{role} runs {unit.with_unit(error, 3)}" for role, error in rms_by_role(result, output).items())
    whose = f"Error of the {label(one.name)} (rms)" if len(result.outputs) > 1 else "Error (rms)"
    sigma = unit.with_unit(one.noise_sigma, 3)
    if one.noise_before is None:
        return f"{whose}: {errors}; noise {sigma}, {one.noise_how}."
    own = unit.with_unit(one.noise_before, 3)
    return f"{whose}: {errors}; noise {own} by differences of neighbouring samples; the fit weighs a sample by {sigma}, which is what the model leaves."


def _worse_held_out(result: Identified) -> list[str]:
    """That held-out runs are off by far more than those of the fit, with the run that is most."""
    fitted = rms_by_role(result, 0).get("fit", np.nan)
    held_out = [run for run in result.runs if run.role == "held-out" and np.isfinite(run.rmse)]
    if not held_out or not fitted > 0.0:
        return []
    worst = max(held_out, key=lambda run: run.rmse)
    if not worst.rmse > WORSE * fitted:
        return []
    return [
        f"{worst.name}, which was held out, is off by {digits(worst.rmse / fitted, 2)} times the error of the fit runs: the model misses what shows there, or "
        "something was otherwise in that run."
    ]


def estimate_rows(result: Identified) -> list[list[str]]:
    """Parameter, estimate with standard error, unit, 95 % interval of the profile if any was drawn, bounds, start, remark."""
    profiled = {one.name: one for one in result.profiles}

    def interval(one: Estimate) -> str:
        if one.name not in profiled:
            return ""
        unit, known = display(one.unit, one.name), profiled[one.name]
        last = (known.values[0], known.values[-1])
        ends = [
            digits(unit.of(end)) if end is not None else f"beyond {digits(unit.of(float(reached)))}"
            for end, reached in zip((known.low, known.high), last, strict=True)
        ]
        return " … ".join(ends)

    rows = []
    for one in result.estimates:
        unit = display(one.unit, one.name)
        error = None if one.standard_error is None else unit.of(one.standard_error)
        bounds = f"{digits(unit.of(one.lower))} … {digits(unit.of(one.upper))}"
        rows.append(
            [
                one.name,
                with_error(unit.of(one.value), error),
                unit.unit,
                *([interval(one)] if profiled else []),
                bounds,
                digits(unit.of(one.start)),
                remark_text(one.note),
            ]
        )
    return rows


def _chains(drawn: Posterior) -> str:
    """Whether the chains may be believed."""
    worst = f"R-hat up to {drawn.r_hat.max():.3f}, at least {drawn.effective.min():.0f} independent draws"
    if drawn.converged:
        return f"The chains of the posterior agree ({worst})."
    return f"The chains of the posterior do not agree yet ({worst}): ask for more draws, and do not use them before."


def posterior_rows(result: Identified) -> list[list[str]]:
    """Parameter, mean with standard deviation, unit, 95 % interval, R-hat, independent draws."""
    if result.posterior is None:
        return []
    units = {one.name: display(one.unit, one.name) for one in result.estimates}
    rows = []
    for k, name in enumerate(result.posterior.names):
        draws, unit = result.posterior.flat[:, k], units[name]
        low, high = (digits(unit.of(float(end))) for end in np.percentile(draws, [2.5, 97.5]))
        value = with_error(unit.of(float(draws.mean())), unit.of(float(draws.std())))
        chains = [f"{result.posterior.r_hat[k]:.3f}", f"{result.posterior.effective[k]:.0f}"]
        rows.append([name, value, unit.unit, f"{low} … {high}", *chains])
    return rows


def prior_shown(estimate: Estimate) -> str:
    """What was known before the runs: `80 ± 10`, or `80 × or / 1.22`."""
    known: Prior | None = estimate.prior
    if known is None:
        return ""
    unit = display(estimate.unit, estimate.name)
    if known.logarithmic:
        return f"{digits(unit.of(known.mean))} × or / {digits(math.exp(known.sigma), 3)}"
    return f"{digits(unit.of(known.mean))} ± {digits(unit.of(known.sigma), 2)}"
