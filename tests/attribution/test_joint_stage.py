"""The joint search as a stage of the loop: what is added, with which probability, and how the page says it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from importlib import resources
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from smajax.attribution import joint_stage
from smajax.attribution.close_loop import close_loop, prepared
from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import Findings
from smajax.attribution.joint_stage import search_by_evidence
from smajax.attribution.reasons import LikelierModel, StepDependent
from smajax.attribution.record_error import FoundRecordErrors, RecordError
from smajax.attribution.unknown.search import AskedFor, Lacking
from smajax.core.progress import quiet
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.levenberg_marquardt import FitSettings
from smajax.model.effects.library import LIBRARY
from smajax.report.html import findings_to_html
from smajax.report.json_file import findings_to_json
from smajax.report.narrative import narrate

FEW = ("latent_heat", "sensor_gain", "radiation")


def _demo(effects: tuple[str, ...], runs: int = 6) -> Experiment:
    with resources.as_file(resources.files("smajax") / "data" / "demo" / "latent") as folder:
        experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    return dataclasses.replace(experiment, effects_only=effects, runs=experiment.runs[:runs])


@pytest.fixture(scope="module")
def latent() -> Findings:
    return close_loop(_demo(FEW))


@pytest.mark.slow
def test_an_effect_that_is_there_is_added_and_all_others_are_unlikely(latent: Findings) -> None:
    assert [effect.name for effect in latent.added] == ["latent_heat"]
    likely = {effect.name: effect.evidence["posterior_probability"] for effect in latent.effects}
    assert likely.pop("latent_heat") > 0.99
    assert np.nanmax([*likely.values(), 0.0]) < 0.5
    assert latent.added[0].evidence["alone_rmse_fit"] == pytest.approx(latent.residual_after.rmse, rel=0.05)


@pytest.mark.slow
def test_the_page_and_the_record_list_the_sets_that_were_compared(latent: Findings) -> None:
    first = latent.rounds[0]
    assert first.chosen == "latent_heat"
    assert isinstance(first.reason, LikelierModel)
    assert first.reason.log_odds > 10.0
    said = narrate(latent).rounds[0]
    assert said.startswith("likelier than the base model by")
    assert "latent_heat (+" in said
    page = findings_to_html(latent)
    assert said in page.replace("&#39;", "'")
    assert "posterior probability" in page
    record = findings_to_json(latent)
    assert [one["added"] for one in record["effects"]].count(True) == 1
    assert record["effects"][0]["evidence"]["posterior_probability"] > 0.99


@pytest.mark.slow
def test_an_effect_that_gains_nothing_at_half_the_step_is_excluded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The latent heat passes for one with which the load jumps; the search is made again without it, and says so."""
    kept = iter((0.1, 1.0))
    candidate = LIBRARY["latent_heat"].candidate
    monkeypatch.setattr(joint_stage, "gain_kept_at_half_step", lambda *_: next(kept, 1.0))
    monkeypatch.setattr(
        LIBRARY["latent_heat"],
        "candidate",
        dataclasses.replace(candidate, stick_slip=True),
    )
    context = prepared(_demo(FEW[:2], runs=2), ResultCache(), quiet, 1, AttributionConfig())
    _, _, final = search_by_evidence(context.setting, context.base)
    assert "latent_heat" not in final.effects
    (excluded,) = [one.reason for one in context.setting.rounds if isinstance(one.reason, StepDependent)]
    assert excluded.effects == "latent_heat"


def _model(effects: Sequence[str], left: float, evidence: float) -> Any:
    """Of a made-up fit that leaves a residual of `left`, with that log evidence at any error of a sample."""
    return SimpleNamespace(
        effects=tuple(effects),
        residual=np.full(4, left),
        rms=left,
        values=np.zeros(3),
        log_evidence=lambda _: evidence,
    )


def _stage_and_search(
    monkeypatch: pytest.MonkeyPatch,
    functions: Sequence[tuple[float, float]],
    alone: Sequence[Any],
    confirmed: bool = True,
) -> tuple[Any, Any, list[Any]]:
    """(stage, search, base models that unknown functions were asked for beside); `functions`: what each leaves, and its log evidence."""
    setting = SimpleNamespace(
        problem=SimpleNamespace(batch=SimpleNamespace(mask=np.ones((1, 4)))),
        all_noise=lambda misfit, _: bool(np.max(misfit) < 1.5),
        config=AttributionConfig(),
    )
    asked: list[Any] = []
    fitted = [_model(["unknown_reading_of_time"], *one) for one in functions]
    named = fitted[0] if fitted and confirmed else None
    found = AskedFor(cast(Any, SimpleNamespace(fitted=fitted)), lambda: Lacking((), named))

    def asked_for(_: Any, base: Any, likely: Any, __: Any) -> AskedFor:
        asked.append(base)
        return found

    monkeypatch.setattr(joint_stage, "asked_for", asked_for)

    def fitted_alone(search: Any, effects: Sequence[str], error: float) -> list[Any]:
        # Of the function's equation, without what was excluded.
        assert list(effects) == ["sensor_drift"]
        return list(alone)

    def likeliest_alone(search: Any, effects: Sequence[str], found: Any) -> list[Any]:
        assert list(effects) == ["latent_heat", "sensor_drift"]
        return list(alone)

    monkeypatch.setattr(joint_stage, "fitted_alone", fitted_alone)
    monkeypatch.setattr(joint_stage, "likeliest_alone", likeliest_alone)
    monkeypatch.setattr(joint_stage, "nearest_alone", lambda search, alone, found: alone)
    search = SimpleNamespace(
        fitted={(): _model((), 9.0, 0.0)},
        error=lambda model: float(model.residual[0]),
        lacking=None,
        wrong_record=None,
        noise=1.0,
        thorough=True,
        asked_for_one=True,
        joint=SimpleNamespace(coefficients=("latent_heat", "sensor_drift", "sensor_gain")),
        excluded=frozenset({"sensor_gain"}),
    )
    return joint_stage._Stage(cast(Any, setting), FitSettings()), search, asked


THREE = ("latent_heat", "creep", "radiation")
FOUND = FoundRecordErrors((RecordError("steps", "voltage", "input_delay.delay", 0.8, 1e-3, 50.0, (), 60.0),), ())


def _left(stands_out: bool, of_all: float = 5.0) -> tuple[Any, ...]:
    return (SimpleNamespace(stands_out=stands_out, of_all=of_all),)


@pytest.mark.parametrize(
    ("of_all", "beside"),
    [
        ((2.0, 1.4, 1.0), THREE[:1]),  # the fewest effects of which values of presets take as much as of any
        ((1.0, 4.0, 3.0), None),  # of the base model a fit with these free has said less
        ((4.0, 3.0, 2.6), None),  # of 5.0, half and more
    ],
)
@pytest.mark.parametrize("stands_out", [False, True])
def test_a_search_with_values_of_presets_held_ends_where_a_step_of_these_takes_most(
    monkeypatch: pytest.MonkeyPatch, of_all: tuple[float, ...], beside: tuple[str, ...] | None, stands_out: bool
) -> None:
    """Without any run as well as with all of them: so no record is looked for; or without one, whose record is right."""
    stage, search, _ = _stage_and_search(monkeypatch, [], [])
    stage.setting.wrong_record = lambda *_: None if stands_out else pytest.fail("a record was asked for")
    left = [*of_all, *of_all]
    monkeypatch.setattr(joint_stage._Stage, "_without_runs", lambda *_: _left(stands_out, left.pop(0)))
    search.free_beside, search.thorough = None, False
    search.fitted |= {(): _model((), 9.0, 0.0), THREE[:1]: _model(THREE[:1], 5.0, 3.0)}
    many = _model(THREE, 5.0, 9.0)
    assert stage.has_wrong_record(search, many) is (beside is not None)
    assert search.free_beside == beside
    search.thorough, search.free_beside = True, None  # they are free already
    assert not stage.has_wrong_record(search, many)
    assert search.free_beside is None


def test_a_search_with_values_of_presets_held_ends_where_these_alone_were_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stage, search, _ = _stage_and_search(monkeypatch, [], [])
    stage.setting.wrong_record = lambda *_: FoundRecordErrors((), THREE[:1])
    monkeypatch.setattr(joint_stage._Stage, "_without_runs", lambda *_: _left(True))
    search.joint.ordered, search.free_beside = tuple, None
    search.fitted |= {THREE[:1]: _model(THREE[:1], 5.0, 3.0)}
    many = _model(THREE, 5.0, 9.0)
    search.thorough = False
    assert stage.has_wrong_record(search, many)
    assert (search.free_beside, search.wrong_record) == (THREE[:1], None)
    search.thorough, search.free_beside = True, None  # they are free already
    assert not stage.has_wrong_record(search, many)


@pytest.mark.parametrize("left", [1.0, 6.0])
def test_values_of_presets_are_free_from_the_effects_on_beside_which_they_alone_were_missing(
    monkeypatch: pytest.MonkeyPatch, left: float
) -> None:
    """And the search goes on from the many effects after all where a fit leaves more than these do."""
    stage, search, _ = _stage_and_search(monkeypatch, [], [])
    stage.setting.presets = {"damping": None}
    search.fitted |= {(): _model((), 9.0, 0.0), THREE[:1]: _model(THREE[:1], 5.0, 3.0)}
    search.programs, search.free_beside, search.wrong_record = (), THREE[:1], None
    monkeypatch.setattr(joint_stage._Stage, "joint_search", lambda *_: search)
    monkeypatch.setattr(joint_stage, "fitted_model", lambda *_: _model((), 9.0, 0.0))
    monkeypatch.setattr(joint_stage, "fitted_from", lambda *_: _model((), 9.0, 0.0))
    many, freed = _model(THREE, 5.0, 9.0), _model(THREE[:1], left, 9.0)
    monkeypatch.setattr(joint_stage, "search_jointly", lambda *_: many)
    resumed: list[tuple[str, ...]] = []

    def resume(_: object, search: object, found: Any, most: int = 4) -> tuple[object, object]:
        resumed.append((*found.effects, str(most)))
        return search, freed if most == 1 else many

    monkeypatch.setattr(joint_stage._Stage, "resumed", resume)
    found = stage._from_base(np.zeros(3), ())[1]
    further, best = ([], freed) if left < many.rms else ([(*THREE, "4")], many)
    assert (resumed, found) == ([(*THREE[:1], "1"), *further], best)


@pytest.mark.parametrize(
    ("effects", "left", "functions", "confirmed", "ended"),
    [
        (THREE, 5.0, [(1.0, 20.0)], True, True),
        (THREE, 5.0, [(1.0, 20.0)], False, False),  # one run, or those left out or held out do not confirm it
        (THREE, 5.0, [(1.0, 5.0)], True, False),  # less likely than the effects
        (THREE, 5.0, [(2.0, 20.0)], True, False),  # leaves more than noise too
        (THREE, 5.0, [], True, False),
        (THREE[:2], 5.0, [(1.0, 20.0)], True, False),  # two effects may be what is missing
        (THREE, 1.0, [(1.0, 20.0)], True, False),  # nothing more is missing
    ],
)
def test_a_search_ends_where_one_unknown_function_does_what_many_effects_do_not(
    monkeypatch: pytest.MonkeyPatch,
    effects: tuple[str, ...],
    left: float,
    functions: list[tuple[float, float]],
    confirmed: bool,
    ended: bool,
) -> None:
    stage, search, asked = _stage_and_search(monkeypatch, functions, [_model(["sensor_drift"], 4.0, 3.0)], confirmed)
    found = _model(effects, left, 10.0)
    for _ in range(2):
        assert stage.in_place_of_many(search, found) is (found if ended else None)
    # Once.
    assert asked == ([search.fitted[()]] if len(effects) > 2 and left > 1.5 else [])


@pytest.mark.parametrize("many", [True, False])
def test_one_effect_of_the_functions_equation_comes_before_it(monkeypatch: pytest.MonkeyPatch, many: bool) -> None:
    """A drifting sensor is an error of the sensor that depends on the time: the function finds it, and the library has it."""
    drift = _model(["sensor_drift"], 1.0, 21.0)
    stage, search, _ = _stage_and_search(monkeypatch, [(1.0, 20.0)], [drift])
    asked = stage.in_place_of_many if many else stage.before_the_end
    assert asked(search, _model(THREE, 5.0, 10.0)) is drift
    assert asked(search, _model(THREE, 5.0, 30.0)) is None  # likelier than the function
    assert stage.before_the_end(search, _model(["sensor_drift"], 1.0, 10.0)) is None
    assert stage.before_the_end(search, _model((), 5.0, 0.0)) is None


def test_one_effect_that_is_likelier_comes_in_the_place_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever unknown functions say. Two effects may be what is missing: no others are fitted alone."""
    heat = _model(["latent_heat"], 1.0, 21.0)
    stage, search, _ = _stage_and_search(monkeypatch, [], [heat])
    assert stage.before_the_end(search, _model(THREE, 5.0, 10.0)) is heat
    assert stage.before_the_end(search, _model(THREE, 5.0, 30.0)) is None
    assert stage.before_the_end(search, _model(THREE[:2], 5.0, 10.0)) is None


def test_the_second_search_is_without_what_looks_like_what_the_first_has_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another friction in the place of the one that was found is no news."""
    stage, search, _ = _stage_and_search(monkeypatch, [], [])
    names = ("latent_heat", "coulomb_friction", "pulley_friction", "sensor_backlash", "sensor_gain")
    search.joint, search.programs = SimpleNamespace(coefficients=names), ()
    found, other = _model(["coulomb_friction"], 5.0, 10.0), _model((), 9.0, 0.0)
    search.best = lambda _: found
    excluded: list[set[str]] = []

    def from_base(self: Any, *_: Any) -> tuple[Any, Any]:
        excluded.append(set(self.excluded))
        return search, other if len(excluded) > 1 else found

    monkeypatch.setattr(joint_stage._Stage, "_from_base", from_base)
    assert stage.searched(np.zeros(3)) == (search, found)
    assert excluded == [set(), {"coulomb_friction", "pulley_friction", "sensor_backlash"}]


def test_a_wrong_record_is_asked_for_once_where_many_effects_leave_many_noises(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Beside those that one run keeps from the others; the search ends where it is found."""
    stage, search, _ = _stage_and_search(monkeypatch, [], [])
    asked: list[list[tuple[str, ...]]] = []

    def wrong_record(hosts: Sequence[Any], present: Any) -> Any:
        asked.append([one.effects for one in (*hosts, present)])
        return FOUND

    better = [False, False, False, True, False, False, True, True, True]
    monkeypatch.setattr(joint_stage._Stage, "_without_runs", lambda *_: _left(better.pop(0)))

    stage.setting.wrong_record = wrong_record
    search.fitted |= {effects: _model(effects, 5.0, odds) for effects, odds in ((THREE[:1], 3.0), (THREE[1:], 1.0))}
    assert not stage.has_wrong_record(search, cast(Any, _model(THREE, 3.0, 9.0)))  # little is missing
    many = _model(THREE, 5.0, 9.0)
    assert not stage.has_wrong_record(search, many)  # no run keeps anything from the others: it is not asked yet
    assert stage.has_wrong_record(search, many)
    assert search.wrong_record is FOUND
    assert not stage.has_wrong_record(search, many)
    assert asked == [[(), THREE[:1], THREE]]  # the likeliest of few effects as well
    search.thorough = False  # the values of presets are held in another search
    assert stage.has_wrong_record(search, many)
    assert not stage.has_wrong_record(search, many)
    assert asked[1:] == [[(), THREE[:1], THREE, THREE]]


def _begun(
    monkeypatch: pytest.MonkeyPatch, then: Callable[[Any, Any, Any], object]
) -> dict[tuple[str, ...], np.ndarray]:
    """Where the search begins that `then` makes of (setting, base, a search that has fitted three sets), whose runs have an unknown of their own since."""
    fitted = {FEW[:count]: _model(FEW[:count], 9.0 - count, 5.0) for count in range(3)}
    before = SimpleNamespace(
        slots={"held": 0, "fitted": 1, "coefficient": 2, "of a second record": 3},
        unknowns=("fitted",),
        ordered=tuple,
        without=lambda values, _: np.array(values),
    )
    search = SimpleNamespace(
        fitted=fitted, error=lambda _: 1.0, excluded=frozenset(), programs=(), traced=(), joint=before
    )
    begun: list[dict[tuple[str, ...], np.ndarray]] = []
    joint = SimpleNamespace(
        slots={"fitted": 0, "held": 1, "new": 2, "coefficient": 3, "of a second record": 4},
        coefficients={},
        free=lambda _: ["fitted", "new", "coefficient", "of a second record"],
    )
    again = SimpleNamespace(programs=(), traced=(), joint=joint, excluded=frozenset())
    monkeypatch.setattr(joint_stage._Stage, "joint_search", lambda *_: again)
    monkeypatch.setattr(joint_stage, "search_jointly", lambda _, starts: begun.append(starts))
    monkeypatch.setattr(joint_stage, "_kept_at_half_step", lambda _, searched: searched())
    unknowns = ("fitted", "new", "of a second record")
    setting = SimpleNamespace(presets={}, config=AttributionConfig(), cache=None, progress=quiet, unknowns=unknowns)
    then(setting, SimpleNamespace(values=np.ones(5)), search)
    (starts,) = begun
    return starts


def test_with_a_finer_integration_the_search_goes_on_from_the_likeliest_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of these the base model begins where that integration has fitted it, or where the search had it if less is left there."""
    monkeypatch.setattr(joint_stage, "nearer_base", lambda _, fitted, known: fitted + 10.0 * known)
    starts = _begun(monkeypatch, cast(Any, joint_stage.search_again))
    assert set(starts) == {(), FEW[:1], FEW[:2]}
    assert starts[()].tolist() == [1.0, 11.0, 11.0, 1.0, 11.0]
    # What is not free now, and what there was not before or was held at none, lies where the base model has it.
    assert [values.tolist() for effects, values in starts.items() if effects] == [[0.0, 1.0, 1.0, 0.0, 1.0]] * 2


def test_with_a_record_corrected_the_search_begins_at_the_effects_beside_which_it_was_wrong(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And at each of them alone, where it was fitted: most may have stood in for the record."""
    monkeypatch.setattr(joint_stage, "nearer_base", lambda _, fitted, __: fitted)
    starts = _begun(
        monkeypatch,
        lambda setting, base, search: joint_stage.search_beside_a_record(setting, base, search, FEW[:2]),
    )
    assert list(starts) == [(), FEW[:1], FEW[:2]]


def test_without_what_held_out_runs_reject_nothing_is_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unknown functions beside the base model are those of before, and no fit run's record is corrected any more."""
    known = AskedFor(None, Lacking)
    stages: list[Any] = []
    monkeypatch.setattr(joint_stage._Stage, "resumed", lambda stage, _: stages.append(stage))
    monkeypatch.setattr(joint_stage, "_kept_at_half_step", lambda _, searched: searched())
    setting = SimpleNamespace(presets={}, config=AttributionConfig(), cache=None, progress=quiet)
    search = SimpleNamespace(excluded=frozenset({"creep"}), lacking=known)
    joint_stage.search_without(cast(Any, setting), cast(Any, search), ["latent_heat"])
    (stage,) = stages
    assert stage.excluded == {"creep", "latent_heat"}
    assert stage.asked == [known]
    setting.wrong_record = lambda *_: pytest.fail("a record was asked for")
    assert not stage.has_wrong_record(
        cast(Any, SimpleNamespace(noise=1.0, thorough=True)), cast(Any, _model(THREE, 5.0, 9.0))
    )
