"""What the page says of priors that the experiment file gives."""

from __future__ import annotations

import dataclasses

from smajax.attribution.prior_finding import PriorFinding
from smajax.report.narrative.priors import of_priors
from tests.helpers.made_findings import made_findings


def test_a_prior_that_says_what_the_library_says_is_not_mentioned() -> None:
    own = PriorFinding(
        "resistivity_austenite", "ohm m", base=8e-7, width=0.1, logarithmic=True, library_base=8e-7, library_width=0.1
    )
    same = dataclasses.replace(own, library_logarithmic=True)
    assert not list(of_priors(dataclasses.replace(made_findings(), priors=(same,))))
    (said,) = of_priors(dataclasses.replace(made_findings(), priors=(own,)))
    assert "by the experiment file, and" in said
