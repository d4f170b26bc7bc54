"""Sample rates of the logs of one experiment: the step of the clock that suits them, and that they differ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.core.wording import and_listed, counted

ALIKE = 1.05  # of two periods: a smaller ratio is a clock's own
UNEVEN = 0.5  # of the usual interval: samples that differ by more are not evenly spaced
JITTER = 0.01  # likewise: by less, samples are as even as a file's digits show
MOST_SAMPLES = 2000  # of the longest log on the clock of a draft
NAMED = 3  # logs of one rate by name; of more their number


def clock_step(interval: float, longest: float, spread: float) -> tuple[float, str]:
    """(step of the clock, s; why that one). interval: of the slowest log, s; longest: duration of the longest log, s.

    spread: by how much the intervals of a log differ, over the usual one. The logs' own interval, as long as the longest
    log has MOST_SAMPLES at most; else, and where samples are not evenly spaced, the next longer one of 1, 2 and 5 times a
    power of ten.
    """
    if longest > MOST_SAMPLES * interval * (1.0 + 1e-6):
        why = f"at the logs' own {interval:.4g} s the longest would have more than {MOST_SAMPLES:,} samples"
        return _round(longest / MOST_SAMPLES), why
    if spread > UNEVEN:
        return _round(interval), f"the logs' own interval varies, and is {interval:.4g} s mostly"
    # Of a clock that jitters more digits than three are chance; of one that does not, they keep it in step with the log.
    return float(f"{interval:.3g}" if spread > JITTER else f"{interval:.6g}"), "the logs' own interval"


def _round(step: float) -> float:
    """Up to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(step))
    return float(next(nice * power for nice in (1.0, 2.0, 5.0, 10.0) if nice * power >= step * (1.0 - 1e-9)))


def rates_messages(names: Sequence[str], periods: Sequence[float]) -> list[str]:
    """One line with the rates of logs of these `names`, whose samples are `periods` (s) apart; none where they are alike."""
    groups: list[tuple[float, list[str]]] = []
    for period, name in sorted(zip(periods, names, strict=True)):
        if groups and period < ALIKE * groups[-1][0]:
            groups[-1][1].append(name)
        else:
            groups.append((period, [name]))
    if len(groups) < 2:
        return []
    rates = [
        f"{1.0 / period:.4g} Hz ({and_listed(several) if len(several) <= NAMED else counted(len(several), 'log')})"
        for period, several in groups
    ]
    return [
        f"sampling: the logs have different rates, {and_listed(rates)}: faster ones are averaged over a step of the fit's clock, and of slower "
        "ones it takes straight lines between the samples"
    ]
