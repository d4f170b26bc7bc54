"""Which effects held-out runs reject: those with which they are predicted worse, beyond chance, and no others."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from smajax.attribution import held_out
from smajax.attribution.config import AttributionConfig
from smajax.attribution.held_out import validated
from smajax.attribution.run_finding import RunFinding

LEFT = np.random.default_rng(1).normal(size=400)
OWN = {letters: np.random.default_rng(ord(letters[-1])).normal(size=400) for letters in ("a", "b", "ab")}


def _models(
    monkeypatch: pytest.MonkeyPatch, errors: dict[str, float], explained: bool = True, chance: bool = False
) -> tuple[list[str], Any]:
    """Stand-ins of models whose held-out residual has these root mean squares, by their effects; what was rejected, as what `may_be_chance`."""

    def residual(effects: str) -> np.ndarray:
        size = errors[effects]
        more = np.sqrt(max(size**2 - 0.25, 0.0))
        return 0.5 * LEFT + (more * OWN[effects] if effects else np.sqrt(errors[""] ** 2 - 0.25) * OWN["a"][::-1])

    def compare(job: object, setting: object, first: object, final: Any) -> tuple[Any, None, None]:
        values = {"measured": np.zeros(400), "before": -residual(""), "after": -residual("".join(final.effects))}
        before, after = (float(np.sqrt(np.mean(values[which] ** 2))) for which in ("before", "after"))
        run = RunFinding(
            name="held",
            role="held-out",
            time=np.arange(400),
            inputs={},
            measured=values["measured"],
            before=values["before"],
            after=values["after"],
            states={},
            offset_before=0.0,
            offset_after=0.0,
            rmse_before=before,
            rmse_after=after,
        )
        return (run,), None, None

    def model(effects: str) -> Any:
        return SimpleNamespace(effects=tuple(effects))

    search = SimpleNamespace(error_of=lambda _: 1.0, fitted={tuple(name): model(name) for name in errors})
    monkeypatch.setattr(held_out, "compare", compare)
    monkeypatch.setattr(
        held_out, "without", lambda search, left, gone, _: model("".join(left.effects).replace(gone, ""))
    )
    monkeypatch.setattr(held_out, "final_model", lambda search, setting, fitted, _: fitted)
    monkeypatch.setattr(held_out, "noise_like", lambda *_: explained)
    noted: list[str] = []
    setting: Any = SimpleNamespace(config=AttributionConfig(), set_aside=lambda model, reason, gone: noted.extend(gone))
    left, _, rejected = validated(None, setting, search, model(""), model("ab"))  # type: ignore[arg-type]
    assert noted == list(rejected.effects if rejected is not None else ())
    assert rejected is None or rejected.may_be_chance == chance
    return noted, left


@pytest.mark.parametrize(
    ("errors", "rejected"),
    [
        ({"": 2.0, "a": 1.0, "ab": 0.6, "b": 1.5}, []),
        ({"": 2.0, "a": 0.6, "ab": 1.2, "b": 1.5}, ["b"]),
        ({"": 1.0, "a": 1.6, "ab": 1.3, "b": 0.6}, ["a"]),  # with b, which the evidence needs less, it is nearer
        ({"": 0.6, "a": 1.6, "ab": 1.3, "b": 1.6}, ["a", "b"]),
        ({"": 1.0, "a": 1.0, "ab": 1.0, "b": 1.0}, []),  # no run says anything
    ],
)
def test_what_predicts_the_held_out_runs_worse_is_rejected(
    monkeypatch: pytest.MonkeyPatch, errors: dict[str, float], rejected: list[str]
) -> None:
    found, left = _models(monkeypatch, errors)
    assert found == rejected
    assert left.effects == tuple(name for name in "ab" if name not in rejected)


@pytest.mark.parametrize(("explained", "rejected"), [(False, ["b"]), (True, [])])
def test_what_explains_neither_the_fit_runs_nor_predicts_others_is_rejected(
    monkeypatch: pytest.MonkeyPatch, explained: bool, rejected: list[str]
) -> None:
    """Where chance may make the difference, an error of 1.3 times the base model's is enough, unless the fit runs are explained."""
    monkeypatch.setattr(held_out, "runs_compared", lambda *_: "alike")
    found, left = _models(monkeypatch, {"": 1.0, "a": 1.2, "ab": 1.5, "b": 1.1}, explained, chance=True)
    assert found == rejected
    assert left.effects == tuple(name for name in "ab" if name not in rejected)
