"""The sentences of a report: which are said of which findings, and a few whole ones."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from smajax.attribution.findings import (
    AssumedParameter,
    CoefficientFinding,
    Confounder,
    DroppedModel,
    Findings,
    ParameterFinding,
    Rejected,
    Round,
    Verdict,
    pooled_rmse,
)
from smajax.attribution.reasons import (
    HeldOutWorse,
    NoiseWithoutRun,
    StepDependent,
)
from smajax.attribution.record_error import OutlierRun
from smajax.core.progress import Event, Message, Result, Stage, WarningMessage
from smajax.data.model_file.of_presets import model_of_presets
from smajax.fit.identifiability import Checks, Identifiability
from smajax.fit.integration import IntegrationError
from smajax.fit.uncertainty import Remark, RemarkKind
from smajax.report.html import findings_to_html
from smajax.report.json_file import findings_to_json
from smajax.report.narrative import narrate, narrated
from smajax.report.narrative.verdict import STAND_INS, headline, summary
from tests.helpers.made_findings import made_effect, made_findings, made_residual


def _summary(**changed: Any) -> str:
    return " ".join(narrate(dataclasses.replace(made_findings(), **changed)).summary)


def test_the_summary_of_an_effect_that_was_found() -> None:
    """A snapshot: the verdict, the errors, the noise, what the effect means."""
    assert narrate(made_findings()).summary == (
        "The base model lacks: latent heat of transformation. With it, what is left on the fit runs is measurement noise.",
        "Error on the fit runs: 1.13 mm before, 0.0198 mm after.",
        "Error on the held-out runs: 1.18 mm before, 0.0202 mm after.",
        "On the held-out runs the average of the 2 likely models is off by 0.0202 mm, and 93% of the samples lie in its 90 % band.",
        "Measurement noise: 0.02 mm (estimated from the flat part of the runs).",
        "While it transforms the wire absorbs heat without getting warmer, and gives it back on cooling: both strokes are slower than the heat balance alone says, and the same at rest.",
        "Mind: radiation to the surroundings leaves a trace in the score test (p = 4e-12 after 2 candidates) that would take 0.4% of the residual's square, but the model with it is hardly likelier, if at all.",
    )


def test_effects_that_depend_on_the_step_or_hide_in_the_noise_are_reported_at_the_top() -> None:
    findings = made_findings()
    level = max(pooled_rmse(findings.runs, "fit", "after"), findings.noise_sigma)
    faint = made_effect("creep", "creep", "constitutive", 1e-9, added=False)

    def said(verdict: Verdict, p_value: float, change: float, ratio: float = 1.0, **changed: Any) -> str:
        evidence = {**faint.evidence, "score_p_value_at_the_end": p_value, "score_gain_at_the_end": 0.03}
        after = dataclasses.replace(made_residual(2e-5, ratio == 1.0), ratio=ratio)
        effects = (dataclasses.replace(faint, evidence=evidence),)
        rms = {"position": change}
        integration = IntegrationError(rms, rms, change / findings.noise_sigma, "one step a sample")
        return _summary(verdict=verdict, effects=effects, residual_after=after, integration=integration, **changed)

    adequate, missing = Verdict.ADEQUATE, Verdict.NOT_IN_LIBRARY
    assert "the integration leaves" in said(adequate, 0.5, 2.0 * level)
    assert "the integration leaves" not in said(adequate, 0.5, 0.1 * level)
    assert "creep leaves a trace in the score test (p = 1e-9 after 1 candidates)" in said(adequate, 1e-9, 0.0)
    assert "leaves a trace" not in said(adequate, 0.5, 0.0) + said(missing, 1e-9, 0.0)
    assert "square, but the model with it is hardly likelier, if at all" in said(adequate, 1e-9, 0.0)
    rejected = Rejected(("creep",), 1e-3, 2e-3)
    assert "square, but the held-out runs reject it" in said(adequate, 1e-9, 0.0, rejected=(rejected,))
    assert "autocorrelated, looks the same" in said(missing, 0.5, 0.0, 1.3)
    assert "looks the same" not in said(missing, 0.5, 0.0, 3.0) + said(adequate, 0.5, 0.0)


def test_an_expansion_that_cancels_the_presets_is_reported_as_such_and_not_as_the_wires() -> None:
    """As found of two benches whose wires have none, with the preset's theta_T of 0.55 MPa/K left as it is."""
    preset = (0.55e6 / 28e9, 0.55e6 / 75e9)

    def said(martensite: float, austenite: float, expansion: tuple[float, float] | None) -> str:
        found = {"martensite": martensite, "austenite": austenite}
        effect = dataclasses.replace(
            made_effect("thermal_expansion", "thermal expansion of each phase", "constitutive", 1e-4, added=True),
            coefficients={phase: CoefficientFinding(value, 2e-7, "1/K") for phase, value in found.items()},
        )
        return _summary(effects=(effect,), preset_expansion=expansion)

    assert "takes back the one that the base model has by its preset's thermal_modulus" in said(1.88e-5, 7.4e-6, preset)
    assert "takes back" not in said(-1.88e-5, 7.4e-6, preset)
    assert "takes back" not in said(1.88e-5, 2.0e-5, preset)
    assert "takes back" not in said(1.88e-5, 7.4e-6, None)


def test_a_load_far_off_is_reported_with_the_sizes_that_were_not_given() -> None:
    """A bench that gives them all, or a share that is small, has the one reading."""

    def said(share: float, given: bool) -> str:
        wrong = dataclasses.replace(
            made_effect("wrong_load", "wrong load", "mechanics", 1e-4, added=True),
            coefficients={"share": CoefficientFinding(share, 0.01, "-")},
        )
        assumed = (
            AssumedParameter("wire_length", "m", 0.9, not given),
            AssumedParameter("wire_diameter", "m", 3.7e-4, not given),
            AssumedParameter("damping", "N s/m", 1.0, False),
        )
        return _summary(effects=(wrong,), assumed=assumed)

    assert (
        "off by -79% may as well be a size of the bench that the experiment file never gives: wire_length 900 mm and "
        "wire_diameter 0.37 mm are"
    ) in said(-0.79, False)
    assert "a size of the bench" not in said(-0.1, False)
    assert "a size of the bench" not in said(-0.79, True)


def test_a_model_that_ends_with_a_reversed_range_is_said_to() -> None:
    model = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage")
    assert "reversed" not in _summary(extended_model=model)
    start = model.parameters["martensite_start"]
    cold = dataclasses.replace(start, value=model.values["martensite_finish"] - 2.0)
    wrong = dataclasses.replace(model, parameters={**model.parameters, "martensite_start": cold})
    assert "Mind: the range on cooling is reversed: martensite_finish is " in _summary(extended_model=wrong)


def test_each_cluster_of_correlated_parameters_has_one_line_with_advice() -> None:
    def found(name: str, kind: RemarkKind, *others: str) -> ParameterFinding:
        return ParameterFinding(name, "-", 0.5, 0.1, 0.0, 1.0, 0.5, Remark(kind, others))

    after = (
        found("specific_heat", RemarkKind.CORRELATED, "convection_coefficient"),
        found("convection_coefficient", RemarkKind.CORRELATED, "specific_heat"),
        found("damping", RemarkKind.PRIOR),
        found("density", RemarkKind.COMBINATION, "load_mass", "lever"),
        found("load_mass", RemarkKind.COMBINATION, "density", "lever"),
    )
    findings = dataclasses.replace(
        made_findings(),
        source="experiment.toml",
        after=after,
        correlated=(("specific_heat", "convection_coefficient"),),
    )
    limits = narrate(findings).cannot_know
    (advice,) = [one for one in limits if "correlated" in one]
    assert advice.startswith(
        "specific_heat and convection_coefficient are correlated in these runs: what one has too much"
    )
    assert "add a fit run that separates them" in advice
    (advice,) = [one for one in limits if "combinations alone" in one]
    assert advice.startswith("Of density, load_mass and lever these runs determine combinations alone, and the value")
    assert "`smajax identify experiment.toml --design`" in advice
    assert any(one.startswith("damping: determined by its prior") for one in limits)
    assert not any("scale of the wire's temperature" in one for one in limits)


def test_an_open_scale_of_temperature_is_said_to_need_more_than_another_load() -> None:
    def found(name: str, unit: str) -> ParameterFinding:
        remark = Remark(RemarkKind.COMBINATION, ("specific_heat",))
        return ParameterFinding(name, unit, 1.0, None, 0.0, 2.0, 1.0, remark)

    after = (found("convection_coefficient", "W/(m^2 K)"), found("austenite_start", "degC"))
    limits = narrate(dataclasses.replace(made_findings(), after=after)).cannot_know
    (said,) = [one for one in limits if "scale of the wire's temperature" in one]
    assert said.startswith("austenite_start is open together with the convection")
    assert "A measured temperature of the wire, runs in air of another temperature" in said


@pytest.mark.parametrize("widths", [4.9, -31.2, None])
def test_an_effect_far_larger_than_usual_is_said_to_be(widths: float | None) -> None:
    (one,) = [effect for effect in made_findings().effects if effect.added]
    coefficients = {name: dataclasses.replace(own, widths_off=widths) for name, own in one.coefficients.items()}
    found = dataclasses.replace(made_findings(), effects=(dataclasses.replace(one, coefficients=coefficients),))
    text = " ".join(narrate(found).summary)
    assert ("latent_heat.enthalpy is 31 times as large as is usual" in text) == (widths == -31.2)
    (coefficient,) = findings_to_json(found)["effects"][0]["coefficients"].values()
    assert coefficient.get("widths_of_prior") == widths


def test_many_effects_that_leave_more_than_noise_are_said_to_stand_in() -> None:
    (one,) = [effect for effect in made_findings().effects if effect.added]
    few, many = (
        dataclasses.replace(made_findings(), verdict=Verdict.PARTLY_EXPLAINED, effects=(one,) * count)
        for count in (STAND_INS - 1, STAND_INS)
    )
    assert "may in part stand in" in summary(few)[0]
    assert headline(few)[1] == "fair"
    said = summary(many)
    assert "take none of them for found" in said[0]
    assert headline(many)[1] == "poor"
    assert len(said) < len(summary(few))  # what each of them means is not said


def test_a_parameter_at_its_bound_is_reported_at_the_top() -> None:
    one = ParameterFinding("recoverable_strain", "-", 0.02, None, 0.01, 0.02, 0.015, Remark(RemarkKind.UPPER_BOUND))
    coefficient = ParameterFinding(
        "latent_heat.enthalpy", "J/kg", 1e5, None, 0.0, 1e5, 1e4, Remark(RemarkKind.UPPER_BOUND)
    )
    said = _summary(after=(one, coefficient))
    assert "Mind: recoverable_strain ends at its upper bound of 2 %. The truth may lie beyond" in said
    at_its_bound = "Mind: latent_heat.enthalpy ends at its upper bound of 100 J/g: it stands in for something else, or its range is too narrow."
    assert at_its_bound in said


def test_likely_models_that_failed_a_check_are_named_with_the_reason() -> None:
    dropped = (
        DroppedModel(("latent_heat", "creep"), 0.12, HeldOutWorse(1e-4, 2e-4)),
        DroppedModel(("stribeck_friction",), 0.3, StepDependent("stribeck_friction", 0.1)),
    )
    said = _summary(dropped=dropped)
    assert (
        "latent_heat + creep, of probability 0.12, is not averaged with: set aside: error on the held-out runs 0.1 mm without and 0.2 mm with it."
        in said
    )
    assert (
        "stribeck_friction, of probability 0.30, is not averaged with: stribeck_friction keeps 10% of its gain" in said
    )
    record = findings_to_json(dataclasses.replace(made_findings(), dropped=dropped))
    assert [(one["effects"], one["weight"]) for one in record["dropped_models"]] == [
        (["latent_heat", "creep"], 0.12),
        (["stribeck_friction"], 0.3),
    ]


@pytest.mark.usefixtures("blank_pictures")
def test_a_value_of_a_preset_far_from_its_prior_is_reported_with_the_distance() -> None:
    fitted = {"near": (78e9, 0.2), "edge": (90e9, 2.0), "far": (100e9, 3.1), "low": (40e9, -2.5)}
    after = tuple(
        ParameterFinding(
            f"{name}_modulus", "Pa", value, 1e9, 10e9, 200e9, 75e9, prior_base=75e9, prior_deviation=widths
        )
        for name, (value, widths) in fitted.items()
    )
    said = _summary(after=after)
    far = "far_modulus ends at 100 GPa, 3.1 standard deviations above what was known before, 75 GPa"
    assert f"Mind: {far}; low_modulus ends at 40 GPa, 2.5 standard deviations" in said.replace(" and low", "; low")
    assert "near_modulus" not in said
    assert "edge_modulus" not in said
    page = findings_to_html(dataclasses.replace(made_findings(), after=after))
    assert "2.5 standard deviations below what was known before" in page
    effect = made_findings().added[0].name
    coefficient = dataclasses.replace(after[2], name=f"{effect}.size")  # of an effect that keeps its priors
    said = _summary(after=(coefficient,))
    assert f"Mind: {effect}.size ends at 100 GPa, 3.1 standard deviations above" in said
    assert "[priors.presets]" not in said
    at_its_bound = dataclasses.replace(after[2], remark=Remark(RemarkKind.UPPER_BOUND))
    assert "widen its bounds" not in _summary(after=(at_its_bound,))  # the file has none of it


def test_runs_that_cannot_be_left_out_or_were_not_held_out_are_named() -> None:
    first = made_findings().runs[0]
    said = _summary(runs=(first,))
    assert "No run was left out or held out, so nothing confirms it." in said
    assert "no run could be left out" in said
    assert "No run was held out" in said


def test_confounders_are_named_by_their_weight() -> None:
    def findings(weight: float, run: str = "") -> Findings:
        one = Confounder("latent_heat", "radiation", 0.81, weight, 1e-4, run, 4.2)
        return dataclasses.replace(made_findings(), confounders=(one,))

    assert any("weight of 0.30" in one for one in narrate(findings(0.3)).cannot_know)
    assert any(
        "A run with a ramp would separate them by 4.2 times" in one
        for one in narrate(findings(0.3, "a ramp")).cannot_know
    )
    assert not any("radiation" in one for one in narrate(findings(0.01)).cannot_know)


def test_a_confounder_that_priors_alone_tell_is_minded_with_the_run_that_separates_it() -> None:
    one = Confounder("latent_heat", "radiation", 0.81, 1e-5, 1e-4, "a ramp", 4.2, -1.21, only_by_priors=True)
    said = _summary(confounders=(one,))
    other = "radiation to the surroundings in its place (log-likelihood ratio -1.2)"
    assert f"hardly tell latent heat of transformation from {other}" in said
    assert "A run with a ramp would tell it from radiation to the surroundings by 4.2 times the noise." in said
    assert "would tell" not in _summary(confounders=(dataclasses.replace(one, separation=0.2),))
    both = _summary(confounders=(one, dataclasses.replace(one, confounder="sensor_lag", separation=5.0)))
    assert both.count("Mind: the fit runs alone") == 1
    assert "by 5.0 times the noise" in both
    better = _summary(confounders=(dataclasses.replace(one, log_likelihood_ratio=8.0),))
    assert "alone prefer radiation to the surroundings in its place (log-likelihood ratio 8) to latent" in better
    bent = dataclasses.replace(one, log_likelihood_ratio=8.0, more_parameters=13)
    assert "alone hardly tell" in _summary(confounders=(bent,))
    assert "the fit runs alone" not in _summary(confounders=(dataclasses.replace(one, only_by_priors=False),))


def nothing_added() -> Findings:
    findings = made_findings()
    effects = tuple(dataclasses.replace(effect, added=False) for effect in findings.effects)
    residual = made_residual(1.1e-3, False)
    return dataclasses.replace(findings, verdict=Verdict.NOT_IN_LIBRARY, effects=effects, residual_after=residual)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({}, "none of the 3 candidate effects that were tried accounts for it."),
        ({"effects": ()}, "no candidate effect was to be tried"),
        ({"explained_variance": 0.1}, "(explained variance 10% in runs left out)"),
        ({"superseded": ("radiation",)}, "radiation to the surroundings comes nearest, and one unknown function"),
        ({"rejected": (Rejected(("radiation",), 1e-3, 2e-3),)}, "Radiation to the surroundings would lower the error"),
        (
            {"rejected": (Rejected(("radiation",), 1e-3, 2e-3, True),)},
            "How far these two differ may be chance, but more",
        ),
        ({"outlier_runs": (OutlierRun("step 6 V", (), True, 1e-3, 2e-5, 3e-3),)}, "in one run alone: without step 6 V"),
    ],
)
def test_a_verdict_without_a_named_effect_gives_the_reason(changed: dict[str, Any], said: str) -> None:
    assert said in narrate(dataclasses.replace(nothing_added(), **changed)).summary[0]


def test_an_outlier_run_beside_an_added_effect_is_reported() -> None:
    one = OutlierRun("step 6 V", ("latent_heat",), False, 1e-3, 2e-4, 3e-3)
    assert (
        "Mind: step 6 V does not agree with the others. Fitted without it, the error of the extended model"
        in _summary(outlier_runs=(one,))
    )


def test_progress_of_the_search_is_a_message() -> None:
    events: list[Event] = []
    progress = narrated(events.append, "m", "position")
    progress(Stage("fitting", 0.5))
    progress(Result(Round(2, (), "creep", NoiseWithoutRun("a"), removed=True)))
    assert events == [
        Stage("fitting", 0.5),
        Message("round 2: without creep; set aside: without a what the base model leaves is noise"),
    ]


def test_the_checks_before_a_fit_are_messages_and_a_prior_without_use_is_a_warning() -> None:
    events: list[Event] = []
    found = Identifiability(("a", "b"), 500, 2)
    narrated(events.append)(Result(Checks(found, unused_priors=True, held_presets=("c",), freed_later=("d",))))
    assert [type(one) for one in events] == [WarningMessage, Message, Message, Message]
    assert [one.text for one in events if isinstance(one, Message)] == [
        "check: All 2 unknowns are identifiable from these runs (Jacobian of 500 samples, rank 2); how far their estimates are correlated, "
        "and whether a bound holds one, is known at the fit.",
        "check: That is with d at the presets' values. The file does not give them, so the search fits them as well: what these runs then determine "
        "of each is said beside its value.",
        "check: The file does not give c: held at the values of the presets, or at the base that [priors.presets] has. `identify --presets fitted` fits them "
        "too, within what data sheets leave open, as close-loop does.",
    ]


def test_effects_that_the_file_keeps_from_being_candidates_are_counted() -> None:

    findings = dataclasses.replace(made_findings(), effects_excluded=48)
    (said,) = [one for one in narrate(findings).summary if "were not tried" in one]
    assert said.startswith(f"{len(findings.effects)} effects of the library were candidates; 48 more")
    assert not any("were not tried" in one for one in narrate(made_findings()).summary)
    (said,) = [one for one in narrate(dataclasses.replace(findings, effects_excluded=1)).summary if "not tried" in one]
    assert (
        "1 more that this model can show was not tried, because [effects] of the experiment file leaves it out" in said
    )


def test_a_noise_that_nobody_declared_is_not_said_to_be_declared() -> None:
    findings = made_findings()
    for ratio, said in ((1.4, "What is left is white but 1.4 times the"), (0.7, "What is left is 0.70 times the")):
        residual = dataclasses.replace(findings.residual_after, ratio=ratio)
        own = dataclasses.replace(findings, residual_after=residual)
        (estimated,) = [one for one in narrate(own).summary if one.startswith(said)]
        (given,) = [
            one
            for one in narrate(dataclasses.replace(own, noise_how="given as 0.02 mm")).summary
            if one.startswith(said)
        ]
        assert "declare" not in estimated.lower()
        assert f"{said} estimated noise" in estimated
        assert f"{said} declared noise" in given
