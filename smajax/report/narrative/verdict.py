"""The verdict and what it rests on, in words: the headline of each verdict, and sentences."""

from __future__ import annotations

import numpy as np

from smajax.attribution.findings import (
    Findings,
    OutputFinding,
    Rejected,
    Role,
    Verdict,
    coverage,
    moving_coverage,
    other_outputs,
    pooled,
    pooled_rmse,
    pooled_rmse_of,
)
from smajax.attribution.record_error import OutlierRun
from smajax.attribution.verdict import unknowns_at_bounds
from smajax.core.display_units import label
from smajax.core.wording import and_listed, of_those_moving, per_cent
from smajax.report.effect_words import meaning, sign_sentences
from smajax.report.narrative import caveats
from smajax.report.narrative.curve import curve_sentences
from smajax.report.narrative.record_errors import of_wrong_records
from smajax.report.narrative.rounds import reason_text
from smajax.report.narrative.uncertain_effects import of_uncertain_effects
from smajax.report.narrative.unknown import unknown_sentences
from smajax.report.narrative.values import error_text, value_text
from smajax.report.range_words import range_sentences

# Headline of the page, and its tone.
VERDICTS = {
    Verdict.ADEQUATE: ("The model is adequate", "good"),
    Verdict.EXPLAINED: ("The missing physics is found", "good"),
    Verdict.PARTLY_EXPLAINED: ("Part of the missing physics is found", "fair"),
    Verdict.NOT_FINISHED: ("Not finished", "fair"),
    Verdict.NOT_IN_LIBRARY: ("Something is missing that the library does not hold", "poor"),
}


STAND_INS = 6  # effects that leave more than noise all the same: as many as a set may have
MANY_STAND_IN = ("Something is missing that effects of the library only imitate", "poor")
AT_A_BOUND = ("Explained, but by what ends at a bound", "fair")
UNKNOWN_AT_A_BOUND = {
    Verdict.ADEQUATE: ("Adequate, but an unknown ends at a bound", "fair"),
    Verdict.EXPLAINED: ("Explained, but an unknown ends at a bound. Added", "fair"),
}
NOT_CONFIRMED, NOT_EVERY_RUN = "not confirmed", "not on every held-out run"
NOT_LEFT_OUT = "not on runs that were left out"
DOUBTFUL = {
    NOT_CONFIRMED: ("Explained on the fit runs, but not confirmed by held-out runs", "fair"),
    NOT_EVERY_RUN: ("Explained on the fit runs, but not on every held-out run", "fair"),
    NOT_LEFT_OUT: ("Explained on the fit runs, but without any one of them they are predicted badly", "fair"),
}
ADEQUATE_ON_FIT_RUNS = ("Adequate on the fit runs, but not on every held-out run", "fair")
OF_ONE_RUN = ("Explained on the one fit run, and no other run confirms it", "fair")


def headline(findings: Findings) -> tuple[str, str]:
    """(headline of the page, its tone): what ends at a bound, a coefficient of an effect or an unknown, is not what a reader may trust.

    Nor is what the fit runs alone say.
    """
    if findings.verdict is Verdict.EXPLAINED and findings.coefficients_at_bounds:
        return AT_A_BOUND
    why = doubt(findings)
    if why and findings.verdict is Verdict.ADEQUATE:
        return ADEQUATE_ON_FIT_RUNS
    if unknowns_at_bounds(findings):
        return UNKNOWN_AT_A_BOUND[findings.verdict]
    if why:
        return DOUBTFUL[why] if _several(findings) else OF_ONE_RUN
    return MANY_STAND_IN if _stand_in(findings) else VERDICTS[findings.verdict]


def doubt(findings: Findings) -> str:
    """What runs that the fit did not see leave of a model that describes the fit runs to the noise: empty where they confirm it.

    `not confirmed` where they are not predicted better than by the base model beyond chance, or where there is one fit run and no
    other; `not on every held-out run` where one of them is off by more than the fit runs. Of the base model alone only the latter. `not on runs that were left out`
    where no run was held out, and fits without each fit run predict less than half of the motion in it.
    """
    if findings.verdict is Verdict.ADEQUATE:
        return NOT_EVERY_RUN if caveats.held_out_off(findings) else ""
    if findings.verdict is not Verdict.EXPLAINED:
        return ""
    if not _held_out(findings):
        if findings.fit_runs < 2:
            return NOT_CONFIRMED
        return NOT_LEFT_OUT if findings.explained_variance <= findings.config.least_explained_variance else ""
    if caveats.held_out_comparison(findings) != "better":
        return NOT_CONFIRMED
    return NOT_EVERY_RUN if caveats.held_out_off(findings) else ""


def _several(findings: Findings) -> bool:
    """Whether a run can be left out, or was held out."""
    return findings.fit_runs > 1 or _held_out(findings)


def _held_out(findings: Findings) -> bool:
    return any(run.role == "held-out" for run in findings.runs)


def _stand_in(findings: Findings) -> bool:
    """Whether so many effects leave more than noise that they describe something else together."""
    return findings.verdict is Verdict.PARTLY_EXPLAINED and len(findings.added) >= STAND_INS


def summary(findings: Findings) -> tuple[str, ...]:
    """The answer first, then what makes it doubtful, the errors, what each effect means, and what was not found."""
    outliers = [] if _in_one_run(findings) else caveats.of_an_outlier(findings)
    sentences = [
        " ".join(
            [
                _opening(findings),
                *caveats.of_coefficients_at_bounds(findings),
                *caveats.of_unknowns_at_bounds(findings),
            ]
        ),
        *of_wrong_records(findings),
        *outliers,
        *caveats.of_the_noise(findings),
        *caveats.of_the_step(findings),
    ]
    # After what was found, or the one run that disagrees with the others.
    place = 1 if findings.added or _in_one_run(findings) else 0
    sentences[place:place] = [*_unconfirmed(findings), *(_rejected(findings, one) for one in findings.rejected)]
    sentences += _errors(findings)
    sentences += caveats.of_zeros_so_far(findings)
    sentences += caveats.of_bounds(findings)
    if (model := findings.extended_model or findings.base_model) is not None:
        sentences += range_sentences(model.values)
    sentences += caveats.of_priors_left(findings)
    if not _stand_in(findings):  # which are no names at all
        sentences += caveats.of_what_priors_alone_tell(findings)
        if not findings.remaining:  # `of_zeros_so_far` has them
            sentences += of_uncertain_effects(findings)
    unnamed = caveats.zero_so_far(findings)
    for effect in findings.added:
        if effect in unnamed or _stand_in(findings):
            continue
        fitted = {name: (one.value, one.standard_error) for name, one in effect.coefficients.items()}
        values = {name: value for name, (value, _) in fitted.items()}
        sentences += [
            caveats.of_the_preset(findings, effect) or meaning(effect.name, fitted),
            *sign_sentences(effect.name, fitted),
            *curve_sentences(effect.name, values),
            *caveats.of_a_size(findings, effect),
            *caveats.of_an_unusual_size(effect),
        ]
    sentences += caveats.held_out_warnings(findings)
    sentences += caveats.of_a_faint_trace(findings)
    sentences += caveats.of_unlike_outputs(findings)
    sentences += caveats.of_the_test(findings)
    sentences += caveats.of_effects_excluded(findings)
    first, *rest = sentences
    return (first, *unknown_sentences(findings), *rest)


def _opening(findings: Findings) -> str:
    match findings.verdict:
        case Verdict.ADEQUATE:
            return _adequate(findings)
        case Verdict.EXPLAINED:
            return _explained(findings)
        case Verdict.PARTLY_EXPLAINED:
            return _partly(findings)
        case Verdict.NOT_FINISHED:
            return f"Not finished: {findings.remaining} were still to come when this was written. What stands here is what was known by then."
        case Verdict.NOT_IN_LIBRARY:
            return _not_in_library(findings)


def _adequate(findings: Findings) -> str:
    """Of the fit runs; and which held-out runs say the contrary."""
    noise = "what the base model leaves of the fit runs cannot be distinguished from measurement noise"
    if not (off := caveats.held_out_off(findings)):
        return f"Nothing is missing whose trace is larger than the noise: {noise}."
    several = len(off) > 1
    return (
        f"The fit runs lack nothing: {noise}. But of the held-out runs {and_listed([run.name for run in off])} {'are' if several else 'is'} predicted worse: "
        f"{caveats.DIFFERENT}, or what shows there does not show in the fit runs, or these do not determine a parameter that "
        f"matters there. If nothing was different, make {'one of them' if several else 'it'} a fit run and hold another one out."
    )


def _in_one_run(findings: Findings) -> list[OutlierRun]:
    """Runs without any one of which the base model leaves noise, where nothing was added."""
    alone = [one for one in findings.outlier_runs if one.residual_is_noise and not one.effects]
    return [] if findings.added else alone


def _not_in_library(findings: Findings) -> str:
    """What stands in the way of a name, the strongest reason first."""
    tried = len(findings.effects)
    alone = _in_one_run(findings)
    if not tried:
        return "Something is missing, and no candidate effect was to be tried: the experiment file leaves none."
    if alone:
        return _of_one_run(findings, alone)
    if findings.rejected:
        return (
            f"Something is missing: none of the {tried} candidate effects that were tried accounts for it in the fit runs and "
            "is validated on those that were held out."
        )
    named = any(term.named for term in findings.unknown)
    if not named and not findings.explained_variance > findings.config.least_explained_variance:
        return (
            f"The model predicts hardly anything of these runs (explained variance {max(findings.explained_variance, 0.0):.0%} in runs left out), "
            f"and with none of the {tried} candidate effects that were tried enough for it to mean anything: none is named. Do "
            "inputs and outputs belong together, and are the samples in order?"
        )
    if findings.superseded:
        titles = and_listed([effect.title for effect in findings.effects if effect.name in findings.superseded])
        return (
            f"Something is missing, and none of the {tried} candidate effects that were tried accounts for it: {titles} "
            "comes nearest, and one unknown function in one equation is likelier than that."
        )
    return f"Something is missing, and none of the {tried} candidate effects that were tried accounts for it."


def _of_one_run(findings: Findings, alone: list[OutlierRun]) -> str:
    """The opening where without one run the base model is complete."""
    first = alone[0]
    return (
        f"Something is missing or wrong, and in one run alone: without {' or without '.join(one.run for one in alone)} what the base "
        f"model leaves of the other {findings.fit_runs - 1} fit runs is noise, and fitted to these it predicts {first.run} with an error of "
        f"{error_text(findings, first.predicted_rmse)}, {first.predicted_rmse / findings.noise_sigma:.1f} times the noise. {caveats.look_at(first)}"
    )


def _partly(findings: Findings) -> str:
    """The strongest effect by name with what it does alone; the others as what they may be, stand-ins."""
    if not findings.added:
        return ""
    first, *others = findings.added
    alone = first.evidence.get("alone_rmse_fit", float("nan"))
    text = f"The base model lacks: {first.title}"
    if np.isfinite(alone) and others:
        before = error_text(findings, pooled_rmse(findings.runs, "fit", "before"))
        text += f"; alone it takes the fit runs from {before} to {error_text(findings, alone)}"
    if not others:
        return f"{text}. That explains part of the misfit: what is left is more than noise."
    text += f". The model is likelier still with {and_listed([effect.title for effect in others])}"
    if _stand_in(findings):
        return (
            f"{text}. So many effects that leave more than noise all the same rather stand in for something that the library does not "
            "hold than describe what is missing: take none of them for found."
        )
    return (
        f"{text}. More than noise is left all the same: "
        "something that the library does not hold may be missing too, and "
        f"{'these' if len(others) > 1 else 'this'} may in part stand in for it."
    )


def _explained(findings: Findings) -> str:
    """As sure as the runs allow: one fit run and none held out confirm nothing, and a held-out run that is off says the contrary."""
    listed = and_listed([effect.title for effect in findings.added])
    with_it = "With them" if len(findings.added) > 1 else "With it"
    if _several(findings):
        off = caveats.held_out_off(findings)
        but = f", but not on {and_listed([run.name for run in off])}, held out: more may be missing" if off else ""
        doubtful = findings.coefficients_at_bounds or unknowns_at_bounds(findings)
        left_out = doubt(findings) == NOT_LEFT_OUT
        lacks = "may lack" if doubtful or left_out else "lacks"
        share = f" Fits without each run explain {max(findings.explained_variance, 0.0):.0%} of the motion in it: one run alone may show what is missing, or inputs and outputs do not belong together. Hold a run out."
        return f"The base model {lacks}: {listed}. {with_it}, what is left on the fit runs is measurement noise{but}.{share if left_out else ''}"
    return (
        f"The base model may lack: {listed}. {with_it}, what is left on the one fit run is measurement noise. No run was "
        "left out or held out, so nothing confirms it."
    )


def _unconfirmed(findings: Findings) -> list[str]:
    """That the held-out runs do not tell the extended model from the base model."""
    if not (findings.added and _held_out(findings)) or caveats.held_out_comparison(findings) != "alike":
        return []
    return [
        "The held-out runs neither confirm nor refute it: errors of neighbouring samples go together, and by so few independent ones the difference between the base model and the extended model may be chance."
    ]


def _rejected(findings: Findings, rejected: Rejected) -> str:
    """Of one search."""
    named = and_listed([effect.title for effect in findings.effects if effect.name in rejected.effects])
    without, with_it = (error_text(findings, one) for one in (rejected.rmse_without, rejected.rmse_with))
    chance = (
        " How far these two differ may be chance, but more than noise is left of the fit runs as well."
        if rejected.may_be_chance
        else ""
    )
    text = (
        f"{named} would lower the error on the fit runs, but not on the runs that were held out ({without} without, "
        f"{with_it} with): it is not confirmed, and not named.{chance}"
    )
    return text[0].upper() + text[1:]


def _of_the_band(findings: Findings) -> list[str]:
    """How the average of the likely models does on the held-out runs."""
    inside = coverage(findings)
    if inside is None:
        return []
    averages = [run.average for run in findings.runs if run.role == "held-out" and run.average is not None]
    error = pooled((one.rmse, one.samples) for one in averages)
    count = len(findings.averaged)
    who = f"the average of the {count} likely models" if count > 1 else "the model"
    return [
        f"On the held-out runs {who} is off by {error_text(findings, error)}, and {per_cent(inside)} of the samples lie in its 90 % band"
        f"{of_those_moving(inside, moving_coverage(findings))}.",
        *(
            f"{' + '.join(one.effects)}, of probability {one.weight:.2f}, is not averaged with: "
            f"{reason_text(one.reason, findings.output_unit, findings.output_name)}."
            for one in findings.dropped
        ),
    ]


def _errors(findings: Findings) -> list[str]:
    """Of fit runs and held-out runs, before and after; and the noise."""
    roles: tuple[Role, ...] = ("fit", "held-out")
    sentences = []
    for role in roles:
        before, after = (pooled_rmse(findings.runs, role, which) for which in ("before", "after"))
        if np.isfinite(before):
            decided = role != "fit" and bool(findings.rejected)
            sentences.append(
                f"Error on the {role} runs: {error_text(findings, before)}"
                + (f" before, {error_text(findings, after)} after" if findings.added else "")
                + (" (no fit saw them, but they decided what is not named)." if decided else ".")
            )
    sentences += _of_the_band(findings)
    sentences.append(f"Measurement noise: {error_text(findings, findings.noise_sigma)} ({findings.noise_how}).")
    return [*sentences, *(_of_another_output(findings, one) for one in other_outputs(findings))]


def _of_another_output(findings: Findings, one: OutputFinding) -> str:
    """The errors of an output beside the first, of fit runs and held-out runs, and its noise."""
    roles: tuple[Role, ...] = ("fit", "held-out")
    parts = []
    for role in roles:
        before, after = (pooled_rmse_of(findings.runs, one.name, role, which) for which in ("before", "after"))
        if np.isfinite(before):
            text = value_text(before, one.unit, one.name)
            changed = f" before, {value_text(after, one.unit, one.name)} after" if findings.added else ""
            parts.append(f"on the {role} runs {text}{changed}")
    noise = f"its noise is {value_text(one.noise_sigma, one.unit, one.name)} ({one.noise_how})"
    return f"Error of the {label(one.name)}: {'; '.join([*parts, noise])}."
