"""The verdict: of the four, by whether something was added and whether what is left is noise."""

from __future__ import annotations

from collections.abc import Sequence

from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import Findings, ParameterFinding, ResidualDiagnostics, Verdict
from smajax.attribution.residual_diagnostics import noise_like

NOTHING_MORE = (Verdict.ADEQUATE, Verdict.EXPLAINED)


def verdict_of(added: Sequence[str], after: ResidualDiagnostics, config: AttributionConfig) -> Verdict:
    """`added`: names of the effects of the final model; `after`: of what it leaves of the fit runs."""
    if noise_like(after, config):
        return Verdict.EXPLAINED if added else Verdict.ADEQUATE
    return Verdict.PARTLY_EXPLAINED if added else Verdict.NOT_IN_LIBRARY


def unknowns_at_bounds(findings: Findings) -> tuple[ParameterFinding, ...]:
    """Unknowns of the experiment that end at a bound of their range, of a verdict that says that nothing more is missing.

    What was fitted or added beside one of them may make up for its range. A value of a preset has no range in the file, and
    one that ends at zero is off.
    """
    if findings.verdict not in NOTHING_MORE:
        return ()
    added = tuple(f"{effect.name}." for effect in findings.added)
    own = (one for one in findings.after if one.limited and not one.at_zero and not one.name.startswith(added))
    return tuple(one for one in own if one.prior_base is None or one.prior_of_unknown)
