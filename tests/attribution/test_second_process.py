"""An attribution says the same with a second process beside it, which answers what it was asked ahead."""

from __future__ import annotations

import dataclasses
from collections import Counter
from importlib import resources
from typing import Any

import pytest

from smajax.attribution import begun_ahead
from smajax.attribution.close_loop import close_loop
from smajax.attribution.context import Context, Outcome
from smajax.attribution.model_fits import Model
from smajax.core import worker_process as module
from smajax.core.worker_process import OF_ATTRIBUTION, VARIABLE, Call, worker_process
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.engine import facade
from smajax.report.json_file import findings_to_json

OWN = {"provenance"}  # seconds


def _demo(effects: tuple[str, ...], runs: int) -> Experiment:
    with resources.as_file(resources.files("smajax") / "data" / "demo" / "latent") as folder:
        experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    return dataclasses.replace(experiment, effects_only=effects, runs=experiment.runs[:runs])


def _said(experiment: Experiment) -> dict[str, Any]:
    record = findings_to_json(close_loop(experiment))
    return {name: value for name, value in record.items() if name not in OWN}


def _same(one: Any, other: Any) -> None:
    """Numbers to the rounding of a fit: machine code of the tests is not optimised, that of the second process is."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for name in one:
            _same(one[name], other[name])
    elif isinstance(one, list):
        assert len(one) == len(other)
        for first, second in zip(one, other, strict=True):
            _same(first, second)
    elif isinstance(one, float):
        assert one == pytest.approx(other, rel=1e-3, abs=1e-6, nan_ok=True)
    else:
        assert one == other


# Without the effect that is missing, more than noise is left: unknown functions and runs that do not fit are asked for.
@pytest.mark.slow
def test_what_is_said_is_the_same_and_every_call_was_made_there(monkeypatch: pytest.MonkeyPatch) -> None:
    experiment = _demo(("radiation", "sensor_gain", "phase_specific_heat"), 4)
    alone = _said(experiment)
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setattr(module, "available_cores", lambda: 2)
    there: Counter[bool] = Counter()
    asked: list[tuple[Any, tuple[str, ...]]] = []
    result, answer = Call.result, begun_ahead._answer

    def counted(call: Call[Any]) -> Any:
        worker = module._worker
        assert worker is not None
        # One that still waits for others is made here, which says nothing of whether it could be made there.
        there[worker.is_called(call) or call in worker._waiting] += 1
        return result(call)

    def noted(asks: Any, context: Context, outcome: Outcome, model: Model) -> Any:
        asked.append((asks, model.effects))
        return answer(asks, context, outcome, model)

    monkeypatch.setattr(Call, "result", counted)
    monkeypatch.setattr(begun_ahead, "_answer", noted)
    taken: list[bool] = []
    of_worker = module.Worker.taken

    def answered(worker: module.Worker, key: Any) -> Any:
        called = worker.is_called(key)
        found = of_worker(worker, key)
        if isinstance(key, Call) and called:
            taken.append(found is not None)
        return found

    monkeypatch.setattr(module.Worker, "taken", answered)
    begun: set[Any] = set()
    begin = module.Worker.begin

    def noted_key(worker: module.Worker, key: Any, *rest: Any) -> None:
        begun.add(key)
        begin(worker, key, *rest)

    monkeypatch.setattr(module.Worker, "begin", noted_key)
    monkeypatch.setattr(facade, "_programs", {})
    with worker_process(OF_ATTRIBUTION):
        _same(_said(experiment), alone)
    programs = {key for key in begun if not isinstance(key, Call)}
    assert programs
    assert programs <= facade._programs.keys()  # all that it was asked to make
    assert there[True] > 0
    assert not there[False]
    assert taken
    assert all(taken)
    assert (begun_ahead._without_runs, ()) in asked  # of the base model
    assert {asks for asks, _ in asked} == {begun_ahead._without_runs, begun_ahead._with_terms, begun_ahead._on_average}
