"""PySINDy on what the refitted base model leaves: `python -m studies.attribution_benchmark.peers.sindy_peer FILE`.

Runs in an environment of its own with numpy and pysindy, from the folder that has `studies`; prints JSON.

Two forms are tried, as discrepancies are learnt with SINDy: the residual as a polynomial of the base model's states
(handed to `fit` as `x_dot`), and its rate, r itself among the states, simulated to predict it. Everything is scaled, noise
in the derivative is smoothed (`SmoothedFiniteDifference`), as the project's practical tips ask for; degree, threshold and
ridge are the best at predicting each fit run from the others, as its cross-validation example has it; that may be no
term at all: then nothing is missing. With `--sparse`, of all that predict as well as the best within one standard error
the sparsest is taken.
"""

from __future__ import annotations

import argparse
import itertools
import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.peers.given import Given, error, load

FORMS = ("value", "rate")
DEGREES = {"value": (1, 2, 3), "rate": (1, 2)}
THRESHOLDS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # noises, of a term as large as a standard deviation of each factor
RIDGES = (0.05, 5.0)  # the first is the default
ZEROS = 3  # passes in which each run's zero is found beside the terms
SAME = 0.999  # correlation from which on two states are one
BURST = 1e4  # noises: a simulated residual that runs away
SMOOTHED = 11  # samples
TOLD = 4  # terms that are written out


@dataclass(frozen=True)
class Setting:
    """What cross-validation chooses."""

    form: str
    degree: int
    threshold: float
    ridge: float


@dataclass(frozen=True)
class Data:
    """Runs as SINDy takes them: scaled states (n, F), residuals and their rates (n,), names of the states."""

    names: tuple[str, ...]
    states: list[np.ndarray]
    residuals: list[np.ndarray]
    rates: list[np.ndarray]
    step: float  # in units of how long the residual takes to change by as much as it is


@dataclass(frozen=True)
class Library:
    """The polynomial terms of one form and degree: a column of each run's table a term."""

    names: list[str]
    powers: NDArray[np.int_]  # (terms, states; r first where the form is a rate)
    tables: list[np.ndarray]  # (n, terms), run by run


def equation_of(variables: frozenset[str], coupon: bool) -> str:
    """The equation that a term of the reading's residual points to, "" where its states do not tell.

    What the reading alone says is the sensor's; its rate too, as a lag is. What goes with the rate of the fraction or of
    the stress comes early or late: kinetics. A function of temperature, stress and fraction is a strain: constitutive.
    The command is the circuit's, the rate of the temperature the heat balance's; of a coupon, whose command is the
    temperature, that rate is a late input. Time alone is a drift of the sensor.
    """
    if not variables:
        return ""
    if variables <= {"output", "output_rate"} or variables == {"time"}:
        return "sensor"
    wire = {"temperature", "stress", "martensite_fraction"}
    if variables <= wire:
        return "constitutive"
    if variables <= wire | {"martensite_fraction_rate", "stress_rate"}:
        return "kinetics"
    if variables == {"temperature_rate"}:
        return "input" if coupon else "heat"
    if variables == {"command"} and not coupon:
        return "electrical"
    return ""


def states_of(given: Given) -> tuple[tuple[str, ...], list[np.ndarray]]:
    """Names and, run by run, states (n, F) by mean and deviation of the fit runs; one of several that are the same."""
    columns: dict[str, list[np.ndarray]] = {}
    for name in ("temperature", "stress", "martensite_fraction"):
        columns[name] = [run.states[name] for run in given.runs]
    columns["output"] = [run.base for run in given.runs]
    columns["command"] = [next(iter(run.inputs.values())) for run in given.runs]
    for name in list(given.runs[0].inputs)[1:]:
        columns[name] = [run.inputs[name] for run in given.runs]
    for name in ("temperature", "martensite_fraction", "stress", "output"):
        columns[f"{name}_rate"] = [np.gradient(series, given.step) for series in columns[name]]
    columns["time"] = [given.step * np.arange(len(run.reading)) for run in given.runs]
    names: list[str] = []
    kept: list[list[np.ndarray]] = []
    for name, series in columns.items():
        fitted = np.concatenate([one for one, run in zip(series, given.runs, strict=True) if run.fitted])
        spread = float(fitted.std())
        if spread <= 1e-9 * max(float(np.abs(fitted).max()), 1e-300):
            continue
        scaled = [(one - fitted.mean()) / spread for one in series]
        flat = (fitted - fitted.mean()) / spread
        known = [np.concatenate([one for one, run in zip(k, given.runs, strict=True) if run.fitted]) for k in kept]
        if any(abs(float(np.mean(flat * one))) > SAME for one in known):
            continue
        names.append(name)
        kept.append(scaled)
    return tuple(names), [np.stack([one[k] for one in kept], axis=1) for k in range(len(given.runs))]


def data_of(given: Given) -> Data:
    """All runs, in their order."""
    import pysindy

    names, states = states_of(given)
    residuals = [run.residual for run in given.runs]
    smooth = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": SMOOTHED})
    rates = [np.asarray(smooth(one[:, None], given.step))[:, 0] for one in residuals]
    fitted = [k for k, run in enumerate(given.runs) if run.fitted]
    quick = float(
        np.concatenate([rates[k] for k in fitted]).std() / np.concatenate([residuals[k] for k in fitted]).std()
    )
    return Data(names, states, residuals, [one / quick for one in rates], given.step * quick)


def library_of(form: str, degree: int, data: Data) -> Library:
    """Terms of all runs, once: a `SINDy` object makes them anew at each fit, which is most of its time."""
    import pysindy

    library, names = pysindy.PolynomialLibrary(degree=degree), list(data.names)
    states = data.states
    if form == "rate":
        names = ["r", *names]
        states = [np.column_stack([r, one]) for r, one in zip(data.residuals, data.states, strict=True)]
    library.fit(states[0])
    tables = [np.asarray(library.transform(one)) for one in states]
    return Library(library.get_feature_names(names), np.asarray(library.powers_), tables)


def fitted(setting: Setting, library: Library, data: Data, runs: Sequence[int]) -> np.ndarray:
    """SINDy's weight of every term, (terms,), fitted to `runs`."""
    import pysindy

    optimizer = pysindy.STLSQ(threshold=setting.threshold, alpha=setting.ridge)
    table = np.concatenate([library.tables[k] for k in runs])
    zeros = [0.0] * len(runs)
    for _ in range(ZEROS if setting.form == "value" else 1):
        own = data.residuals if setting.form == "value" else data.rates
        target = np.concatenate([own[k] + zero for k, zero in zip(runs, zeros, strict=True)])
        weights = np.asarray(optimizer.fit(table, target[:, None]).coef_)[0]
        zeros = [float(np.mean(library.tables[k] @ weights)) for k in runs]
    return weights


def _simulated(weights: np.ndarray, library: Library, states: np.ndarray, step: float) -> np.ndarray:
    """The residual from 0 on, Heun's steps; infinite where it runs away."""
    used = np.flatnonzero(weights)
    # All factors but that of r itself, for all samples at once.
    known = np.prod(states[:, None, :] ** library.powers[None, used, 1:], axis=2) * weights[used]
    own = library.powers[used, 0]
    found = np.zeros(len(states))
    for k in range(len(states) - 1):
        here = found[k]
        slope = float(known[k] @ here**own)
        ahead = float(known[k + 1] @ (here + step * slope) ** own)
        found[k + 1] = here + 0.5 * step * (slope + ahead)
        if not abs(found[k + 1]) < BURST:
            return np.full(len(states), np.inf)
    return found


def predicted(setting: Setting, weights: np.ndarray, library: Library, data: Data, run: int) -> np.ndarray:
    """The residual of a run, (n,), from the base model's states alone."""
    if not weights.any():
        return np.zeros(len(data.residuals[run]))
    if setting.form == "rate":
        return _simulated(weights, library, data.states[run], data.step)
    return np.asarray(library.tables[run] @ weights)


def _square(measured: np.ndarray, found: np.ndarray) -> float:
    return error([(measured, found)]) ** 2 if np.isfinite(found).all() else np.inf


def crossed(setting: Setting, library: Library, data: Data, runs: Sequence[int]) -> np.ndarray:
    """Mean square of each fit run, predicted from the others."""
    found = []
    for out in runs:
        weights = fitted(setting, library, data, [run for run in runs if run != out])
        found.append(_square(data.residuals[out], predicted(setting, weights, library, data, out)))
    return np.asarray(found)


@dataclass(frozen=True)
class Found:
    """A model of the residual."""

    setting: Setting
    weights: np.ndarray  # (terms,)
    library: Library
    left_out: np.ndarray  # mean square of each fit run by the model of the others

    @property
    def terms(self) -> int:
        """How many are not zero."""
        return int(np.count_nonzero(self.weights))


def chosen(data: Data, runs: Sequence[int], sparse: bool) -> Found | None:
    """The model that predicts left-out runs best; or none.

    `sparse`: the one with the fewest terms of those that do as well within one standard error.
    """
    nothing = np.asarray([_square(data.residuals[run], np.zeros(1)) for run in runs])
    scores: dict[Setting, np.ndarray] = {}
    libraries = {(form, degree): library_of(form, degree, data) for form in FORMS for degree in DEGREES[form]}
    for (form, degree), library in libraries.items():
        for ridge, threshold in itertools.product(RIDGES, THRESHOLDS):
            setting = Setting(form, degree, threshold, ridge)
            score = crossed(setting, library, data, runs)
            if np.isfinite(score).all():
                scores[setting] = score
    best = min([nothing, *scores.values()], key=np.mean)

    def as_good(score: np.ndarray) -> bool:
        more = score - best
        if not sparse:
            return float(more.mean()) <= 0.0
        return float(more.mean()) <= float(more.std(ddof=1)) / len(more) ** 0.5

    if as_good(nothing):
        return None
    models = []
    for setting, score in scores.items():
        if as_good(score):
            library = libraries[setting.form, setting.degree]
            models.append(Found(setting, fitted(setting, library, data, runs), library, score))
    return min(models, key=lambda one: (one.terms, float(one.left_out.mean())))


def terms_of(found: Found, data: Data, runs: Sequence[int]) -> list[tuple[str, frozenset[str], float]]:
    """(formula, states in it, standard deviation over the fit runs in noises or their rate), the largest first."""
    names = (*(["r"] if found.setting.form == "rate" else []), *data.names)
    sizes = np.concatenate([found.library.tables[run] for run in runs]).std(axis=0) * np.abs(found.weights)
    terms = []
    for term, powers, weight, size in zip(found.library.names, found.library.powers, found.weights, sizes, strict=True):
        if weight:
            own = frozenset(name for name, power in zip(names, powers, strict=True) if power and name != "r")
            terms.append((f"{weight:+.3g} {term}", own, float(size)))
    return sorted(terms, key=lambda one: -one[2])


def run(given: Given, sparse: bool = False) -> dict[str, Any]:
    """What is printed."""
    from importlib.metadata import version

    data = data_of(given)
    fit, unseen = ([k for k, one in enumerate(given.runs) if one.fitted is role] for role in (True, False))
    found = chosen(data, fit, sparse)

    def off(runs: Sequence[int]) -> float:
        made = [
            np.zeros(len(data.residuals[k]))
            if found is None
            else predicted(found.setting, found.weights, found.library, data, k)
            for k in runs
        ]
        pairs = list(zip([data.residuals[k] for k in runs], made, strict=True))
        return error(pairs) if all(np.isfinite(one).all() for one in made) else float("inf")

    said: dict[str, Any] = {
        "version": version("pysindy"),
        "fit_error": off(fit),
        "held_out_error": off(unseen),
        "adequate": found is None,
        "where": [],
        "said": "no term",
    }
    if found is None:
        return said
    terms = terms_of(found, data, fit)
    first = next((own for _, own, _ in terms if own), frozenset())
    equation = equation_of(first, given.rig == "coupon")
    left = "r" if found.setting.form == "value" else "dr/dt"
    written = " ".join(term for term, _, _ in terms[:TOLD]) + (f" and {len(terms) - TOLD} more" if terms[TOLD:] else "")
    return {**said, "where": [equation] if equation else [], "said": f"{left} = {written}"}


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("file", type=Path)
    asked.add_argument("--sparse", action="store_true", help="the sparsest model within one standard error of the best")
    options = asked.parse_args()
    warnings.simplefilter("ignore")  # of thresholds that leave no term: that is an answer here
    import pysindy  # noqa: F401  # before the limit, which holds for what is loaded
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):  # tables this small: threads that wait for each other take most of the time
        print(json.dumps(run(load(options.file), options.sparse)))


if __name__ == "__main__":
    main()
