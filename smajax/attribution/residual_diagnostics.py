"""Portrait of a residual: its size against the noise, its memory, and where in a run it lives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smajax.attribution.findings import Portrait
from smajax.core.whiteness import WHITE, correlation_time, first_order, whiteness_p_value
from smajax.core.wording import times_noise

# A residual may miss the noise level by this share of its mean square and still be called noise: a noise sigma is
# rarely known better, and no effect worth a name hides in 2 %.
LEFT_OVER = 0.02
# A noise with a memory misses its own level by more: by so many standard errors of its mean square it is still noise, but
# not by more than the second share. A third of the noise may hide in that.
ERRORS, MOST_LEFT_OVER = 2.0, 0.1
# A residual without memory of up to so many times the declared noise is noise that was declared too small. One that is
# larger belongs to data that the model knows nothing of, such as shuffled ones.
DECLARED_TOO_SMALL = 3.0
# A noise that was estimated from neighbouring samples is its fast part alone. A residual that is the noise of a first-order
# filter and nothing beyond is that noise with its slow part: what a model lacks has another memory, which a test on some
# hundred samples sees at a trace of the noise's size. The filter may keep so much of the sample before, what it is fed is so
# many times the estimate at most (1.6 times where it keeps nearly all), and so many independent samples have to be there.
KEPT, FED, LEAST_INDEPENDENT = 0.95, 2.0, 50


def phase_of(fraction: np.ndarray, temperature: np.ndarray, ambient: float) -> np.ndarray:
    """One word per sample for what the wire is doing, from the model's own states; shape (n,)."""
    rate = np.gradient(fraction)
    moving = np.abs(rate) > 1e-4
    warming = np.gradient(temperature) > 0.0
    hot = temperature - ambient > 0.25 * max(float(np.max(temperature) - ambient), 1e-9)
    resting = np.where(hot, np.where(warming, "hot, warming", "hot, cooling"), "cold")
    return np.where(moving, np.where(rate < 0.0, "heating, transforming", "cooling, transforming"), resting)


def portrait(
    residuals: Sequence[np.ndarray],
    states: Sequence[Mapping[str, np.ndarray]],
    noise_sigma: float,
    noise_given: bool = True,
) -> Portrait:
    """Portrait of the fit runs' residuals (SI, one array of shape (n,) a run). `noise_given`: and not estimated.

    `states` gives, run by run, series of the model to hold the residual against; `temperature` and
    `martensite_fraction` are needed, others (inputs, stress, rates) are correlated as well.
    """
    everything = np.concatenate(residuals)
    rmse = float(np.sqrt(np.mean(everything**2)))
    p_value = whiteness_p_value(residuals)
    ambient = min(float(np.min(state["temperature"])) for state in states)
    phases = np.concatenate([phase_of(state["martensite_fraction"], state["temperature"], ambient) for state in states])
    total = float(everything @ everything)
    by_phase = {}
    for phase in sorted(set(phases.tolist())):
        here = everything[phases == phase]
        by_phase[str(phase)] = {
            "samples": float(len(here)),
            "share_of_squared_error": float(here @ here) / total if total else 0.0,
            "mean": float(here.mean()),
            "rmse": float(np.sqrt(np.mean(here**2))),
        }
    correlation = {}
    for name in states[0]:
        series = np.concatenate([np.asarray(state[name], float) for state in states])
        spread = series.std() * everything.std()
        correlation[name] = (
            float(np.mean((series - series.mean()) * (everything - everything.mean())) / spread) if spread else 0.0
        )
    ratio = rmse / noise_sigma
    white = p_value > WHITE
    kept = 0.0 if noise_given else _kept(residuals, noise_sigma)
    return Portrait(
        rmse,
        noise_sigma,
        ratio,
        white,
        p_value,
        len(everything) / correlation_time(residuals),
        by_phase,
        correlation,
        _sentences(ratio, white, kept, by_phase, correlation),
        kept,
    )


def noise_like(found: Portrait) -> bool:
    """Nothing left to explain: no memory beyond chance, or no larger than the noise but for what its memory accounts for."""
    return found.kept > 0.0 or _is_noise(found.ratio, found.white, found.independent)


def _is_noise(ratio: float, white: bool, independent: float) -> bool:
    excess = 1.0 - (1.0 / max(ratio, 1e-9)) ** 2
    chance = ERRORS * float(np.sqrt(2.0 / max(independent, 1.0)))
    return excess <= min(max(LEFT_OVER, chance), MOST_LEFT_OVER) or (white and ratio < DECLARED_TOO_SMALL)


def _kept(residuals: Sequence[np.ndarray], noise_sigma: float) -> float:
    """Share of the sample before that a first-order filter keeps whose noise the residual is; 0 where it is none."""
    found = first_order(residuals)
    independent = sum(len(run) for run in residuals) / correlation_time(residuals)
    enough = independent > LEAST_INDEPENDENT and found.p_value > WHITE
    return found.coefficient if enough and 0.0 < found.coefficient < KEPT and found.sigma < FED * noise_sigma else 0.0


def all_noise(residuals: Sequence[np.ndarray], noise_sigma: float, noise_given: bool = True) -> bool:
    """`noise_like` of residuals (SI, one array of shape (n,) a run) whose portrait nobody needs."""
    everything = np.concatenate(residuals)
    ratio = float(np.sqrt(np.mean(everything**2))) / noise_sigma
    independent = len(everything) / correlation_time(residuals)
    plain = _is_noise(ratio, whiteness_p_value(residuals) > WHITE, independent)
    return plain or (not noise_given and _kept(residuals, noise_sigma) > 0.0)


def _sentences(
    ratio: float,
    white: bool,
    kept: float,
    by_phase: Mapping[str, Mapping[str, float]],
    correlation: Mapping[str, float],
) -> tuple[str, ...]:
    memory = "has no memory" if white else "has a memory: one sample tells the next"
    if kept > 0.0 and not white:
        memory = f"has the memory of a first-order noise, which keeps {kept:.2f} of the sample before, and none beyond"
    told = [f"The residual is {times_noise(ratio, 'the measurement noise')} and {memory}."]
    if white or kept > 0.0:
        return tuple(told)
    worst = max(by_phase, key=lambda name: by_phase[name]["share_of_squared_error"])
    told.append(
        f"{by_phase[worst]['share_of_squared_error']:.0%} of its square falls into the phase “{worst}” "
        f"({by_phase[worst]['samples'] / sum(entry['samples'] for entry in by_phase.values()):.0%} of the samples)."
    )
    strongest = max(correlation, key=lambda name: abs(correlation[name]))
    if abs(correlation[strongest]) > 0.2:
        told.append(f"It goes most with {strongest.replace('_', ' ')} (correlation {correlation[strongest]:+.2f}).")
    return tuple(told)
