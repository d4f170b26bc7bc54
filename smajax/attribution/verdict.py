"""The answer in words: what the numbers allow, and nothing beyond."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smajax.attribution.findings import (
    EffectFinding,
    LoneRun,
    ParameterFinding,
    Portrait,
    Rival,
    Round,
    RunFinding,
    Verdict,
)
from smajax.attribution.residual_diagnostics import noise_like
from smajax.attribution.search import TOO_MUCH_FOR_NOISE
from smajax.core.display_units import digits, display
from smajax.core.wording import and_listed
from smajax.data.experiment.record import Experiment

# A residual this many times the declared noise, or the other way round, says that the noise was declared wrongly.
WRONG_NOISE = 1.2
# A held-out run is off where its error is so much larger than that of the fit runs; few samples may be so by chance.
FURTHER, CHANCE = 1.3, 5.0
LARGE_SHARE = 0.2  # of the load, wrong or shifting: from here on a size of the bench is as likely to be wrong
LITTLE = 2.0  # residual over noise up to which the noise itself may be what is wrong
FAINT = 0.01  # chance, corrected for the candidates, from which on a trace below the noise is told
HANGS = 0.5  # change at half the step over the error, from which on a model hangs on the step
NAMED_SIZES = 4  # of these in a sentence
TAKES_BACK = 0.3  # share of the preset's expansion to within which one found is its negative
MENTIONED = 0.05  # weight from which on a rival is named


def verdict(added: Sequence[str], after: Portrait) -> Verdict:
    """Of the four, by whether something was added and whether what is left is noise."""
    if noise_like(after):
        return "explained" if added else "adequate"
    return "partly explained" if added else "not in the library"


def shown(value: float, unit: str, quantity: str) -> str:
    """A value in the unit an engineer reads."""
    edge = display(unit, quantity)
    return f"{edge.of(value):.3g} {edge.unit}"


def pooled(runs: Sequence[RunFinding], role: str, which: str) -> float:
    """Root mean square over all samples of the runs with `role`; NaN when there are none."""
    squares = [getattr(run, f"rmse_{which}") ** 2 * len(run.time) for run in runs if run.role == role]
    samples = [len(run.time) for run in runs if run.role == role]
    return float(np.sqrt(sum(squares) / sum(samples))) if samples else float("nan")


def summary(
    answer: Verdict,
    experiment: Experiment,
    runs: Sequence[RunFinding],
    effects: Sequence[EffectFinding],
    after: Portrait,
    tried: int,
    aside: Sequence[str] = (),
    foretold: float | None = None,
    refused: tuple[Sequence[str], float, float] | None = None,
    at_bound: Sequence[str] = (),
    likelier: Sequence[Rival] = (),
    sizes: Sequence[str] = (),
    held: Sequence[ParameterFinding] = (),
    integration: float = 0.0,
    lone: Sequence[LoneRun] = (),
    expansion: tuple[float, float] | None = None,
) -> tuple[str, ...]:
    """The verdict in sentences; `tried` is the number of candidate effects that were looked at.
    `aside`: those that were added and gave way to one unknown term. `foretold`: share of the motion in left-out runs that
    the model foretells, where that is so little that nothing is named. `refused`: effects that the held-out runs did not
    confirm, with the error there without and with them. `at_bound`: coefficients of what was added that end at a bound.
    `likelier`: rivals that left-out runs prefer to what was added. `sizes`: those of the bench that the experiment never
    gives, with the presets' values. `held`: parameters of the base model that end at a bound. `integration` (SI of the output): by
    how much halving the step changes what the final model gives. `lone`: fit runs that the others do not go with. `expansion`:
    what the preset's theta_T alone gives, see `expansion_not_given`.
    """
    unit, name = experiment.output_unit, experiment.output_name
    added = [effect for effect in effects if effect.added]
    several = sum(run.role == "fit" for run in runs) > 1
    judged_on = "on runs left out as well as on the fit" if several else "on the one fit run itself"
    opening = {
        "adequate": "Nothing is missing whose trace is larger than the noise: what the base model leaves of the fit runs cannot be told "
        "from measurement noise.",
        "explained": _explained(added, several, runs, experiment),
        "partly explained": _partly(added, several, runs, experiment),
        "not in the library": f"Something is missing, and none of the {tried} candidate effects that were tried accounts "
        f"for it: none lowers the error enough, {judged_on}."
        if tried
        else "Something is missing, and no candidate effect was to be tried: the experiment file leaves none.",
    }
    if aside:
        titles = and_listed([effect.title for effect in effects if effect.name in aside])
        opening["not in the library"] = (
            f"Something is missing, and none of the {tried} candidate effects that were tried accounts for it: {titles} "
            "comes nearest, and one unknown function in one equation foretells left-out runs better than that."
        )
    if foretold is not None:
        opening["not in the library"] = (
            f"The model foretells hardly anything of these runs ({max(foretold, 0.0):.0%} of the motion in runs left out), "
            f"and with none of the {tried} candidate effects that were tried enough for it to mean anything: none is named. Do "
            "inputs and outputs belong together, and are the samples in order?"
        )
    if refused is not None and not added:
        opening["not in the library"] = (
            f"Something is missing: none of the {tried} candidate effects that were tried accounts for it in the fit runs and "
            "is borne out by those that were held out."
        )
    alone = [one for one in lone if one.noise and not one.effects]
    if alone and not added:
        opening["not in the library"] = _in_one_run(alone, runs, experiment)
    told = [opening[answer], *([] if alone and not added else _pulls(lone, runs, experiment))]
    if answer not in ("adequate", "explained") and not after.white and after.ratio < LITTLE:
        told.append(
            f"What is left is no more than {after.ratio:.2f} times the noise: noise that is larger than said, or has a memory, looks the "
            "same. Look at a stretch of the log in which nothing moves before you look for physics."
        )
    if after.kept > 0.0 and not after.white and after.ratio > WRONG_NOISE:
        told.append(
            f"Mind: what is left is {after.ratio:.2f} times the noise that was estimated from neighbouring samples, and is the noise of a "
            f"first-order filter that keeps {after.kept:.2f} of the sample before, and nothing beyond. It is taken as the sensor's: the "
            "slow part of such a noise does not show in neighbours. Give the noise as a number if you know it to be smaller."
        )
    told += _faint(answer, effects)
    told += _of_the_step(experiment, runs, integration)
    if refused is not None:
        told = [
            f"{and_listed([effect.title for effect in effects if effect.name in refused[0]])} would lower the error "
            f"{judged_on}, but not on the runs that were held out ({shown(refused[1], unit, name)} without, "
            f"{shown(refused[2], unit, name)} with): it is not confirmed, and not named.",
            *told,
        ]
        told[0] = told[0][0].upper() + told[0][1:]
    for role, words in (("fit", "fit"), ("held-out", "held-out")):
        before, now = pooled(runs, role, "before"), pooled(runs, role, "after")
        if np.isfinite(before):
            told.append(
                f"Error on the {words} runs: {shown(before, unit, name)}"
                + (f" before, {shown(now, unit, name)} after" if added else "")
                + (" (no fit saw them, but they decided what is not named)." if role != "fit" and refused else ".")
            )
    told.append(f"Measurement noise: {shown(experiment.noise_sigma, unit, name)} ({experiment.noise_how}).")
    if at_bound:
        told.append(
            f"Mind: {and_listed(at_bound)} {'ends' if len(at_bound) == 1 else 'end'} at a bound. The runs ask for more of the "
            "effect than is likely: it may stand in for another."
        )
    if held:
        ends = [f"{one.name} ends {one.remark} of {shown(one.value, one.unit, one.name).strip()}" for one in held]
        its = "its bounds" if len(held) == 1 else "their bounds"
        told.append(
            f"Mind: {and_listed(ends)}. The truth may lie beyond, and what was fitted beside it makes up for that: widen "
            f"{its} in the experiment file where physics allows it, or look at what is taken as known."
        )
    title_of = {effect.name: effect.title for effect in effects}
    told += [
        f"Mind: {'runs left out speak' if several else 'the one fit run speaks'} for {title_of[one.rival]} rather than {title_of[one.effect]} (weight {one.weight:.2f})."
        for one in likelier
    ]
    for effect in added:
        told += [_of_the_preset(effect, expansion) or effect.sentence, *_or_a_size(effect, sizes)]
    told += _held_out_warnings(runs, experiment)
    if not several:
        told.append("There is one fit run only: effects were judged on the fit itself, no run could be left out.")
    worse = [run.name for run in runs if run.role == "held-out" and run.rmse_after > 1.02 * run.rmse_before]
    if worse:
        told.append(
            f"Mind: on {', '.join(worse)}, which the fit never saw, the extended model does worse than the base model."
        )
    if not any(run.role == "held-out" for run in runs):
        told.append("No run was held out, so nothing here was tested on data that the fit never saw.")
    if after.white and after.ratio > WRONG_NOISE:
        told.append(
            f"What is left has no memory but is {after.ratio:.1f} times the declared noise: either the noise was declared too small or something fast is missing, or the samples are not those of these inputs."
        )
    if after.ratio < 1.0 / WRONG_NOISE:
        told.append(
            f"What is left is {after.ratio:.2f} times the declared noise: the noise was declared too large, and an effect "
            "smaller than it may hide. Declare it smaller, or as 'estimate', and run again."
        )
    return tuple(told)


def _in_one_run(lone: Sequence[LoneRun], runs: Sequence[RunFinding], experiment: Experiment) -> str:
    """The opening where without one run the base model is complete."""
    first = lone[0]
    off = shown(first.foretold, experiment.output_unit, experiment.output_name)
    return (
        f"Something is missing or wrong, and in one run alone: without {' or without '.join(one.run for one in lone)} what the base "
        f"model leaves of the other {_others(runs)} fit runs is noise, and by these {first.run} is foretold {off} off, "
        f"{first.foretold / experiment.noise_sigma:.1f} times the noise. {_look_at(first)}"
    )


def _pulls(lone: Sequence[LoneRun], runs: Sequence[RunFinding], experiment: Experiment) -> list[str]:
    """A run that the others do not go with, beside a verdict that is about more than it."""
    if not lone:
        return []
    first, unit, name = lone[0], experiment.output_unit, experiment.output_name
    model = "the extended model" if first.effects else "the base model"
    left = ", which is noise" if first.noise else ""
    return [
        f"Mind: {first.run} pulls against the others. Fitted without it, the error of {model} on the other {_others(runs)} fit runs "
        f"falls from {shown(first.others_with, unit, name)} to {shown(first.others_without, unit, name)}{left}. {_look_at(first)}"
    ]


def _others(runs: Sequence[RunFinding]) -> int:
    return sum(run.role == "fit" for run in runs) - 1


def _look_at(lone: LoneRun) -> str:
    return (
        f"{lone.run} may not belong to the others (another wire, another day, another run's readings, an input that was not as "
        'logged), or it alone shows what the model lacks. Look at it first; give it role = "held-out" and run again to judge '
        "the others without it."
    )


def _faint(answer: Verdict, effects: Sequence[EffectFinding]) -> list[str]:
    """A trace below the noise that the score test sees all the same, for a verdict that nothing more is missing."""
    left = [
        one for one in effects if not one.added and np.isfinite(one.evidence.get("score_p_value_at_the_end", np.nan))
    ]
    if answer not in ("adequate", "explained") or not left:
        return []
    first = min(left, key=lambda one: one.evidence["score_p_value_at_the_end"])
    chance = min(1.0, len(left) * first.evidence["score_p_value_at_the_end"])
    if chance > FAINT:
        return []
    return [
        f"Mind: {first.title} leaves a trace in the score test (p = {digits(chance, 2)} after {len(left)} candidates) that would take "
        f"{first.evidence['score_gain_at_the_end']:.1%} of the residual's square"
        + (
            ", but runs left out are not foretold better with it."
            if first.evidence["score_gain_at_the_end"] > TOO_MUCH_FOR_NOISE
            else ": smaller than what is looked into, so it was not fitted."
        )
    ]


def _of_the_step(experiment: Experiment, runs: Sequence[RunFinding], integration: float) -> list[str]:
    """A model whose answer hangs on the step: where a load sticks and jumps, the step says when."""
    error = max(pooled(runs, "fit", "after"), experiment.noise_sigma)
    if not integration > HANGS * error:
        return []
    moved = shown(integration, experiment.output_unit, experiment.output_name)
    return [
        f"Mind: halving the step of {experiment.step:g} s changes what the model gives by {moved}, {integration / error:.1f} times its "
        "error on the fit runs: what was fitted may be the integration's and not the wire's. Take a shorter step under [sampling] "
        "and run again before you believe it."
    ]


def _of_the_preset(effect: EffectFinding, expansion: tuple[float, float] | None) -> str:
    """What an expansion says that takes back the one of the preset's theta_T: nothing of the wire, but of what was taken as known."""
    if effect.name != "thermal_expansion" or expansion is None:
        return ""
    found = [effect.coefficients[phase] for phase in ("martensite", "austenite")]
    if any(
        abs(one.value - preset) > max(TAKES_BACK * abs(preset), 3.0 * (one.standard_error or 0.0))
        for one, preset in zip(found, expansion, strict=True)
    ):
        return ""
    return (
        f"The thermal expansion that was found ({found[0].value:.2g} and {found[1].value:.2g} 1/K) takes back the one that the base model has by its "
        f"preset's thermal_modulus ({-expansion[0]:.2g} and {-expansion[1]:.2g}): it says nothing of the wire, but that its thermal strain is not the preset's. "
        "Give thermal_modulus in [model.parameters] ('0 MPa/K' where the wire shows none) and run again: in rate form it also leaves a strain "
        "with every cycle, and other effects that are named here may make up for that."
    )


def _or_a_size(effect: EffectFinding, sizes: Sequence[str]) -> list[str]:
    """The other reading of a load that is wrong by a large share, where sizes of the bench were never given."""
    share = effect.coefficients.get("share")
    if effect.name not in ("wrong_load", "load_shift") or share is None or abs(share.value) < LARGE_SHARE or not sizes:
        return []
    named = and_listed([*sizes[:NAMED_SIZES], *["others"] * (len(sizes) > NAMED_SIZES)])
    return [
        f"A load that is off by {share.value:+.0%} may as well be a size of the bench that the experiment file never gives: {named} are "
        "the presets'. Give yours in [model.parameters] and run again."
    ]


def _partly(added: Sequence[EffectFinding], several: bool, runs: Sequence[RunFinding], experiment: Experiment) -> str:
    """The strongest effect by name with what it does alone; the others as what they may be, stand-ins."""
    if not added:
        return ""
    first, others = added[0], added[1:]
    unit, name = experiment.output_unit, experiment.output_name
    alone = first.evidence.get("alone_rmse_fit", float("nan"))
    told = f"The base model lacks: {first.title}"
    if np.isfinite(alone) and others:
        told += f"; alone it takes the fit runs from {shown(pooled(runs, 'fit', 'before'), unit, name)} to {shown(alone, unit, name)}"
    judged = "runs left out" if several else "the one fit run"
    if not others:
        return f"{told}. That explains part of the misfit: what is left is more than noise."
    return (
        f"{told}. The error on {judged} is lowered further by {_listed(others)}. More than noise is still left: "
        "something that the library does not hold may be missing too, and "
        f"{'these' if len(others) > 1 else 'this'} may in part stand in for it."
    )


def _explained(
    added: Sequence[EffectFinding], several: bool, runs: Sequence[RunFinding], experiment: Experiment
) -> str:
    """As sure as the runs allow: one fit run and none held out confirm nothing, and a held-out run that is off says the contrary."""
    if several or any(run.role == "held-out" for run in runs):
        off = _off(runs, experiment)
        but = f", but not on {and_listed([run.name for run in off])}, held out: more may be missing" if off else ""
        return (
            f"The base model lacks: {_listed(added)}. With it, what is left on the fit runs is measurement noise{but}."
        )
    return (
        f"The base model may lack: {_listed(added)}. With it, what is left on the one fit run is measurement noise. No run was "
        "left out or held out, so nothing confirms it."
    )


def _held_out_warnings(runs: Sequence[RunFinding], experiment: Experiment) -> list[str]:
    """One sentence for each held-out run that the final model predicts clearly worse than it fits."""
    return [
        f"{run.name}, which was held out, is off by {shown(run.rmse_after, experiment.output_unit, experiment.output_name)}, "
        f"{run.rmse_after / pooled(runs, 'fit', 'after'):.1f} times the fit runs' error: the model misses what shows "
        "there and not in them, or something was different then (another day, another state of the wire)."
        for run in _off(runs, experiment)
    ]


def _off(runs: Sequence[RunFinding], experiment: Experiment) -> list[RunFinding]:
    """The held-out runs whose error is larger than the fit runs' beyond chance."""
    level = max(pooled(runs, "fit", "after"), experiment.noise_sigma)
    return [
        run
        for run in runs
        if run.role == "held-out" and run.rmse_after > (FURTHER + CHANCE / np.sqrt(2.0 * len(run.time))) * level
    ]


def _listed(added: Sequence[EffectFinding]) -> str:
    return and_listed([effect.title for effect in added])


def unexplained(
    answer: Verdict, experiment: Experiment, runs: Sequence[RunFinding], after: Portrait
) -> tuple[str, ...]:
    """What the final model leaves."""
    warnings = _held_out_warnings(runs, experiment)
    if answer in ("adequate", "explained"):
        return ("Nothing beyond noise on the fit runs.", *warnings)
    told = [*after.sentences, *warnings]
    return tuple(told)


def separated(experiment: Experiment) -> str:
    """What to do about parameters of which the runs see one combination."""
    return (
        "Measure one of them by itself and give it under [model.parameters] in the place of [unknown], or add a fit run that "
        "separates them (another load, a slower or a hotter one): "
        f"`smajax identify {experiment.path.name} --design` ranks such runs."
    )


def cannot_know(
    experiment: Experiment,
    parameters: Sequence[ParameterFinding],
    effects: Sequence[EffectFinding],
    rounds: Sequence[Round],
    rivals: Sequence[Rival],
    fit_runs: int,
    integration: float,
    preset: Mapping[str, str],
    together: Sequence[Sequence[str]] = (),
) -> tuple[str, ...]:
    """What these runs cannot tell, whatever the fit says.

    `integration` (SI of the output): by how much halving the step changes the model's output. `preset`: parameters
    of the base model that were not fitted, with value and unit. `together`: clusters of fitted ones that move together.
    """
    titles = {effect.name: effect.title for effect in effects}

    def named(model: str) -> str:
        return " with ".join(titles[name] for name in model.split(" + "))

    added = {effect.name for effect in effects if effect.added}
    told = [
        f"Whether it is {named(entry.chosen)}, or {' or '.join(named(model) for model in entry.alike)}: runs left out do "
        "not tell them apart. The one that foretells them best was taken, or a part of it that does as well."
        for entry in rounds
        if entry.alike and set(entry.chosen.split(" + ")) <= added
    ]
    told += [
        f"Whether it is {titles[one.effect]} or {titles[one.rival]}: their traces in these runs are {one.alike:.2f} alike, "
        f"and the runs give the second a weight of {one.weight:.2f}."
        + (
            f" A run with {one.separating_run} would tell them apart by {one.separation:.1f} times the noise."
            if one.separating_run
            else ""
        )
        for one in rivals
        if one.weight > MENTIONED
    ]
    told += [
        f"{and_listed(list(cluster))} move together in these runs: what one has too much another makes up for, so each is known "
        f"less well than alone. {separated(experiment)}"
        for cluster in together
    ]
    known = {name for cluster in together for name in cluster}
    told += [
        f"{p.name}: {p.remark}"
        + (
            "; its value is not measured by these runs."
            if p.standard_error is None
            else ": known less well than alone."
        )
        for p in parameters
        if p.remark and p.name not in known
    ]
    blended = [p.name for p in parameters if "combination" in p.remark]
    if blended:
        told.append(
            f"Of {and_listed(blended)} these runs see combinations alone. {separated(experiment)} Where the equations have their "
            "product alone (density and specific heat) no run separates them."
        )
    if fit_runs == 2:
        told.append("With two fit runs the left-out test is weak: give at least three of different kinds.")
    elif fit_runs == 1:
        told.append(
            "With one fit run no run can be left out to test an effect: give at least three of different kinds."
        )
    if experiment.offset:
        told.append("The zero of the output: each run has its own offset, fitted to that run, also for held-out runs.")
    if integration > 0.0:
        told.append(
            f"Anything below {shown(integration, experiment.output_unit, experiment.output_name)}: by so much the "
            f"model's output changes when the step of {experiment.step:g} s is halved"
            + (
                ". That is not small beside the noise: take a shorter step."
                if integration > 0.5 * experiment.noise_sigma
                else "."
            )
        )
    declared = sorted(name for name in experiment.parameters if "." not in name)
    if declared:
        told.append(f"Anything that shifts what was declared as known: {', '.join(declared)}.")
    rest = sorted(set(preset) - set(declared))
    if rest:
        told.append(
            f"Nor what the presets {experiment.wire} and {experiment.load} give: {', '.join(f'{name} {preset[name]}'.strip() for name in rest)}. A fitted value is "
            "right as far as these are; a heat capacity, a loss or a latent heat scales with density and resistivity."
        )
    return tuple(told)
