"""Numbers in sentences: in the unit that an engineer reads, three digits."""

from __future__ import annotations

from smajax.attribution.findings import AssumedParameter, Findings, ParameterFinding
from smajax.core.display_units import digits, display


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
    return f"{parameter.name} {digits(seen.of(parameter.value))} {seen.unit}".strip()


def far_text(findings: Findings, parameter: ParameterFinding) -> str:
    """`3.1 widths of its prior above the middle of that, 75000 MPa`, where it is far; else nothing."""
    base, deviation = parameter.prior_base, parameter.prior_deviation
    if base is None or deviation is None or abs(deviation) <= findings.config.far_from_prior:
        return ""
    seen, side = display(parameter.unit, parameter.name), "above" if deviation > 0.0 else "below"
    middle = f"{digits(seen.of(base))} {seen.unit}".strip()
    return f"{abs(deviation):.1f} widths of its prior {side} the middle of that, {middle}"
