"""What is to be minded beside the verdict."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from smajax.attribution.findings import (
    Confounder,
    EffectFinding,
    Findings,
    ParameterFinding,
    RunFinding,
    other_outputs,
    pooled_rmse,
    pooled_rmse_of,
)
from smajax.attribution.paired_errors import Comparison, runs_compared
from smajax.attribution.record_error import OutlierRun
from smajax.attribution.verdict import NOTHING_MORE, unknowns_at_bounds
from smajax.core.display_units import digits, label
from smajax.core.wording import and_listed
from smajax.model.effects.library import LIBRARY
from smajax.report.identifiability_words import remark_text
from smajax.report.narrative.uncertain_effects import uncertain_effects
from smajax.report.narrative.values import as_written, assumed_text, error_text, far_text, value_text

NAMED_SIZES = 4  # in a sentence
UNLIKE = 2.0  # by which the noises that outputs leave differ and are more than noise
NORMAL_95 = 1.96
UNUSUAL = 5.0  # widths of its prior that an effect is off
DIFFERENT = "something was different then (another day, another state of the wire, air of another temperature, which `per_run` lets each run have of its own)"
LEAST_SEPARATION = 1.0  # noises by which a run has to separate two models to be worth doing


def of_an_outlier(findings: Findings) -> list[str]:
    """A run that does not agree with the others, beside a verdict that is about more than it."""
    if not findings.outlier_runs:
        return []
    first = findings.outlier_runs[0]
    model = "the extended model" if first.effects else "the base model"
    left = ", which is noise" if first.residual_is_noise else ""
    return [
        f"Mind: {first.run} does not agree with the others. Fitted without it, the error of {model} on the other {findings.fit_runs - 1} fit runs "
        f"falls from {error_text(findings, first.others_with)} to {error_text(findings, first.others_without)}{left}. {look_at(first)}"
    ]


def look_at(outlier: OutlierRun) -> str:
    """What to do about it."""
    return (
        f"{outlier.run} may not belong to the others (another wire, another day, another run's readings, an input that was not as "
        'logged), or it alone shows what the model lacks. Look at it first; give it role = "held-out" and run again to assess '
        "the others without it."
    )


def of_the_noise(findings: Findings) -> Iterator[str]:
    """A residual that is hardly larger than the noise, or whose noise has a slow part."""
    after, config = findings.residual_after, findings.config
    little = not after.white and after.ratio < config.noise_may_be_wrong
    if findings.verdict not in NOTHING_MORE and little and not held_out_off(findings):
        yield (
            f"What is left is no more than {after.ratio:.2f} times the noise: noise that is larger than {_declared(findings)}, or autocorrelated, looks the "
            "same. Look at a stretch of the log in which nothing moves before you look for physics."
        )
    if after.filter_coefficient > 0.0 and not after.white and after.ratio > config.wrong_noise:
        yield (
            f"Mind: what is left is {after.ratio:.2f} times the noise that was estimated from neighbouring samples, and is first-order "
            f"autoregressive noise with coefficient {after.filter_coefficient:.2f}, and nothing beyond. It is taken as the sensor's: the "
            "slow part of such a noise does not show in neighbours. Give the noise as a number if you know it to be smaller."
        )


def of_a_faint_trace(findings: Findings) -> list[str]:
    """A trace below the noise that the score test sees all the same, for a verdict that nothing more is missing."""
    left = [
        one
        for one in findings.effects
        if not one.added and np.isfinite(one.evidence.get("score_p_value_at_the_end", np.nan))
    ]
    if findings.verdict not in NOTHING_MORE or not left:
        return []
    first = min(left, key=lambda one: one.evidence["score_p_value_at_the_end"])
    chance = min(1.0, len(left) * first.evidence["score_p_value_at_the_end"])
    if chance > findings.config.faint_p_value:
        return []
    rejected = any(first.name in one.effects for one in findings.rejected)
    return [
        f"Mind: {first.title} leaves a trace in the score test (p = {digits(chance, 2)} after {len(left)} candidates) that would take "
        f"{first.evidence['score_gain_at_the_end']:.1%} of the residual's square"
        + (
            ", but the held-out runs reject it."
            if rejected
            else ", but the model with it is hardly likelier, if at all."
        )
    ]


def of_the_step(findings: Findings) -> list[str]:
    """A model whose answer depends on the step: where a load sticks and jumps, the step says when."""
    error = max(pooled_rmse(findings.runs, "fit", "after"), findings.noise_sigma)
    change = findings.integration_error
    if not change > findings.config.integration_error_of_error * error:
        return []
    return [
        f"Mind: the integration leaves {error_text(findings, change)} in the output, {change / error:.1f} times the model's error on the fit runs: "
        "what was fitted may be the integration's and not the wire's."
    ]


def _ends(parameter: ParameterFinding) -> str:
    """`recoverable_strain ends at its upper bound of 2 %`."""
    value = value_text(parameter.value, parameter.unit, parameter.name).strip()
    return f"{parameter.name} ends {remark_text(parameter.remark)} of {value}"


def of_coefficients_at_bounds(findings: Findings) -> Iterator[str]:
    """That an effect which was added is not to be taken for found: a coefficient of it ends at a bound."""
    if ends := [_ends(one) for one in findings.coefficients_at_bounds]:
        why = (
            "it stands in for something else, or its range is"
            if len(ends) == 1
            else "they stand in for something else, or their ranges are"
        )
        yield f"Mind: {and_listed(ends)}: {why} too narrow."


def of_unknowns_at_bounds(findings: Findings) -> Iterator[str]:
    """That a model which leaves noise is not to be trusted all the same: an unknown of the experiment ends at a bound."""
    yield from _truth_beyond(unknowns_at_bounds(findings))


def _truth_beyond(parameters: Sequence[ParameterFinding]) -> Iterator[str]:
    """What it means that parameters of the base model end at a bound; nothing of none."""
    if not parameters:
        return
    its, it = ("its bounds", "it") if len(parameters) == 1 else ("their bounds", "them")
    yield (
        f"Mind: {and_listed([_ends(one) for one in parameters])}. The truth may lie beyond, and what was fitted beside it makes up for that, with "
        f"standard errors that take {it} as known: widen {its} in the experiment file where physics allows it, or look at what is taken as known."
    )


def zero_so_far(findings: Findings) -> list[EffectFinding]:
    """Of an unfinished search: effects of its likeliest model that the numbers known by then do not tell from none.

    Each of their sizes ends at zero or is within 1.96 standard errors of it, or a model without them is likelier.
    """
    if not findings.remaining:
        return []
    off, unlikely = {one.name for one in findings.after if one.at_zero}, uncertain_effects(findings)

    def none_of_it(effect: EffectFinding) -> bool:
        if effect in unlikely:
            return True
        sizes = {
            name: one for name, one in effect.coefficients.items() if name in LIBRARY[effect.name].candidate.switches
        }
        return bool(sizes) and all(
            f"{effect.name}.{name}" in off or abs(one.value) < NORMAL_95 * (one.standard_error or 0.0)
            for name, one in sizes.items()
        )

    return [effect for effect in findings.added if none_of_it(effect)]


def of_zeros_so_far(findings: Findings) -> Iterator[str]:
    """That such effects are in the model, and not found."""
    if named := [effect.title for effect in zero_so_far(findings)]:
        yield (
            f"The likeliest model by then also has {and_listed(named)}, which by the numbers so far may be zero: "
            f"{'it is' if len(named) == 1 else 'they are'} not named."
        )


def of_bounds(findings: Findings) -> Iterator[str]:
    """Coefficients of what was added that end at zero, and parameters of the base model that end at a bound."""
    added = tuple(f"{effect.name}." for effect in findings.added)
    off = [one.name for one in findings.after if one.at_zero and one.name.startswith(added)]
    if off:
        yield f"Mind: {and_listed(off)} {'ends' if len(off) == 1 else 'end'} at zero, where the effect is off: the runs ask for none of it."
    sizes = findings.coefficients_at_bounds
    shapes = [one for one in findings.after if one.limited and one.name.startswith(added) and not one.at_zero]
    if ends := [_ends(one) for one in shapes if one not in sizes]:
        them = "it" if len(ends) == 1 else "them"
        yield f"Mind: {and_listed(ends)}: the runs do not determine {them}, or ask for more than the effect allows."
    # A value of a preset has no bounds in the file (`of_priors_left`).
    own = [one for one in findings.after if one.limited and not one.name.startswith(added)]
    said = unknowns_at_bounds(findings)
    yield from _truth_beyond([one for one in own if one not in said and not far_text(findings, one)])


def of_priors_left(findings: Findings) -> Iterator[str]:
    """Values of presets that end far from what data sheets leave open, and unknowns and coefficients that end far from their priors."""
    added = tuple(f"{effect.name}." for effect in findings.added)
    texts = {one: text for one in findings.after if (text := far_text(findings, one))}
    own = [_ends_far(one, text) for one, text in texts.items() if one.prior_of_unknown]
    if own:
        yield f"Mind: {and_listed(own)}. The runs contradict what the experiment file says of it, or it stands in for what the model lacks."
    of_effects = [_ends_far(one, text) for one, text in texts.items() if one.name.startswith(added)]
    if of_effects:
        yield f"Mind: {and_listed(of_effects)}. That is further than is likely: the effect may stand in for another."
    far = [one for one in texts if not one.prior_of_unknown and not one.name.startswith(added)]
    if not far:
        return
    ends = [_ends_far(one, texts[one]) for one in far]
    what, them, is_ = ("it stands", "it", "it is") if len(far) == 1 else ("they stand", "them", "they are")
    yield (
        f"Mind: {and_listed(ends)}. The wire is another one, or {what} in for what the model lacks: measure {them} and list {them} under "
        f"[model.parameters], or say under [priors.presets] how uncertain {is_}."
    )


def _ends_far(parameter: ParameterFinding, text: str) -> str:
    return f"{parameter.name} ends at {as_written(parameter, parameter.value)}, {text}"


def of_what_priors_alone_tell(findings: Findings) -> Iterator[str]:
    """Other effects that leave as little in the place of one that was added, or less, and are less likely by their priors alone."""
    titles, told = {effect.name: effect.title for effect in findings.effects}, findings.config.told_by_runs
    for name in [effect.name for effect in findings.added]:
        own = [one for one in findings.confounders if one.only_by_priors and one.effect == name]
        # A parameter more fits better by itself (Akaike 1974).
        better = [one for one in own if one.log_likelihood_ratio > told + max(one.more_parameters, 0)]
        alike = [one for one in own if one not in better]
        for some, words in ((better, "prefer {others} to {one}"), (alike, "hardly tell {one} from {others}")):
            if not some:
                continue
            others = [
                f"{titles[one.confounder]} in its place (log-likelihood ratio {digits(one.log_likelihood_ratio, 2)})"
                for one in some
            ]
            said = words.format(one=titles[name], others=and_listed(others))
            yield f"Mind: the fit runs alone {said}. It is named by what was known before them: prior odds, usual sizes of coefficients, the preset's values.{_separated(some, titles)}"


def _separated(some: Sequence[Confounder], titles: Mapping[str, str]) -> str:
    """The run that separates one of these confounders most, if it is worth doing."""
    most = max(some, key=lambda one: one.separation if one.separating_run else 0.0)
    if not most.separating_run or most.separation < LEAST_SEPARATION:
        return ""
    return f" A run with {most.separating_run} would tell it from {titles[most.confounder]} by {most.separation:.1f} times the noise."


def of_the_preset(findings: Findings, effect: EffectFinding) -> str:
    """What an expansion says that takes back the one of the preset's theta_T: nothing of the wire, but of what was taken as known."""
    expansion = findings.preset_expansion
    if effect.name != "thermal_expansion" or expansion is None:
        return ""
    result = [effect.coefficients[phase] for phase in ("martensite", "austenite")]
    if any(
        abs(one.value - preset)
        > max(findings.config.expansion_cancelled * abs(preset), 3.0 * (one.standard_error or 0.0))
        for one, preset in zip(result, expansion, strict=True)
    ):
        return ""
    return (
        f"The thermal expansion that was found ({result[0].value:.2g} and {result[1].value:.2g} 1/K) takes back the one that the base model has by its "
        f"preset's thermal_modulus ({-expansion[0]:.2g} and {-expansion[1]:.2g}): it says nothing of the wire, but that its thermal strain is not the preset's. "
        "Give thermal_modulus in [model.parameters] ('0 MPa/K' where the wire shows none) and run again: in rate form it also leaves a strain "
        "with every cycle, and other effects that are named here may make up for that."
    )


def of_an_unusual_size(effect: EffectFinding) -> list[str]:
    """An effect far larger than its prior has it: found where the runs ask for it, and as often as not in the place of another."""
    candidate = LIBRARY[effect.name].candidate
    switches = () if candidate.keeps_priors else candidate.switches  # `of_priors_left` has those
    off = {name: abs(one.widths_off or 0.0) for name, one in effect.coefficients.items() if name in switches}
    sizes = [
        f"{effect.name}.{name} is {widths:.0f} times as large as is usual"
        for name, widths in off.items()
        if widths >= UNUSUAL
    ]
    if not sizes:
        return []
    return [f"Mind: {and_listed(sizes)}. Measure it if you can: an effect of that size may stand in for another."]


def of_a_size(findings: Findings, effect: EffectFinding) -> list[str]:
    """The other reading of a load that is wrong by a large share, where sizes of the bench were never given."""
    share = effect.coefficients.get("share")
    sizes = [assumed_text(one) for one in findings.assumed if one.size_not_given]
    large = findings.config.large_load_share
    if effect.name not in ("wrong_load", "load_shift") or share is None or abs(share.value) < large or not sizes:
        return []
    named = and_listed([*sizes[:NAMED_SIZES], *["others"] * (len(sizes) > NAMED_SIZES)])
    return [
        f"A load that is off by {share.value:+.0%} may as well be a size of the bench that the experiment file never gives: {named} are "
        "the presets'. Give yours in [model.parameters] and run again."
    ]


def held_out_off(findings: Findings) -> list[RunFinding]:
    """The held-out runs whose error in some output is larger than the fit runs' beyond chance."""
    return list({run.name: run for run, *_ in _outputs_off(findings)}.values())


def _outputs_off(findings: Findings) -> Iterator[tuple[RunFinding, str, str, float, float]]:
    """(run, name and unit of the output, its error there, that of the fit runs) of each output that is off on a held-out run."""
    config = findings.config
    for run in findings.runs:
        if run.role != "held-out":
            continue
        fitted = pooled_rmse(findings.runs, "fit", "after")
        outputs = [
            (findings.output_name, findings.output_unit, findings.noise_sigma, run.samples, run.rmse_after, fitted)
        ]
        for one in run.others:
            fitted = pooled_rmse_of(findings.runs, one.name, "fit", "after")
            outputs.append((one.name, one.unit, one.noise_sigma, one.samples, one.rmse_after, fitted))
        for name, unit, noise, samples, error, fitted in outputs:
            chance = config.held_out_ratio + config.held_out_chance / np.sqrt(2.0 * max(samples, 1))
            if samples and error > chance * float(np.nanmax([fitted, noise])):
                yield run, name, unit, error, fitted


def held_out_warnings(findings: Findings) -> list[str]:
    """One sentence for each held-out run that the final model predicts clearly worse than it fits."""
    return [
        f"{run.name}, which was held out, is off by {value_text(error, unit, name)}"
        + (f" ({label(name)})" if name != findings.output_name else "")
        + f", {error / fitted:.1f} times the fit runs' error: the model misses what shows "
        f"there and not in them, or {DIFFERENT}."
        for run, name, unit, error, fitted in _outputs_off(findings)
    ]


def of_unlike_outputs(findings: Findings) -> Iterator[str]:
    """Of several outputs, that one leaves far more noises than another: what is named is decided by one error for all."""
    left = {findings.output_name: pooled_rmse(findings.runs, "fit", "after") / findings.noise_sigma}
    for one in other_outputs(findings):
        left[one.name] = pooled_rmse_of(findings.runs, one.name, "fit", "after") / one.noise_sigma
    known = {name: ratio for name, ratio in left.items() if np.isfinite(ratio)}
    if len(known) < 2:
        return
    most, least = max(known, key=lambda name: known[name]), min(known, key=lambda name: known[name])
    if known[most] > max(UNLIKE, UNLIKE * known[least]):
        yield (
            f"Mind: on the fit runs the {label(most)} is off by {known[most]:.1f} times its noise and the {label(least)} by {known[least]:.1f}. One error for all outputs "
            f"decides what is named, so that the {label(most)} may hide what the {label(least)} shows: look at it, and try without it."
        )


def held_out_comparison(findings: Findings) -> Comparison:
    """How the extended model predicts the held-out runs beside the base model."""
    held_out = [run for run in findings.runs if run.role == "held-out"]
    return runs_compared(held_out, held_out, "before", findings.config)


def of_the_test(findings: Findings) -> Iterator[str]:
    """How far what was found has been tested, and whether the noise was declared rightly."""
    if findings.fit_runs < 2:
        yield "There is one fit run only: effects were assessed on the fit itself, no run could be left out."
    worse = [
        run.name
        for run in findings.runs
        if run.role == "held-out" and runs_compared([run], [run], "before", findings.config) == "worse"
    ]
    if worse:
        yield f"Mind: on {', '.join(worse)}, which the fit never saw, the extended model does worse than the base model."
    if not any(run.role == "held-out" for run in findings.runs):
        yield "No run was held out, so nothing here was tested on data that the fit never saw."
    yield from _of_the_ratio(findings)


def _declared(findings: Findings) -> str:
    """How the noise is known: `declared` by the experiment file, or `estimated`."""
    every = [findings.noise_how, *(one.noise_how for one in other_outputs(findings))]
    return "declared" if all(how.startswith("given") for how in every) else "estimated"


def _of_the_ratio(findings: Findings) -> Iterator[str]:
    """That a residual without memory is larger or smaller than the noise."""
    after, wrong = findings.residual_after, findings.config.wrong_noise
    how = _declared(findings)
    if after.white and after.ratio > wrong:
        yield (
            f"What is left is white but {after.ratio:.1f} times the {how} noise: either the noise was {how} too small or "
            "something fast is missing, or the samples are not those of these inputs."
        )
    if after.ratio < 1.0 / wrong:
        remedy = "Declare it smaller, or as 'estimate'," if how == "declared" else "Give it as a number"
        yield (
            f"What is left is {after.ratio:.2f} times the {how} noise: the noise was {how} too large, and an effect "
            f"smaller than it may hide. {remedy} and run again."
        )


def of_effects_excluded(findings: Findings) -> list[str]:
    """That the experiment file keeps effects from being candidates: none of these can be named."""
    if not findings.effects_excluded:
        return []
    tried, one = len(findings.effects), findings.effects_excluded == 1
    return [
        f"{tried} effect{'s' if tried != 1 else ''} of the library {'were candidates' if tried != 1 else 'was a candidate'}; {findings.effects_excluded} more "
        f"that this model can show {'was' if one else 'were'} not tried, because [effects] of the experiment file leaves {'it' if one else 'them'} out."
    ]
