"""How much a model needs its effects: where it leaves noise without one nothing says that this is there, unless it is far likelier."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from smajax.attribution import optimum
from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import Round
from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.optimum import as_model
from smajax.attribution.reasons import NoiseWithoutEffects
from tests.helpers.hot_weight import NOISE, hot_weight


def _fitted(effects: tuple[str, ...], evidence: float) -> Any:
    return SimpleNamespace(effects=effects, log_evidence=lambda _: evidence)


@pytest.mark.parametrize(
    ("evidence", "noise", "left"),
    [
        # Log evidence of creep + radiation, of creep, of radiation and of neither; the models that leave noise.
        ((9.0, 8.2, 4.0, 7.5), ((), ("creep",)), ()),  # neither is needed
        ((9.0, 8.2, 4.0, 5.5), ((), ("creep",)), ("creep",)),  # both together are
        ((9.0, 8.2, 4.0, 7.5), (("creep",),), ("creep",)),  # nor is what is left without both noise
        ((9.0, 5.9, 4.0, 7.5), ((), ("creep",)), ("creep", "radiation")),  # either is
        ((9.0, 8.2, 4.0, 7.5), (), ("creep", "radiation")),  # more than noise is left without either
    ],
)
def test_an_effect_is_named_over_noise_where_the_model_is_twenty_times_as_likely_with_it(
    monkeypatch: pytest.MonkeyPatch,
    evidence: tuple[float, ...],
    noise: tuple[tuple[str, ...], ...],
    left: tuple[str, ...],
) -> None:
    both = ("creep", "radiation")
    sets: tuple[tuple[str, ...], ...] = (both, both[:1], both[1:], ())
    models = {effects: _fitted(effects, value) for effects, value in zip(sets, evidence, strict=True)}
    monkeypatch.setattr(
        optimum, "without", lambda _, model, effect, __: models[tuple(one for one in model.effects if one != effect)]
    )
    monkeypatch.setattr(optimum, "leaves_noise", lambda _, model: model.effects in noise)
    rounds: list[Round] = []
    setting = cast(
        Any,
        SimpleNamespace(
            config=AttributionConfig(),
            rounds=rounds,
            note=rounds.append,
        ),
    )
    search = cast(Any, SimpleNamespace(winner=both, fitted={both[:1]: models[both[:1]]}))
    found = optimum.with_no_effect_hardly_needed(search, setting, models[both], 1.0)
    assert found.effects == search.winner == left
    assert [one.chosen for one in rounds] == [one for one in both[::-1] if one not in left]
    assert all(one.removed and isinstance(one.reason, NoiseWithoutEffects) for one in rounds)


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
