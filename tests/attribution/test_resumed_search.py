"""A search that resumes comes to where it was by what is cached, with the same result to the last bit."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from smajax.attribution import joint_search, model_cache
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_search import search_jointly
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.traces import traces_at
from smajax.core.result_cache import ResultCache
from smajax.fit.levenberg_marquardt import FitSettings
from tests.helpers.hot_weight import hot_weight


class Asked(Exception):
    """Something was asked for that is cached."""


def _refused(*given: object) -> None:
    raise Asked


def _searched(folder: Path, excluded: frozenset[str] = frozenset()) -> tuple[JointSearch, FittedModel]:
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    search = dataclasses.replace(search, settings=FitSettings(cache=ResultCache(folder)), excluded=excluded)
    return search, search_jointly(search, {(): search.joint.problem.start_values()})


def test_a_resumed_search_computes_no_linear_model_and_no_evidence_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, found = _searched(tmp_path)
    monkeypatch.setattr(joint_search, "traces_at", _refused)
    monkeypatch.setattr(model_cache, "fitted_model", _refused)
    again, same = _searched(tmp_path)
    assert again.rounds == first.rounds
    assert len(first.rounds) > 1
    assert again.detectable == first.detectable != ()
    assert (again.programs, again.traced) == (first.programs, first.traced)
    assert list(again.fitted) == list(first.fitted)
    assert same.effects == found.effects == ("latent_heat",)
    for mine, its in ((again.fitted[one], first.fitted[one]) for one in first.fitted):
        for entry in dataclasses.fields(FittedModel):
            np.testing.assert_array_equal(getattr(mine, entry.name), getattr(its, entry.name), strict=True)
    # What is not of the same search is computed.
    with pytest.raises(Asked):
        _searched(tmp_path, frozenset({"latent_heat"}))


def test_a_search_that_was_ended_between_two_rounds_goes_on_as_if_it_had_not_been(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, found = _searched(tmp_path / "whole")
    with monkeypatch.context() as once:
        calls: list[int] = []

        def ended(*given: object) -> object:
            calls.append(1)
            if len(calls) > 1:
                raise Asked
            return traces_at(*given)  # type: ignore[arg-type]

        once.setattr(joint_search, "traces_at", ended)
        with pytest.raises(Asked):
            _searched(tmp_path / "ended")
    again, same = _searched(tmp_path / "ended")
    assert again.rounds == whole.rounds
    np.testing.assert_array_equal(same.values, found.values)


def test_records_of_rounds_and_models_are_not_counted_as_fits(tmp_path: Path) -> None:
    first, _ = _searched(tmp_path)
    again, _ = _searched(tmp_path)
    fits = [one for one in tmp_path.glob("*.npz") if "words" not in np.load(one)]
    assert first.settings.cache.reused == 0
    assert again.settings.cache.reused == len(fits) > 0
