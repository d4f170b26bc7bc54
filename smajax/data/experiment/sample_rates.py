"""That logs of one experiment have different sample rates."""

from __future__ import annotations

from collections.abc import Sequence

from smajax.core.wording import and_listed, counted

ALIKE = 1.05  # of two periods: a smaller ratio is a clock's own
NAMED = 3  # logs of one rate by name; of more their number


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
