"""The verdict: of the four, by whether something was added and whether what is left is noise."""

from __future__ import annotations

from collections.abc import Sequence

from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import ResidualDiagnostics, Verdict
from smajax.attribution.residual_diagnostics import noise_like


def verdict_of(added: Sequence[str], after: ResidualDiagnostics, config: AttributionConfig) -> Verdict:
    """`added`: names of the effects of the final model; `after`: of what it leaves of the fit runs."""
    if noise_like(after, config):
        return Verdict.EXPLAINED if added else Verdict.ADEQUATE
    return Verdict.PARTLY_EXPLAINED if added else Verdict.NOT_IN_LIBRARY
