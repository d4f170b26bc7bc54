"""What an experiment file may declare beside one output and a box: more outputs, priors, ties, starts, missing samples."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import set_parameters
from smajax.core.progress import Event, Progress, Stage, quiet
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.experiment_problem import declared_problem
from smajax.fit.identify import identify
from smajax.fit.identify_result import Estimate, Identified
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.uncertainty import RemarkKind
from smajax.model.presets import build
from smajax.report.identify_page import page
from smajax.report.identify_record import record
from smajax.report.identify_words import conclusions
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.sensors import sensor_output
from tests.helpers import hung_weight
from tests.helpers.hung_weight import PULSED, STAIRS, SWITCHED, HungRun

pytestmark = pytest.mark.usefixtures("blank_pictures")

TRUTH = {"recoverable_strain": 0.044, "austenite_start": 70.0}
NOISE = {"strain": 2e-4, "resistance": 0.01}  # -, ohm
SAMPLES = 241
HEAD = """
[model]
wire = "flexinol_table_3_2"
load = "coupon"
drive = "none"
[sampling]
step = "500 ms"
[time]
column = "t"
[channels.temperature]
role = "input"
column = "T"
unit = "degC"
[channels.stress]
role = "input"
column = "s"
unit = "MPa"
"""
STRAIN = '[channels.strain]\nrole = "output"\ncolumn = "e"\nunit = "1"\n'
OHMS = '[channels.resistance]\nrole = "output"\ncolumn = "R"\nunit = "ohm"\n'
KNOWN = 'noise = "0.02 %"\n'
BOTH = STRAIN + KNOWN + OHMS + 'noise = "0.01 ohm"\n'
BOX = {
    "recoverable_strain": 'low = "1 %", high = "8 %", start = "3 %"',
    "austenite_start": 'low = "50 degC", high = "77 degC", start = "60 degC"',
}


def unknown_section(**more: str) -> str:
    """A section [unknown] with `more` at the end of each table."""
    return "[unknown]\n" + "".join(f"{name} = {{ {box}{more.get(name, '')} }}\n" for name, box in BOX.items())


def coupon_file(
    folder: Path,
    more: str,
    *,
    own: Mapping[str, Mapping[str, float]] | None = None,
    lost: float = 0.0,
    scale: float = 1.0,
    seed: int = 5,
) -> Path:
    """Two fit runs and one held out; `own`: a run's own parameters; `lost`: share of strains that are missing."""
    rng = np.random.default_rng(seed)
    time = 0.5 * np.arange(SAMPLES)
    text = HEAD + more
    for name, role, stress, top in (
        ("a", "fit", 90.0, 110.0),
        ("b", "fit", 150.0, 95.0),
        ("c", "held-out", 120.0, 105.0),
    ):
        wire = set_parameters(build("flexinol_table_3_2", "coupon", "none"), {**TRUTH, **(own or {}).get(name, {})})
        celsius = np.interp(time, [0.0, 50.0, 100.0, 120.0], [25.0, top, 30.0, 80.0])
        inputs = {"temperature": jnp.asarray(celsius), "stress": jnp.full(SAMPLES, stress * 1e6)}
        run = simulate_compiled(wire, inputs, 0.5)
        shown = {"e": ("strain", NOISE["strain"]), "R": ("resistance", NOISE["resistance"])}
        columns = {"t": time, "T": celsius, "s": np.full(SAMPLES, stress)}
        for column, (sensor, noise) in shown.items():
            columns[column] = np.asarray(sensor_output(wire, run, sensor)) + scale * noise * rng.standard_normal(
                SAMPLES
            )
        gone = rng.random(SAMPLES) < lost
        gone[40:60] = lost > 0.0
        cells = {key: [f"{value:.12g}" for value in values] for key, values in columns.items()}
        cells["e"] = ["" if away else cell for away, cell in zip(gone, cells["e"], strict=True)]
        rows = "\n".join(",".join(row) for row in zip(*cells.values(), strict=True))
        (folder / f"{name}.csv").write_text(",".join(cells) + "\n" + rows + "\n")
        text += f'[[runs]]\nname = "{name}"\nrole = "{role}"\nfile = "{name}.csv"\n'
    (folder / "experiment.toml").write_text(text)
    return folder / "experiment.toml"


STUDIES = Path(__file__).parents[2] / "studies"


def _loaded(path: Path) -> Experiment:
    return load_experiment(path, CATALOGUE)


def _found(
    folder: Path, more: str, progress: Progress = quiet, memory: Path | None = None, **data: object
) -> Identified:
    path = coupon_file(folder, more, **data)  # type: ignore[arg-type]
    return identify(_loaded(path), starts=0, progress=progress, memory=memory)


def _by_name(found: Identified) -> dict[str, Estimate]:
    return {one.name: one for one in found.estimates}


def _error(found: Identified, name: str) -> float:
    error = _by_name(found)[name].standard_error
    assert error is not None
    return error


def test_a_second_sensor_narrows_the_errors_and_the_noise_of_each_is_found(tmp_path: Path) -> None:
    estimate = 'noise = "estimate"\n'
    alone = _found(tmp_path, unknown_section() + STRAIN + estimate)
    both = _found(tmp_path, unknown_section() + STRAIN + estimate + OHMS + estimate)
    assert len(both.outputs) == 2
    for output in both.outputs:
        assert output.noise_sigma == pytest.approx(NOISE[output.name], rel=0.1)
        assert output.noise_how == "estimated with the fit"
        assert output.ratio == pytest.approx(1.0, abs=0.02)
    assert _error(both, "austenite_start") < 0.8 * _error(alone, "austenite_start")
    for name, truth in TRUTH.items():
        assert abs(_by_name(both)[name].value - truth) < 4.0 * _error(both, name)
    # Each sensor in its own unit, on the page, in the record and by run, the held-out one too.
    text = " ".join(conclusions(both))
    assert "Error of the strain (rms): fit runs 0.0" in text
    assert "Error of the resistance (rms): fit runs 0.0" in text
    told = record(both)
    assert set(told["outputs"]) == set(NOISE)
    assert told["runs"]["c"]["outputs"]["resistance"]["rmse"] < 1.2 * NOISE["resistance"]
    assert told["outputs"]["strain"]["rmse"]["held-out"] < 1.2 * NOISE["strain"]
    assert page(both).count("data:image/png") == 3 * 2 + 1  # runs by sensor, and that of the answer
    assert page(alone).count("data:image/png") == 3 + 1


def test_a_residual_is_held_against_the_noise_of_neighbours_where_its_own_was_fitted(tmp_path: Path) -> None:
    """Over the noise that was fitted every residual is 1; here two runs have two strains, and the model has one."""
    estimate = 'noise = "estimate"\n'
    odd = _found(
        tmp_path,
        unknown_section() + STRAIN + estimate + OHMS + estimate,
        own={"a": {"recoverable_strain": 0.048}, "b": {"recoverable_strain": 0.042}},
    )
    strain = odd.outputs[0]
    assert strain.ratio == pytest.approx(1.0, abs=0.02)
    assert strain.over_noise > 2.0
    told = record(odd)
    assert told["outputs"]["strain"]["rms_over_noise"] == strain.over_noise
    assert 1.0 < told["residual"]["rms_over_noise"] < strain.over_noise
    text = " ".join(conclusions(odd))
    assert f"The residual is {strain.over_noise:.2g} times the noise (strain) and " in text
    assert "speaks against the model" not in text
    # A loop has the sensor's noise, and not what the model lacks.
    assert odd.model is not None
    assert odd.model.outputs[0].noise == pytest.approx(strain.noise_sigma, rel=1e-5)
    assert odd.model.outputs[0].reading_noise == pytest.approx(strain.noise_before, rel=1e-5)


def test_a_sensor_counts_by_its_noise(tmp_path: Path) -> None:
    """Resistance whose noise is declared a hundred times too large tells nothing beside the strain."""
    alone = _found(tmp_path, unknown_section() + STRAIN + KNOWN)
    both = _found(tmp_path, unknown_section() + STRAIN + KNOWN + OHMS + 'noise = "2 ohm"\n')
    for name in TRUTH:
        assert abs(_by_name(both)[name].value - _by_name(alone)[name].value) < 0.1 * _error(alone, name)
    assert "The noise of resistance is not what was declared" in " ".join(conclusions(both))


def test_missing_samples_are_left_out(tmp_path: Path) -> None:
    skip = STRAIN + KNOWN + 'missing = "skip"\n'
    found = _found(tmp_path, unknown_section() + skip + OHMS + 'noise = "0.01 ohm"\n', lost=0.3)
    loaded = _loaded(tmp_path / "experiment.toml")
    for run, one in zip(loaded.runs, found.runs, strict=True):
        measured = np.isfinite(run.outputs["strain"])
        assert 0.5 * SAMPLES < measured.sum() < 0.75 * SAMPLES
        assert not measured[41:59].any()
        assert np.isfinite(run.outputs["resistance"]).all()
        assert np.isfinite(one.series[0].simulated).all()
    for name, truth in TRUTH.items():
        assert abs(_by_name(found)[name].value - truth) < 4.0 * _error(found, name)
    assert found.ratio == pytest.approx(1.0, abs=0.1)
    text = (tmp_path / "experiment.toml").read_text()
    (tmp_path / "experiment.toml").write_text(text.replace('missing = "skip"\n', ""))
    with pytest.raises(ExperimentError, match=r"column 'e': the cell is empty.*; or write missing = 'skip'"):
        _loaded(tmp_path / "experiment.toml")


def test_a_prior_counts_by_its_width(tmp_path: Path) -> None:
    """Bayes's rule for normal distributions: means weighed by one over the variance, and the variances' sum of inverses."""
    plain = _found(tmp_path, unknown_section() + STRAIN + KNOWN)
    value, error = _by_name(plain)["recoverable_strain"].value, _error(plain, "recoverable_strain")
    mean, sigma = value + 6.0 * error, 2.0 * error
    known = f', prior = {{ mean = "{mean!r} 1", sigma = "{sigma!r} 1" }}'
    found = _found(tmp_path, unknown_section(recoverable_strain=known) + STRAIN + KNOWN)
    pulled = _by_name(found)["recoverable_strain"]
    expected = (value / error**2 + mean / sigma**2) / (1.0 / error**2 + 1.0 / sigma**2)
    assert pulled.value - value == pytest.approx(expected - value, rel=0.05)
    assert pulled.standard_error == pytest.approx((error**-2 + sigma**-2) ** -0.5, rel=0.05)
    assert "known before" in page(found)
    # At 1.2 of 6 errors on the way to the mean: 4.8 errors, 2.4 sigma, are left.
    (said,) = (sentence for sentence in conclusions(found) if "speak against that prior" in sentence)
    assert "2.4 standard deviations below what was known before" in said
    assert not any("speak against" in sentence for sentence in conclusions(plain))
    assert record(found)["parameters"]["recoverable_strain"]["prior"]["mean"] == mean
    # The same on the logarithm: narrow, so nearly the same pull.
    known = f', prior = {{ mean = "{mean!r} 1", log_sigma = {sigma / mean!r} }}'
    logarithmic = _found(tmp_path, unknown_section(recoverable_strain=known) + STRAIN + KNOWN)
    assert _by_name(logarithmic)["recoverable_strain"].value - value == pytest.approx(expected - value, rel=0.05)


def test_a_parameter_that_no_run_determines_has_the_error_of_its_prior(tmp_path: Path) -> None:
    box = 'convection_coefficient = { low = "50 W/m^2/K", high = "400 W/m^2/K", start = "80 W/m^2/K", '
    silent = box + 'prior = { mean = "120 W/m^2/K", log_sigma = 0.2 } }\n'
    found = _by_name(_found(tmp_path, unknown_section() + silent + STRAIN + KNOWN))["convection_coefficient"]
    assert found.value == pytest.approx(120.0, rel=1e-3)
    assert found.standard_error == pytest.approx(24.0, rel=0.02)
    assert found.note.kind is RemarkKind.PRIOR


def test_an_initial_fraction_of_each_run_is_found_beside_a_fixed_parameter(tmp_path: Path) -> None:
    own = {"a": {"start_fraction": 0.8}, "b": {"start_fraction": 0.55}, "c": {"start_fraction": 0.7}}
    start = '[nuisance]\ninitial_martensite_fraction = { low = "0.1", high = "1", start = "0.9" }\n'
    held = unknown_section(austenite_start=", fixed = true").replace('"60 degC"', '"70 degC"')
    found = _found(tmp_path, held + start + BOTH, own=own)
    estimates = _by_name(found)
    assert set(estimates) == {"recoverable_strain", *(f"initial_martensite_fraction[{run}]" for run in "ab")}
    for run in "ab":
        one = estimates[f"initial_martensite_fraction[{run}]"]
        assert one.standard_error is not None
        assert one.standard_error < 0.02
        assert abs(one.value - own[run]["start_fraction"]) < 4.0 * one.standard_error
    # A held-out run's own is found from itself, and said; nothing else is.
    assert found.values_of_held_out_runs["initial_martensite_fraction[c]"] == pytest.approx(0.7, abs=0.02)
    assert "found for the held-out runs from themselves" in page(found)


def test_a_parameter_with_a_value_for_each_run_is_found(tmp_path: Path) -> None:
    per_run = unknown_section(austenite_start=", per_run = true")
    apart = {"a": {"austenite_start": 70.0}, "b": {"austenite_start": 64.0}, "c": {"austenite_start": 66.0}}
    estimates = _by_name(_found(tmp_path, per_run + BOTH, own=apart))
    for run in "ab":
        one = estimates[f"austenite_start[{run}]"]
        assert one.standard_error is not None
        assert abs(one.value - apart[run]["austenite_start"]) < 4.0 * one.standard_error


class Stopped(Exception):
    """In the middle of a fit, as a kill would."""


def test_a_killed_identification_resumes_to_the_same_result(tmp_path: Path) -> None:
    path = coupon_file(tmp_path, unknown_section() + BOTH)
    experiment = _loaded(path)
    seen: list[str] = []

    def noted(event: Event) -> None:
        if isinstance(event, Stage):
            seen.append(event.name)

    def killed(event: Event) -> None:
        noted(event)
        if seen.count("beginning fits") == 4:
            raise Stopped

    undisturbed = identify(experiment, starts=4, memory=tmp_path / "other")
    with pytest.raises(Stopped):
        identify(experiment, starts=4, memory=tmp_path / "fits", progress=killed)
    assert list((tmp_path / "fits").glob("*.npz"))
    assert not list((tmp_path / "fits").glob("*.partial.npz"))
    first, seen = list(seen), []
    resumed = identify(experiment, starts=4, memory=tmp_path / "fits", progress=noted)
    assert first.count("beginning fits") == 4
    # The states of the first rounds may be younger than the last one that was cached, by a second at most.
    assert seen.count("beginning fits") <= 7

    def numbers(found: Identified) -> str:
        return json.dumps({**record(found), "provenance": {}})

    assert numbers(resumed) == numbers(undisturbed)
    assert "stages read from the cache" in resumed.provenance
    # Other data are other work.
    other = identify(
        _loaded(coupon_file(tmp_path, unknown_section() + BOTH, seed=6)), starts=4, memory=tmp_path / "fits"
    )
    assert "stages read from the cache" not in other.provenance


def test_sensors_and_starts_are_those_of_scipys_integration(tmp_path: Path) -> None:
    """Position, temperature and resistance of two runs that start warm, as another code integrates them."""
    warm, warmer = HungRun("warm", SWITCHED.volts, celsius=45.0), HungRun("warmer", PULSED.volts, 0.2, celsius=60.0)
    start = '[nuisance]\ninitial_temperature = { low = "0 degC", high = "90 degC", start = "60 degC" }\n'
    noise = {"position": "0.2 mm", "temperature": "0.5 K", "resistance": "0.05 ohm"}
    path = hung_weight.write(tmp_path, (warm, warmer), noise, start, noise_scale=0.0)
    problem = declared_problem(experiment := _loaded(path), experiment.runs)
    values = problem.start_values()
    values[problem.names.index("initial_temperature[warm]")] = 45.0
    (misfit,) = misfits(problem, [values])
    # The same where the temperatures are known.
    given = tuple(
        dataclasses.replace(run, parameters={"initial_temperature": celsius})
        for run, celsius in zip(experiment.runs, (45.0, 60.0), strict=True)
    )
    shared = tuple(unknown for unknown in experiment.unknowns if not unknown.per_run)
    known = declared_problem(dataclasses.replace(experiment, unknowns=shared, runs=given), given)
    (again,) = misfits(known, [known.start_values()])
    for k, limit in enumerate((4e-5, 3e-3, 1e-3)):
        assert np.abs(misfit[k::3]).max() < limit
        assert np.abs(again[k::3]).max() < limit


@pytest.mark.slow  # two minutes of compilation; the fast ones fit a coupon
def test_a_hung_weight_simulated_by_scipy_is_identified_from_three_sensors(tmp_path: Path) -> None:
    """Truth within the errors, each noise within 10 %, each run's start found; fewer sensors tell less."""
    runs = (
        HungRun("warm", SWITCHED.volts, celsius=50.0),
        HungRun("warmer", PULSED.volts, 0.2, celsius=60.0),
        HungRun("held", STAIRS.volts, 0.15, "held-out", celsius=40.0),
    )
    starts = '[nuisance]\ninitial_temperature = { low = "0 degC", high = "66 degC", start = "30 degC" }\n'
    every = dict.fromkeys(hung_weight.NOISE, "estimate")
    found = {}
    for name, noise in (("position", {"position": "estimate"}), ("all", every)):
        (tmp_path / name).mkdir()
        path = hung_weight.write(tmp_path / name, runs, noise, hung_weight.UNKNOWN + starts, missing={"position": 0.1})
        found[name] = identify(_loaded(path), starts=0)
    for output in found["all"].outputs:
        assert output.noise_sigma == pytest.approx(hung_weight.NOISE[output.name], rel=0.1)
    truth = {**hung_weight.TRUTH, "initial_temperature[warm]": 50.0, "initial_temperature[warmer]": 60.0}
    for name, value in truth.items():
        assert abs(_by_name(found["all"])[name].value - value) < 4.0 * _error(found["all"], name)
        assert _error(found["all"], name) < 0.8 * _error(found["position"], name)
    assert found["all"].values_of_held_out_runs["initial_temperature[held]"] == pytest.approx(40.0, abs=1.0)


@pytest.mark.parametrize(("study", "unknowns"), [("flexinol_isobaric", 16), ("bias_spring_bench", 15)])
def test_the_stored_experiment_files_of_measured_runs_load(measured_data: Path, study: str, unknowns: int) -> None:
    assert measured_data.is_dir()
    experiment = _loaded(STUDIES / study / "identify.toml")
    assert len(experiment.unknowns) == unknowns
    assert "thermal_expansion" in experiment.declared_effects
    assert {run.role for run in experiment.runs} == {"fit", "held-out"}


@pytest.mark.slow  # a minute
def test_flexinol_at_constant_stress_is_predicted(measured_data: Path) -> None:
    """At most 0.06 % strain off at the stress that was held out, and the slopes that every good fit gives."""
    assert measured_data.is_dir()
    found = identify(_loaded(STUDIES / "flexinol_isobaric" / "identify.toml"))
    assert max(run.rmse for run in found.runs if run.role == "held-out") < 6e-4
    assert 7.9e6 < _by_name(found)["stress_slope_austenite"].value < 8.3e6
    assert 7.2e6 < _by_name(found)["stress_slope_martensite"].value < 7.6e6
