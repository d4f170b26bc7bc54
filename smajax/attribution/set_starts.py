"""Where the fit of a set of effects may begin: at the linear model's estimate, at an effect's usual size, all over its ranges."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from smajax.attribution.exclusive_effects import exclude_each_other, replaceable
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.subset_evidence import LinearModel, Subset
from smajax.attribution.traces import Traces, Variant
from smajax.fit.starts import logarithmic_points
from smajax.model.effects.library import LIBRARY

LEAST_START, MOST_START = 0.02, 2.0  # widths from the base where a fit of a new coefficient begins
PLACES = 16  # a power of two, for Sobol's points: of an effect with several local minima, simulated and the best fitted
LARGEST_STEP = 0.2  # of its range that an unknown moves to the start of a fit


def starts(joint: JointParameters, subset: Subset, linear: LinearModel, traces: Traces) -> list[np.ndarray]:
    """Where a fit of a set may begin, (P,) each: new coefficients at their linear estimate, unknowns where they are and there too.

    An effect with several local minima gives ranges of its coefficients (`Candidate.start_ranges`), all over which it is tried, or other
    places (`Candidate.further_starts`). One in the place of another that looks much the same begins with that one's coefficients of the same name as well.
    """
    slots, estimate = joint.slots, linear.estimate(subset)
    values = joint.without(traces.values, [variant.effect for variant in subset])
    new = [variant for variant in subset if variant.effect not in traces.present]
    for variant in new:
        for name, value in _begin(joint, variant, traces, estimate.coefficients).items():
            values[slots[name]] = value
    moved = np.array(values)
    for name, step in estimate.unknowns.items():
        low, high = joint.bounds[name]
        most = LARGEST_STEP * (high - low)
        moved[slots[name]] = np.clip(values[slots[name]] + np.clip(step, -most, most), low, high)
    points = [values, moved]
    for variant in new:
        points += _elsewhere(joint, variant.effect, moved)
    taken_over = _in_the_place_of(joint, subset, traces, moved)
    points += [] if taken_over is None else [taken_over]
    return [off_bounds(joint, one) for one in points]


def at_usual_size(joint: JointParameters, subset: Subset, traces: Traces, start: np.ndarray) -> list[np.ndarray]:
    """`start` (P,) with the switches of new effects at their initial guess: on the side where they are, and on the usual side, to which their range is wider, where that is another.

    What fits without an effect has other parameters make up for it, so that the derivative at nothing may point to the wrong side. There the unknowns are not moved along it.
    """
    changed, usual = np.array(start), np.array(start)
    own = [joint.slots[name] for name in joint.unknowns]
    usual[own] = traces.values[own]
    other_side = False
    for variant in subset:
        if variant.effect in traces.present:
            continue
        guesses = LIBRARY[variant.effect].candidate.initial_guess
        for name in joint.switches(variant.effect):
            k, (low, high) = joint.slots[name], joint.bounds[name]
            base, guess = joint.priors[name].base, guesses.get(name.split(".", 1)[1], joint.priors[name].sigma)
            changed[k] = np.clip(base + np.copysign(abs(guess - base), changed[k] - base), low, 0.5 * (base + high))
            usual[k] = changed[k]
            if (guess - base) * (changed[k] - base) < 0.0 and high - base > base - low:
                usual[k], other_side = min(guess, 0.5 * (base + high)), True
    return [changed, usual] if other_side else [changed]


def as_fitted_before(
    joint: JointParameters,
    subset: Subset,
    traces: Traces,
    start: np.ndarray,
    fitted: Iterable[FittedModel],
    error: float,
) -> list[np.ndarray]:
    """Where a set with a new effect in the place of one that it excludes begins as well, (P,): at the likeliest of the `fitted` models with the new one and some of the set, and the others of the set as at `start` (P,).

    With another shape of the transformation its temperatures are others, far from those of the present fit. `error` of an independent sample, SI.
    """
    effects, models, points = {variant.effect for variant in subset}, list(fitted), []
    pairs = _replacements(joint, subset, traces)
    for new in dict.fromkeys(new for new, gone in pairs if exclude_each_other((new, gone))):
        known = [one for one in models if new in one.effects and effects.issuperset(one.effects)]
        best = max(known, key=lambda one: one.log_evidence(error**2), default=None)
        if best is None:
            continue
        values = np.array(best.values)
        others = [joint.slots[name] for effect in effects - set(best.effects) for name in joint.coefficients[effect]]
        values[others] = start[others]
        points.append(off_bounds(joint, values))
    return points


def _begin(
    joint: JointParameters, variant: Variant, traces: Traces, estimated: Mapping[str, float]
) -> dict[str, float]:
    """Values of a new effect's coefficients, by full name."""
    switches = joint.switches(variant.effect)
    guesses = LIBRARY[variant.effect].candidate.initial_guess
    values = {}
    for name in joint.coefficients[variant.effect]:
        prior, bounds = joint.priors[name], joint.bounds[name]
        value = traces.places.get(variant, {}).get(name, guesses.get(name.split(".", 1)[1], prior.base))
        if name in switches:
            most = MOST_START * joint.width_factors.get(variant.effect, 1.0)
            size = float(np.clip(estimated[name] / prior.sigma, -most, most))
            if abs(size) < LEAST_START:
                size = float(np.copysign(LEAST_START, size)) if bounds[0] < prior.base else LEAST_START
            value = prior.base + size * prior.sigma
        values[name] = float(np.clip(value, *bounds))
    return values


def _in_the_place_of(joint: JointParameters, subset: Subset, traces: Traces, values: np.ndarray) -> np.ndarray | None:
    """`values` with new effects' coefficients at those of the same name of a present effect that they replace; None where they replace none.

    A limit of friction was found with the stick and slip of its runs, which a start elsewhere need not come to.
    """
    pairs = _replacements(joint, subset, traces)
    changed = np.array(values)
    for new, gone in pairs:
        for name in joint.coefficients[new]:
            if (there := f"{gone}.{name.split('.', 1)[1]}") in joint.coefficients[gone]:
                changed[joint.slots[name]] = np.clip(traces.values[joint.slots[there]], *joint.bounds[name])
    return changed if pairs else None


def _replacements(joint: JointParameters, subset: Subset, traces: Traces) -> list[tuple[str, str]]:
    """(new effect of the set, present one that is not in it) where the one may stand in the place of the other."""
    effects = {variant.effect for variant in subset}
    return [
        (new, gone)
        for new in joint.ordered(tuple(effects - set(traces.present)))
        for gone in joint.ordered(tuple(set(traces.present) - effects))
        if replaceable(new, gone)
    ]


def _elsewhere(joint: JointParameters, effect: str, values: np.ndarray) -> list[np.ndarray]:
    """`values` with coefficients of an effect at Sobol points of the ranges in which fits of it begin, by logarithm, and at its further starts."""
    sizes = {name.split(".", 1)[1]: abs(float(values[joint.slots[name]])) for name in joint.switches(effect)}
    candidate = LIBRARY[effect].candidate
    ranges = candidate.start_ranges(sizes)
    places = [*(logarithmic_points(ranges, PLACES) if ranges else ()), *candidate.further_starts]
    points = []
    for place in places:
        point = np.array(values)
        for name, value in place.items():
            full = f"{effect}.{name}"
            point[joint.slots[full]] = np.clip(value, *joint.bounds[full])
        points.append(point)
    return points


def off_bounds(joint: JointParameters, values: np.ndarray) -> np.ndarray:
    """A parameter that begins on its bound stays there."""
    changed = np.array(values)
    for name in joint.unknowns:
        low, high = joint.bounds[name]
        room = 1e-3 * (high - low)
        changed[joint.slots[name]] = np.clip(changed[joint.slots[name]], low + room, high - room)
    return changed
