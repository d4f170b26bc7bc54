r"""Evidence of every set of effects at once, in the linear model about one fit: which sets are worth a fit.

With outputs linear in the parameters, normal priors and normal noise the integral over all parameters of a model has a
closed form. With standardised parameters $x$ of a set $S$, precisions $\Lambda$ of their priors, and $y = r + J x_0$
the residual where all coefficients are at their base,

$$\ln p(y|S) = \tfrac12 b^T M^{-1} b - \tfrac12 \ln\det M + \tfrac12 \ln\det\Lambda + \mathrm{const},\quad
M = J_S^T J_S/s^2 + \Lambda_S,\ b = J_S^T y/s^2$$

(MacKay 1992; George & McCulloch 1993 for the search over sets). $s^2$ is the variance of an independent sample.

The widths of an effect that is off are those of its file times the factor $\tau \geq 1$ that is likeliest where the effect is added alone, with its
prior of $\tau^{-2}$, as those of a fitted effect are (`laplace_evidence`). Else the prior would hold an effect that is far larger than usual next to zero,
in this model and in the fit that begins from it, and others would take its place.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.attribution.exclusive_effects import exclude_each_other
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.traces import Traces, Variant
from smajax.fit.uncertainty import at_bound

Subset = frozenset[Variant]
WIDTHS = tuple(2.0**power for power in range(7))  # factors of an effect's widths that are compared
# Of a set: more that leave more than noise stand in for something else, and a search among them does not end.
MOST_EFFECTS = 6
IMPOSSIBLE = 6.0  # standard errors on the wrong side of zero
FREE_OF_BOUNDS = 1e-6  # of the range: nearer to a bound an unknown is held


@dataclass(frozen=True)
class Estimate:
    """What the linear model says of one set of effects."""

    coefficients: dict[str, float]  # by full name, from the base value, in the coefficient's unit
    unknowns: dict[str, float]  # steps from the present values


@dataclass
class LinearModel:
    """Normal equations of all parameters at one fit, and the evidence of sets of effects."""

    traces: Traces
    joint: JointParameters
    unknowns: list[str]
    places: dict[Variant, list[int]]  # of the columns of a variant
    names: list[str]  # of all columns
    scales: np.ndarray
    gram: np.ndarray
    right: np.ndarray
    precision: np.ndarray
    one_sided: np.ndarray
    log_odds: dict[Variant, float]
    squares: float  # of the outputs where all coefficients are at their base, SI squared
    variance: float  # of an independent sample, SI squared
    most_effects: int = MOST_EFFECTS  # of a set
    width_factors: dict[str, float] = field(default_factory=dict)  # of the priors of effects that are off
    cached: dict[Subset, float] = field(default_factory=dict)

    def log_evidence(self, subset: Subset) -> float:
        """Log evidence plus log prior odds of a set, up to a constant of all sets; minus infinity where it is impossible."""
        if subset not in self.cached:
            self.cached[subset] = self._log_evidence(subset)
        return self.cached[subset]

    def _log_evidence(self, subset: Subset) -> float:
        if len(subset) > self.most_effects or exclude_each_other([one.effect for one in subset]):
            return -np.inf
        columns = self._columns(subset)
        try:
            factor = np.linalg.cholesky(self.gram[np.ix_(columns, columns)] + np.diag(self.precision[columns]))
        except np.linalg.LinAlgError:
            return -np.inf
        inverse = scipy.linalg.solve_triangular(factor, np.eye(len(columns)), lower=True)
        half = inverse @ self.right[columns]
        value = 0.5 * float(half @ half) - float(np.log(np.diag(factor)).sum())
        value += 0.5 * float(np.log(self.precision[columns]).sum()) + sum(self.log_odds[one] for one in subset)
        sided = self.one_sided[columns]
        if sided.any():
            mean, deviation = inverse.T @ half, np.sqrt((inverse**2).sum(axis=0))
            ratio = (mean / deviation)[sided]
            if (ratio < -IMPOSSIBLE).any():
                return -np.inf
            value += float(np.sum(np.log(2.0) + scipy.stats.norm.logcdf(ratio)))
        return value

    def estimate(self, subset: Subset) -> Estimate:
        """Posterior mean of all parameters of a model with `subset`."""
        columns, mean = self._mean(subset)
        mean = mean * self.scales[columns]
        values = {self.names[column]: float(one) for column, one in zip(columns, mean, strict=True)}
        own = set(self.unknowns)
        return Estimate(
            {name: one for name, one in values.items() if name not in own},
            {name: one for name, one in values.items() if name in own},
        )

    def rms(self, subset: Subset) -> float:
        """Root mean square of what a model with `subset` leaves there, SI."""
        columns, mean = self._mean(subset)
        explained = 2.0 * self.right[columns] @ mean - mean @ self.gram[np.ix_(columns, columns)] @ mean
        squares = self.squares - self.variance * float(explained)
        return float(np.sqrt(max(squares, 0.0) / len(self.traces.residual)))

    def _mean(self, subset: Subset) -> tuple[list[int], np.ndarray]:
        """(columns, posterior means of their parameters, in widths of the priors)."""
        columns = self._columns(subset)
        matrix = self.gram[np.ix_(columns, columns)] + np.diag(self.precision[columns])
        # `solve` would warn of a matrix that is nearly singular, as it is where the runs do not tell parameters apart.
        try:
            return columns, scipy.linalg.cho_solve(scipy.linalg.cho_factor(matrix), self.right[columns])
        except np.linalg.LinAlgError:  # by rounding: of a set that is impossible here, and may be fitted all the same
            return columns, np.linalg.lstsq(matrix, self.right[columns])[0]

    def climb(self, start: Subset) -> Subset:
        """From `start` by adding, removing or replacing one effect at a time, as long as the evidence rises."""
        while True:
            best = max(self.neighbours(start), key=self.log_evidence, default=start)
            if not self.log_evidence(best) > self.log_evidence(start) + 1e-9:
                return start
            start = best

    def neighbours(self, subset: Subset) -> Iterator[Subset]:
        """Sets that differ by one effect, or by one in the place of another."""
        present = {one.effect for one in subset}
        absent = [one for one in self.places if one.effect not in present]
        for one in absent:
            yield subset | {one}
        for gone in subset:
            rest = subset - {gone}
            yield rest
            for one in self.places:
                if one != gone and (one.effect == gone.effect or one.effect not in present):
                    yield rest | {one}

    def ranked(self) -> list[Subset]:
        """All sets that were looked at, the likeliest first."""
        possible = [subset for subset, value in self.cached.items() if np.isfinite(value)]
        return sorted(possible, key=lambda subset: -self.cached[subset])

    def _columns(self, subset: Subset) -> list[int]:
        own = sorted(subset)
        return [*range(len(self.unknowns)), *(column for one in own for column in self.places[one])]


def linear_model(joint: JointParameters, traces: Traces, variance: float, candidates: Sequence[str]) -> LinearModel:
    """Of the effects among `candidates` and those that are present. `variance`: of an independent sample, SI squared."""
    values, slots = traces.values, joint.slots
    held = {
        name for name in joint.unknowns if at_bound(float(values[slots[name]]), *joint.bounds[name], FREE_OF_BOUNDS)
    }
    unknowns = [name for name in joint.unknowns if name not in held]
    names, scales, columns = list(unknowns), [], []
    for name in unknowns:
        scales.append(joint.scale(name, values[slots[name]]))
        columns.append(traces.columns[name] * scales[-1])
    target = np.array(traces.residual)
    places: dict[Variant, list[int]] = {}
    for variant, own in traces.variants.items():
        if variant.effect not in candidates and variant.effect not in traces.present:
            continue
        places[variant] = []
        for name, column in own.items():
            value = traces.places.get(variant, {}).get(name, float(values[slots[name]]))
            places[variant].append(len(names))
            names.append(name)
            scales.append(joint.scale(name, value))
            columns.append(column * scales[-1])
            if variant.effect in traces.present:
                target += columns[-1] * joint.deviation(name, value)
    matrix = np.stack(columns, axis=1) if columns else np.zeros((len(target), 0))
    linear = LinearModel(
        traces=traces,
        joint=joint,
        unknowns=unknowns,
        places=places,
        names=names,
        scales=np.asarray(scales),
        gram=matrix.T @ matrix / variance,
        right=matrix.T @ target / variance,
        precision=np.asarray([joint.precision(name) for name in names]),
        one_sided=np.asarray([joint.one_sided(name) for name in names], dtype=bool),
        log_odds=_odds(joint, places),
        squares=float(target @ target),
        variance=variance,
        most_effects=max(MOST_EFFECTS, len(traces.present)),
    )
    _widen(linear)
    return linear


def _widen(linear: LinearModel) -> None:
    """Widen the priors of every effect that is off, beside those that are present, by its likeliest factor."""
    present = [one for one in linear.places if one.effect in linear.traces.present]
    shared = linear._columns(frozenset(present))
    matrix = linear.gram[np.ix_(shared, shared)] + np.diag(linear.precision[shared])
    try:
        factor = scipy.linalg.cho_factor(matrix)
    except np.linalg.LinAlgError:  # of unknowns that the runs do not tell apart: no set is told from another then
        return
    explained = scipy.linalg.cho_solve(factor, linear.right[shared])
    best: dict[str, float] = {}
    for variant, own in linear.places.items():
        if variant in present:
            continue
        across = linear.gram[np.ix_(own, shared)]
        left = linear.gram[np.ix_(own, own)] - across @ scipy.linalg.cho_solve(factor, across.T)
        width, value = likeliest_width(left, linear.right[own] - across @ explained, linear.one_sided[own])
        linear.precision[own] = width**-2
        linear.log_odds[variant] -= 2.0 * float(np.log(width))
        value += linear.log_odds[variant]
        if value > best.get(variant.effect, -np.inf):
            best[variant.effect], linear.width_factors[variant.effect] = value, width


def likeliest_width(gram: np.ndarray, right: np.ndarray, one_sided: np.ndarray) -> tuple[float, float]:
    """(likeliest factor of the prior widths of coefficients, its log evidence without the prior of the factor), from their normal equations alone."""
    values, vectors = np.linalg.eigh(gram)
    values, turned = np.maximum(values, 0.0), vectors.T @ right
    found = 1.0, -np.inf
    for width in WIDTHS:
        inverse = 1.0 / (values + width**-2)
        evidence = 0.5 * float(turned**2 @ inverse) - 0.5 * float(np.log1p(width**2 * values).sum())
        if one_sided.any():
            ratio = (vectors @ (inverse * turned) / np.sqrt(vectors**2 @ inverse))[one_sided]
            evidence += float(np.sum(np.log(2.0) + scipy.stats.norm.logcdf(ratio)))
        if evidence - 2.0 * np.log(width) > found[1] - 2.0 * np.log(found[0]):
            found = width, evidence
    return found


def _odds(joint: JointParameters, places: Mapping[Variant, object]) -> dict[Variant, float]:
    """Log odds of each variant: an effect's own are shared among its places."""
    count: dict[str, int] = {}
    for variant in places:
        count[variant.effect] = count.get(variant.effect, 0) + 1
    return {variant: joint.log_odds[variant.effect] - float(np.log(count[variant.effect])) for variant in places}
