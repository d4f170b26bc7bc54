"""How much a model needs its effects: where the base model leaves noise nothing is missing, unless they are far likelier."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import Round
from smajax.attribution.joint_stage import _hardly_needed
from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.optimum import as_model
from smajax.attribution.reasons import NoiseWithoutEffects
from tests.helpers.hot_weight import NOISE, hot_weight


def _fitted(effects: tuple[str, ...], evidence: float) -> Any:
    return SimpleNamespace(effects=effects, log_evidence=lambda _: evidence)


@pytest.mark.parametrize(
    ("odds", "noise", "hardly"),
    [(0.8, True, True), (2.9, True, True), (3.1, True, False), (0.8, False, False)],
)
def test_effects_are_named_over_noise_where_they_are_twenty_times_as_likely(
    odds: float, noise: bool, hardly: bool
) -> None:
    rounds: list[Round] = []
    setting = cast(
        Any,
        SimpleNamespace(config=AttributionConfig(), rounds=rounds, note=rounds.append, is_noise=lambda _: noise),
    )
    base, found = _fitted((), 5.0), _fitted(("creep", "radiation"), 5.0 + odds)
    assert _hardly_needed(setting, cast(Any, None), base, found, 1.0) is hardly
    assert [(one.chosen, one.removed) for one in rounds] == [("creep + radiation", True)] * hardly
    if hardly:
        (said,) = rounds
        assert isinstance(said.reason, NoiseWithoutEffects)
        assert said.reason.log_odds == pytest.approx(odds)
    assert not _hardly_needed(setting, cast(Any, None), base, base, 1.0)


def test_effects_stand_by_how_much_the_model_needs_them_even_where_it_was_never_fitted_without() -> None:
    """An unfinished page is of such a model; in the library the latent heat stands before the contrast of the resistances."""
    truth = {"latent_heat.enthalpy": 200.0, "phase_resistance.contrast": -0.2}
    search = hot_weight(truth)
    values = search.joint.problem.start_values()
    for name, value in truth.items():
        values[search.joint.slots[name]] = value
    effects = ("latent_heat", "phase_resistance")
    search.fitted[effects] = fitted_model(search.joint, effects, values, effects)
    assert as_model(search, search.fitted[effects], NOISE).effects == effects[::-1]
