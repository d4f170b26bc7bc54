"""Numbers in sentences: in the unit that an engineer reads, three digits."""

from __future__ import annotations

import math

from smajax.attribution.findings import AssumedParameter, Findings, ParameterFinding
from smajax.core.display_units import digits, display, written

MOST_ODDS = math.log(1e6)  # more is as good as certain


def value_text(value: float, unit: str, quantity: str) -> str:
    """`value` (SI) in the unit that a reader sees: `0.12 mm`."""
    seen = display(unit, quantity)
    return f"{seen.of(value):.3g} {seen.unit}"


def error_text(findings: Findings, value: float) -> str:
    """An error of the output, SI."""
    return value_text(value, findings.output_unit, findings.output_name)


def assumed_text(parameter: AssumedParameter) -> str:
    """`wire_length 0.9 m`."""
    seen = display(parameter.unit, parameter.name)
    return f"{parameter.name} {seen.with_unit(parameter.value)}"


def far_text(findings: Findings, parameter: ParameterFinding) -> str:
    """`3.1 standard deviations above what was known before, 75 GPa`, where it is far; else nothing."""
    base, deviation = parameter.prior_base, parameter.prior_deviation
    if base is None or deviation is None or abs(deviation) <= findings.config.far_from_prior:
        return ""
    side = "above" if deviation > 0.0 else "below"
    return f"{abs(deviation):.1f} standard deviations {side} what was known before, {as_written(parameter, base)}"


def as_written(parameter: ParameterFinding, value: float) -> str:
    """A value of it as an engineer writes it: `75 GPa`."""
    shown = display(parameter.unit, parameter.name)
    seen = written(parameter.unit, value) if shown.unit == "MPa" else shown
    return seen.with_unit(value)


def log_odds_text(value: float) -> str:
    """`5.6 in log odds (270 to 1)`, of its size."""
    size = abs(value)
    if math.isnan(size):
        return "– in log odds"
    times = math.exp(min(size, MOST_ODDS))
    odds = digits(times, 2) if times < 10.0 else f"{float(f'{times:.2g}'):,.0f}"
    return f"{size:.1f} in log odds ({odds if size < MOST_ODDS else 'more than a million'} to 1)"
