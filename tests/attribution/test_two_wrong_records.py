"""Records that are wrong in two runs, and those that are corrected on trial."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from importlib import import_module
from types import SimpleNamespace
from typing import Any, cast

import jax
import numpy as np
import pytest

from smajax.attribution import record_fits
from smajax.attribution.context import Context, Outcome
from smajax.attribution.doubtful_runs import Left
from smajax.attribution.input_of_run import record_errors, standing
from smajax.attribution.model_fits import Model, Search, Start
from smajax.attribution.record_error import (
    NO_RECORDS,
    CorrectedRecords,
    FoundRecordErrors,
    NotConfirmed,
    RecordError,
)
from smajax.attribution.record_fits import KINDS, Beside, Event, Fit, likeliest
from smajax.core.progress import Result
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import Experiment, Run
from smajax.report.narrative.record_errors import what_is_searched
from tests.helpers.hot_weight import DT, SAMPLES, UNKNOWNS, VOLTS, hot_weight
from tests.helpers.wrong_records import FOUND, demo, early

loop = import_module("smajax.attribution.close_loop")


def _twice_wrong(
    second: Callable[[jax.Array], jax.Array], truth: dict[str, float]
) -> tuple[Search, list[Model], list[Run]]:
    """The base model and one with latent heat, of six runs, the third at a level that was noted a tenth too high, and the first changed by `second`."""
    joint = hot_weight(truth, ("latent_heat",), steps=(*VOLTS, (7.5, 3.0), (8.5, 2.0))).joint
    batch = joint.problem.batch
    volts = batch.inputs["voltage"]
    volts = volts.at[2].set(volts[2] / 0.9).at[0].set(second(volts[0]))
    problem = dataclasses.replace(joint.problem, batch=dataclasses.replace(batch, inputs={"voltage": volts}))
    setting = Search(problem, UNKNOWNS, joint.bounds, ("latent_heat",), ResultCache())
    models = []
    for effects in ((), ("latent_heat",)):
        (fit,), _ = setting.fit([Start(effects, problem.start_values())], "a fit", settled=1e-3)
        models.append(Model(effects, fit.values, fit.cost, np.zeros(volts.shape), 0.0))
    time = np.asarray(DT * np.arange(SAMPLES), dtype=np.float64)
    runs = [
        Run(f"run {k}", "fit", time, {"voltage": np.asarray(one)}, {"position": problem.measured[k]}, {}, (), "")
        for k, one in enumerate(volts)
    ]
    return setting, models, runs


@pytest.mark.parametrize(
    ("second", "coefficient", "value", "truth"),
    [
        (early, "input_delay.delay", 0.6, {}),
        pytest.param(lambda volts: volts / 1.08, "input_level.gain", 0.08, {}, marks=pytest.mark.slow),
        (early, "input_delay.delay", 0.6, {"latent_heat.enthalpy": 1.2e4}),
    ],
    ids=["recorded early", "noted too low", "recorded early beside a latent heat"],
)
def test_records_that_are_wrong_in_two_runs_are_named_together(
    second: Callable[[jax.Array], jax.Array], coefficient: str, value: float, truth: dict[str, float]
) -> None:
    """With either corrected much is left by the other one."""
    setting, (base, extended), runs = _twice_wrong(second, truth)
    hosts = (base, extended) if truth else (base,)
    assert record_errors(setting, hosts, base, runs) is None
    found = record_errors(setting, hosts, base, runs, trials=True)
    assert found is not None
    assert found.beside == tuple(dict.fromkeys(name.split(".")[0] for name in truth))
    sizes = {(one.run, one.coefficient): one for one in found.errors}
    assert set(sizes) == {("run 0", coefficient), ("run 2", "input_level.gain")}
    for one, right in ((sizes["run 0", coefficient], value), (sizes["run 2", "input_level.gain"], -0.1)):
        assert not one.on_trial  # noise is left with both
        assert one.value == pytest.approx(right, abs=max(4.0 * one.standard_error, 1e-3 * abs(right)))
        assert one.standard_error < 0.02 * abs(right)


def test_the_second_record_is_sought_in_every_run_without_which_about_as_little_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One Gauss-Newton step does not say which of them it is."""
    level, load = KINDS[2:]
    possible = {f"{kind.coefficient}[{run}]": (kind, run) for run in "abcde" for kind in (level, load)}
    batch = SimpleNamespace(runs=5, mask=np.ones((5, 4)))
    problem = SimpleNamespace(batch=batch, per_run=SimpleNamespace(runs=tuple("abcde")), start_values=lambda: None)
    setting = SimpleNamespace(problem=SimpleNamespace(noise_sigma=0.1))
    host = Model((), np.zeros(1), 1.0, np.zeros((5, 4)), 1.0)
    beside = Beside(cast(Any, setting), host, cast(Any, SimpleNamespace(problem=problem)), possible, np.ones((5, 4)))
    wrong = {"input_level.gain[e]", "wrong_load.share[d]"}
    tried: list[tuple[str, ...]] = []

    def fitted(_: Beside, sets: Sequence[tuple[str, ...]], values: object) -> list[Fit]:
        tried.extend(sets)
        fits = []
        for names in sets:
            likely = float(
                len(wrong & set(names))
                - 0.1 * len(names)
                + 0.5 * (wrong.intersection(names) == {"input_level.gain[e]"})
            )
            model = SimpleNamespace(log_evidence=lambda _, likely=likely: likely, values=None)
            fits.append(Fit(host, tuple(Event(name[:-3], name[-2], 0.1) for name in names), cast(Any, model), 1.0))
        return fits

    groups = ((2, 4), (3, 4), (0, 1))
    left = Left(groups, np.full(3, 10.0), np.asarray([1.0, 1.5, 9.0]), 0.1)
    monkeypatch.setattr(record_fits, "left_without", lambda *_: (left, left))
    monkeypatch.setattr(Beside, "_fitted", fitted)
    found = likeliest(beside.in_two_runs([], 1.0), 1.0)
    assert {event.name for event in found.events} == wrong
    pairs = {frozenset(one) for one in tried if len(one) == 2}
    assert {name[-2] for pair in pairs for name in pair} == set("cde")  # a and b leave nine times as much
    assert all(any(name.endswith("[e]") for name in pair) for pair in pairs)


def _loop_with_a_trial(
    monkeypatch: pytest.MonkeyPatch, left: float, needed: bool, ended: bool, again: bool = False
) -> tuple[Context, list[tuple[int, bool]], list[object]]:
    """(final context, records corrected and whether trials are allowed in each search, what was said), of a search that leaves so many noises beside a record on trial.

    `ended`: whether the record was asked for when the first search had come to its end; `again`: whether the next search finds it too, and not on trial.
    """
    experiment = demo()
    tried = dataclasses.replace(FOUND, on_trial=True)
    said: list[object] = []
    asked: list[tuple[int, bool]] = []
    problem = hot_weight({}).joint.problem
    samples = float(np.asarray(problem.batch.mask).sum())

    def context(experiment: Experiment, *_: object, records: CorrectedRecords = NO_RECORDS) -> Context:
        job = SimpleNamespace(experiment=experiment, problem=problem, fit_runs=())
        setting = SimpleNamespace(cache=None, progress=said.append, config=None)
        none = cast(Any, None)
        return Context(cast(Any, job), cast(Any, setting), np.zeros(1), none, 1, none, None, records)

    def searched(context: Context, *_: object) -> tuple[Context, Outcome]:
        asked.append((len(context.records.errors), context.records.trials))
        noises = left if context.records.errors else 50.0
        model = Model((), np.zeros(1), samples * noises**2, np.zeros((1, 1)), 0.0)
        asks = not ended and not context.records.errors and context.records.asks
        search = SimpleNamespace(wrong_record="a record" if asks else None)
        return context, Outcome(cast(Any, search), model, model)

    def wrong(context: Context, _: Outcome) -> FoundRecordErrors | None:
        records = context.records
        if records.may_try:
            return FoundRecordErrors((tried,), ())
        found = again and records.asks and not records.errors
        return FoundRecordErrors((dataclasses.replace(tried, on_trial=False),), ()) if found else None

    def standing(errors: tuple[RecordError, ...], *_: object) -> tuple[RecordError, ...]:
        return errors if needed else ()

    for name, instead in (
        ("prepared", context),
        ("searched_finely", searched),
        ("wrong_record", wrong),
        ("standing", standing),
    ):
        monkeypatch.setattr(loop, name, instead)
    final, outcome = loop.with_records_corrected(context(experiment))
    # The models are of the runs as the final context has them.
    assert outcome.final.cost == samples * (left if final.records.errors else 50.0) ** 2
    logged = final.records.errors == ()
    assert (final.job.experiment is experiment) is logged
    return final, asked, [one.record for one in said if isinstance(one, Result)]


def test_a_record_on_trial_stands_where_the_search_beside_it_comes_down_to_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    final, asked, said = _loop_with_a_trial(monkeypatch, 1.0, needed=True, ended=False)
    assert [one.on_trial for one in final.records.errors] == [True]  # until the end of the loop
    assert not final.records.confirmed().on_trial
    assert asked == [(0, True), (1, True)]
    (begun,) = said
    assert what_is_searched(cast(FoundRecordErrors, begun)).endswith("on trial: more than noise is left")


@pytest.mark.parametrize(
    ("left", "needed"), [(5.0, True), (1.0, False)], ids=["more than noise is left", "what was found later explains it"]
)
@pytest.mark.parametrize("ended", [False, True])
def test_a_record_that_does_not_stand_is_taken_as_it_was_logged(
    monkeypatch: pytest.MonkeyPatch, left: float, needed: bool, ended: bool
) -> None:
    """The search is made again without, unless it had come to its end before the record was asked for."""
    final, asked, said = _loop_with_a_trial(monkeypatch, left, needed, ended)
    assert final.records == CorrectedRecords((), trials=False)
    assert asked == [(0, True), (1, True)] + [(0, False)] * (not ended)
    last = what_is_searched(cast(NotConfirmed, said[-1]))
    assert last.startswith("no model that leaves little more than noise needs the voltage of steps corrected")


def test_what_is_found_and_refused_again_is_not_looked_for_any_more(monkeypatch: pytest.MonkeyPatch) -> None:
    final, asked, _ = _loop_with_a_trial(monkeypatch, 1.0, needed=False, ended=False, again=True)
    assert final.records == CorrectedRecords((), trials=False, asks=False)
    assert asked == [(0, True), (1, True), (0, False), (1, False), (0, False)]


def test_an_error_that_is_none_beside_what_was_found_later_does_not_stand() -> None:
    """2 ms with a standard error of 1 ms are two standard errors, and far less than the prior's width."""
    names = ("input_delay.delay[first]", "input_delay.delay[third]")
    model = SimpleNamespace(standard_errors=lambda _: dict.fromkeys(names, 1e-3))
    joint = SimpleNamespace(ordered=tuple, slots={name: slot for slot, name in enumerate(names)})
    search = SimpleNamespace(fitted={(): model}, joint=joint, error=lambda _: 1.0)
    final = Model((), np.asarray([0.6, 2e-3]), 1.0, np.zeros((1, 1)), 0.0)
    errors = tuple(dataclasses.replace(FOUND, run=run) for run in ("first", "third"))
    assert standing(errors, cast(Any, search), final, 4) == errors[:1]
