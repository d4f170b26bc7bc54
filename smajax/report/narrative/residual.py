"""Residual diagnostics in words, and what stays unexplained."""

from __future__ import annotations

from smajax.attribution.findings import Findings, ResidualDiagnostics, Verdict
from smajax.core.display_units import label
from smajax.core.wording import and_listed, times_noise
from smajax.report.narrative.caveats import held_out_warnings

MENTIONED = 0.2  # size of a correlation from which it is worth a sentence


def residual_sentences(result: ResidualDiagnostics) -> tuple[str, ...]:
    """Its size and autocorrelation; where it is no noise, the phase with most of it and what it is correlated with."""
    memory = "is white" if result.white else "is autocorrelated"
    if result.filter_coefficient > 0.0 and not result.white:
        memory = (
            f"is first-order autoregressive noise with coefficient {result.filter_coefficient:.2f}, and nothing beyond"
        )
    whose = "The residual of all outputs together" if len(result.noise_by_output) > 1 else "The residual"
    sentences = [f"{whose} is {times_noise(result.ratio, 'the measurement noise')} and {memory}."]
    more = [label(name) for name, noise in result.noise_by_output.items() if not noise]
    if more:
        sentences.append(
            f"By {'itself' if len(more) == 1 else 'themselves'} {and_listed(more)} {'leaves' if len(more) == 1 else 'leave'} more than noise."
        )
    if result.white or result.filter_coefficient > 0.0:
        return tuple(sentences)
    phases = result.by_phase
    worst = max(phases, key=lambda name: phases[name]["share_of_squared_error"])
    samples = sum(entry["samples"] for entry in phases.values())
    sentences.append(
        f"{phases[worst]['share_of_squared_error']:.0%} of the residual's square falls into the phase “{worst}” "
        f"({phases[worst]['samples'] / samples:.0%} of the samples)."
    )
    strongest = max(result.correlation, key=lambda name: abs(result.correlation[name]))
    if abs(result.correlation[strongest]) > MENTIONED:
        sentences.append(
            f"The residual is correlated most with {strongest.replace('_', ' ')} (correlation {result.correlation[strongest]:+.2f})."
        )
    return tuple(sentences)


def unexplained(findings: Findings) -> tuple[str, ...]:
    """What the final model leaves."""
    warned = held_out_warnings(findings)
    if findings.verdict in (Verdict.ADEQUATE, Verdict.EXPLAINED):
        return ("Nothing beyond noise on the fit runs.", *warned)
    return (*residual_sentences(findings.residual_after), *warned)
