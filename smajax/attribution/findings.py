"""What one closed loop found: the record that the loop fills and that the report and its JSON are written from.

Arrays are numpy, SI, temperatures in degrees Celsius, angles in radians; nothing in here simulates or fits.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Role = Literal["fit", "held-out"]
Verdict = Literal["adequate", "explained", "partly explained", "not in the library"]


@dataclass(frozen=True)
class RunFinding:
    """One measured run beside the two models; every array has shape (n,) on the same clock."""

    name: str
    role: Role
    time: np.ndarray  # s
    inputs: dict[str, np.ndarray]  # SI, by channel name
    measured: np.ndarray  # SI unit of the output
    before: np.ndarray  # base model, the run's own offset included
    after: np.ndarray  # extended model; equal to `before` when nothing was added
    states: dict[str, np.ndarray]  # of the model after: temperature (C), martensite_fraction (-), stress (Pa)
    offset_before: float
    offset_after: float
    rmse_before: float
    rmse_after: float


@dataclass(frozen=True)
class ParameterFinding:
    """One fitted number. `standard_error` is None when the runs cannot tell it (then `remark` says so)."""

    name: str
    unit: str
    value: float
    standard_error: float | None
    lower: float
    upper: float
    start: float
    remark: str = ""  # "at its lower bound", "correlated with ...", ...


@dataclass(frozen=True)
class CoefficientFinding:
    value: float
    standard_error: float | None
    unit: str
    by_runs: tuple[float, float] | None = None  # where 95 % of fits to runs drawn anew lie: no interval of confidence


@dataclass(frozen=True)
class EffectFinding:
    """One candidate of the library. `evidence` holds numbers only; NaN where a stage was not reached."""

    name: str  # "latent_heat"
    title: str  # "latent heat of transformation"
    equation: str  # the equation it changes: heat, electrical, kinetics, constitutive, mechanics, sensor, input
    formula: str  # the change itself, plain text, with its source
    sentence: str  # one sentence for an engineer: what it would mean if it were there
    added: bool
    coefficients: dict[str, CoefficientFinding]
    evidence: dict[str, float]  # score_statistic, score_p_value, leave_one_out_rmse, leave_one_out_gain, rmse_fit, ...


@dataclass(frozen=True)
class Portrait:
    """What the residual (measured minus model) of the fit runs looks like."""

    rmse: float
    noise_sigma: float
    ratio: float  # rmse / noise_sigma
    white: bool
    whiteness_p_value: float
    independent: float  # samples that its memory leaves
    by_phase: dict[str, dict[str, float]]  # "heating, transforming" -> {samples, share_of_squared_error, mean, rmse}
    correlation: dict[str, float]  # with time, input, temperature, martensite_fraction, stress, rate
    sentences: tuple[str, ...]
    kept: float = 0.0  # of the sample before, where it is taken as a first-order noise larger than estimated; else 0


@dataclass(frozen=True)
class Round:
    """One round of the search: what was tried and what it brought on runs left out in turn."""

    number: int
    tried: tuple[tuple[str, float], ...]  # ("latent_heat + radiation", leave-one-out rmse)
    chosen: str  # "" when the search stopped here
    why: str
    alike: tuple[str, ...] = ()  # what left-out runs cannot tell from the chosen one, chosen because it is simplest


@dataclass(frozen=True)
class Rival:
    """A candidate that could be mistaken for an effect that was added."""

    effect: str
    rival: str
    alike: float  # share of the effect's trace in these runs that the rival could have left, 0..1
    weight: float  # of the model that has it instead, among the model and all its rivals, 0..1
    left_out_rmse: float  # SI
    separating_run: str  # the run on which the two fitted models differ most; "" where none was looked for
    separation: float  # by how many times the noise, rms


@dataclass(frozen=True)
class LoneRun:
    """A fit run that the others do not go with, by the model fitted to these alone; errors in SI."""

    run: str
    effects: tuple[str, ...]  # of that model; none: the base model
    noise: bool  # whether what it leaves of the others is noise
    others_with: float  # error on the others, fitted to all runs
    others_without: float  # and to the others alone
    foretold: float  # error on this run, by the fit to the others


@dataclass(frozen=True)
class Formula:
    """A simple formula for a function that was learnt, SI; `curve`: its values along the function's range."""

    text: str  # "0.12 + 3.1e-05 T^2"
    missed: float  # chi-square against the learnt function
    numbers: int  # that it has
    bic: float
    curve: np.ndarray


@dataclass(frozen=True)
class UnknownTerm:
    """A smooth function of one state, put into one equation for what no effect of the library accounts for; SI."""

    name: str  # "unknown_loss_of_temperature"
    title: str  # "a heat loss depending on the temperature over the air's"
    equation: str
    symbol: str  # of the state
    state: str  # in words
    state_unit: str
    unit: str  # of the function
    named: bool  # the one that foretells left-out runs best, better than the model without it beyond chance, and held-out ones better
    alike: tuple[str, ...]  # terms that left-out runs cannot tell from the named one
    why: str
    score_gain: float
    left_out_before: float
    left_out_after: float
    held_out_before: float | None  # on the held-out runs, where the term was asked for that
    held_out_after: float | None
    at: np.ndarray  # states, (points,)
    values: np.ndarray  # the function there
    error: np.ndarray  # its standard error there
    error_held: np.ndarray  # the same with the model's parameters held at their values
    cells: np.ndarray  # edges of cells of the range, (cells + 1,)
    samples: np.ndarray  # samples of the fit runs in each cell
    formulas: tuple[Formula, ...]


@dataclass(frozen=True)
class Findings:
    experiment: str  # short name
    title: str
    source: str  # path of the experiment file as given
    verdict: Verdict
    summary: tuple[str, ...]  # the answer, in sentences
    unexplained: tuple[str, ...]  # what stays unexplained
    cannot_know: tuple[str, ...]  # what these runs cannot tell
    check: tuple[str, ...]  # what was said before anything was fitted
    output_name: str
    output_unit: str  # SI
    noise_sigma: float
    noise_how: str  # "given" or "estimated ..."
    runs: tuple[RunFinding, ...]
    before: tuple[ParameterFinding, ...]
    after: tuple[ParameterFinding, ...]
    effects: tuple[EffectFinding, ...]
    portrait_before: Portrait
    portrait_after: Portrait
    rounds: tuple[Round, ...]
    rivals: tuple[Rival, ...] = ()
    unknown: tuple[UnknownTerm, ...] = ()  # terms sought for what the library does not hold, best first
    lone_runs: tuple[LoneRun, ...] = ()  # fit runs that the others do not go with
    provenance: dict[str, str] = field(default_factory=dict)  # versions, seed, data hashes, command, seconds
