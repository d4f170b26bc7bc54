"""Markov chains give the Gaussian of the fit where that is valid, and say so when they have not yet mixed."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("blackjax", reason="the optional extra `bayes` is not installed: pip install 'smajax[bayes]'")

from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.identify import identify
from smajax.fit.posterior import CHAINS, Posterior
from smajax.report.identify_page import page
from smajax.report.identify_record import record
from smajax.report.identify_words import conclusions
from tests.fit.test_identify_declared import BOTH, TRUTH, coupon_file, unknown_section

DRAWS = 1200


def test_the_posterior_is_the_gaussian_of_the_fit_where_that_is_valid(tmp_path: Path) -> None:
    """White noise as declared, parameters known to a per mille: means, standard deviations and correlation agree."""
    found = identify(load_experiment(coupon_file(tmp_path, unknown_section() + BOTH), CATALOGUE), starts=0, draws=DRAWS)
    drawn = found.posterior
    assert drawn is not None
    assert drawn.draws.shape == (CHAINS, DRAWS, len(TRUTH))
    assert drawn.converged
    assert 0.15 < drawn.accepted < 0.6
    for estimate, draws in zip(found.estimates, drawn.flat.T, strict=True):
        assert estimate.standard_error is not None
        assert draws.mean() == pytest.approx(estimate.value, abs=0.2 * estimate.standard_error)
        assert draws.std() == pytest.approx(estimate.standard_error, rel=0.15)
    np.testing.assert_allclose(np.corrcoef(drawn.flat.T), found.correlation, atol=0.12)
    assert "The chains of the posterior agree" in " ".join(conclusions(found))
    assert record(found)["posterior"]["converged"]
    assert page(found).count('src="data:image/png') == 3 * 2 + 1 + 1 + 1
    # Chains that have not mixed are not to be used, and the page says so.
    apart = drawn.draws + drawn.draws.std() * np.arange(CHAINS)[:, None, None]
    poor = dataclasses.replace(found, posterior=dataclasses.replace(drawn, draws=apart, r_hat=np.asarray([1.3, 1.0])))
    assert "do not agree yet" in " ".join(conclusions(poor))


def test_chains_that_differ_have_not_converged() -> None:
    few = Posterior(("a",), np.zeros((4, 10, 1)), np.asarray([1.0]), np.asarray([50.0]), 0.3, 1.0)
    assert not few.converged
    assert dataclasses.replace(few, effective=np.asarray([500.0])).converged
