"""An experiment file and its runs to one record, and what is said about each mistake."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.model_description import Catalogue, ModelDescription, ParameterInfo
from smajax.data.experiment.record import Experiment


def describe(wire: str, load: str, drive: str, law: str = "") -> ModelDescription:
    if load == "coupon" and drive != "none":
        raise ValueError("a coupon has no drive; write drive = 'none'")
    parameters = {
        "wire_length": ParameterInfo("m", 1e-3, 1e2),
        "specific_heat": ParameterInfo("J/(kg K)", 50.0, 5e3),
        "ambient_temperature": ParameterInfo("degC", -100.0, 150.0),
        "stress_slope_austenite": ParameterInfo("Pa/K", 1e6, 1e8),
    }
    if load == "coupon":
        return ModelDescription(parameters, frozenset({"temperature", "stress"}), frozenset(), {"strain": "-"})
    optional = frozenset({"ambient_temperature"})
    return ModelDescription(parameters, frozenset({"duty"}), optional, {"position": "m", "temperature": "degC"})


CATALOGUE = Catalogue(
    wires={"flexinol", "niti"},
    loads={"bias_spring", "coupon"},
    drives={"duty", "none"},
    laws={"liang", "enhanced"},
    effects={"latent_heat", "friction"},
    describe=describe,
)

BENCH = """
title = "Bench"
[model]
wire = "flexinol"
load = "bias_spring"
drive = "duty"
[model.parameters]
wire_length = "96 cm"
[unknown.specific_heat]
low = "300 J/(kg K)"
high = "0.5 cal/(g degC)"
start = "0.2 cal/(g degC)"
[nuisance]
offset = true
[sampling]
step = "50 ms"
[time]
column = "time"
unit = "ms"
[channels.duty]
role = "input"
column = "duty"
unit = "%"
[channels.position]
role = "output"
column = "pos"
unit = "mm"
noise = "0.01 mm"
[[runs]]
name = "A"
role = "fit"
file = "a.csv"
[[runs]]
name = "B"
role = "held-out"
file = "b.csv"
[runs.parameters]
ambient_temperature = "297.15 K"
"""


ONE_FIT = "only 1 fit run: runs left out in turn tell little; give at least three of different kinds"


def write_run(path: Path, count: int = 500, seed: int = 0, header: str = "time,duty,pos") -> None:
    """A run at 100 Hz (time in ms, duty in percent, position in mm with 0.01 mm of noise)."""
    time = 10.0 * np.arange(count)
    duty = np.where(time < 1000.0, 0.0, 20.0)
    position = 0.002 * np.maximum(time - 1000.0, 0.0) + np.random.default_rng(seed).normal(scale=0.01, size=count)
    np.savetxt(path, np.stack([time, duty, position], axis=1), delimiter=",", header=header, comments="")


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    folder = tmp_path / "bench"
    folder.mkdir()
    write_run(folder / "a.csv")
    write_run(folder / "b.csv", count=720, seed=1)
    (folder / "experiment.toml").write_text(BENCH)
    return folder


def changed(folder: Path, old: str, new: str) -> Path:
    text = (folder / "experiment.toml").read_text()
    assert old in text
    (folder / "experiment.toml").write_text(text.replace(old, new, 1))
    return folder


def load(folder: Path) -> Experiment:
    return load_experiment(folder / "experiment.toml", CATALOGUE)


def test_a_whole_experiment_in_si(bench: Path) -> None:
    got = load(bench)
    assert (got.name, got.title, got.wire, got.load, got.drive) == ("bench", "Bench", "flexinol", "bias_spring", "duty")
    assert got.parameters == {"wire_length": pytest.approx(0.96)}
    (unknown,) = got.unknowns
    assert (unknown.name, unknown.unit) == ("specific_heat", "J/(kg K)")
    assert (unknown.low, unknown.start, unknown.high) == pytest.approx((300.0, 836.8, 2092.0))
    assert (got.output_name, got.output_unit, got.step, got.offset) == ("position", "m", 0.05, True)
    first, second = got.runs
    assert (first.name, first.role, second.name, second.role) == ("A", "fit", "B", "held-out")
    assert first.time.shape == first.output.shape == first.inputs["duty"].shape == (100,)
    assert second.time.shape == (144,)
    np.testing.assert_allclose(first.inputs["duty"], np.where(first.time < 0.999, 0.0, 0.2), atol=1e-12)
    np.testing.assert_allclose(first.output, 0.002 * np.maximum(first.time - 1.0, 0.0), atol=3e-5)
    assert second.parameters == {"ambient_temperature": pytest.approx(24.0)}
    assert first.sha256 == hashlib.sha256((bench / "a.csv").read_bytes()).hexdigest()
    assert got.warnings == (ONE_FIT,)
    assert load_experiment(bench, CATALOGUE).name == "bench"


def test_a_unit_that_the_heading_contradicts_is_told(bench: Path) -> None:
    for name in ("a.csv", "b.csv"):
        (bench / name).write_text((bench / name).read_text().replace("time,duty,pos", "time [ms],duty [%],pos_m", 1))
    changed(
        changed(changed(bench, '"pos"', '"pos_m"'), '"time"', '"time [ms]"'), 'column = "duty"', 'column = "duty [%]"'
    )
    told = [text for text in load(bench).warnings if "heading" in text]
    assert told == [
        "channels.position.unit is 'mm', and the heading 'pos_m' says m: 1 m is 1000 mm. One of the two is wrong; the file's is taken"
    ]


def test_a_given_noise_shrinks_with_the_average_over_a_step(bench: Path) -> None:
    got = load(bench)
    at_rest = np.concatenate([run.output[1:20] for run in got.runs])
    assert got.noise_sigma == pytest.approx(1e-5 * 0.427, rel=0.01)
    assert np.std(at_rest) == pytest.approx(got.noise_sigma, rel=0.35)
    assert "given as 0.01 mm" in got.noise_how


def test_an_estimated_noise_is_the_one_on_the_clock(bench: Path) -> None:
    got = load(changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"'))
    assert got.noise_sigma == pytest.approx(1e-5 * 0.427, rel=0.25)
    assert got.noise_how.startswith("estimated from 1 fit run")


@pytest.mark.parametrize("step", ["12.5 ms", "20 ms", "25 ms"])
def test_an_estimated_noise_is_not_too_small_where_windows_share_samples(bench: Path, step: str) -> None:
    write_run(bench / "a.csv", count=6000)
    changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"')
    got = load(changed(bench, '"50 ms"', f'"{step}"'))
    at_rest = next(run for run in got.runs if run.name == "A")
    drift = 2e-6 * np.maximum(at_rest.time - 1.0, 0.0) * 1000.0
    found = np.std((at_rest.output - drift)[at_rest.time > 2.0])
    assert got.noise_sigma == pytest.approx(found, rel=0.06)


OWN = """columns = { time = "t_s", position = 3, duty = "pwm" }
units = { time = "s", duty = "1", position = "um" }
"""


def _other_names(bench: Path) -> None:
    """The log of run B as another logger writes it."""
    rows = np.loadtxt(bench / "b.csv", delimiter=",", skiprows=1) * [1e-3, 1e-2, 1e3]
    np.savetxt(bench / "b.csv", rows, delimiter=",", header="t_s,pwm,weg", comments="")


def test_a_run_may_have_columns_and_units_of_its_own(bench: Path) -> None:
    before = load(bench)
    _other_names(bench)
    with pytest.raises(ExperimentError, match=r"runs.B.file: .*no column 'duty'; .*write columns = \{ duty = '...' \}"):
        load(bench)
    got = load(changed(bench, 'file = "b.csv"', f'file = "b.csv"\n{OWN}'))
    for old, new in zip(before.runs, got.runs, strict=True):
        np.testing.assert_allclose(new.time, old.time, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(new.inputs["duty"], old.inputs["duty"], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(new.output, old.output, rtol=0.0, atol=1e-15)
    assert got.warnings == before.warnings


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("time = ", "tme = ", r"runs.B.columns.tme: there is no channel 'tme'; did you mean 'time'"),
        ('duty = "1"', 'dut = "1"', r"runs.B.units.dut: there is no channel 'dut'; did you mean 'duty'"),
        ('duty = "1"', 'duty = "mm"', r"runs.B.units.duty: got unit 'mm'"),
        ('"t_s"', '"t"', r"runs.B.file: .*no column 't'; .*write columns = \{ time = '...' \}"),
        ("position = 3", "position = 4", r"runs.B.file: .*no column number 4; it has columns 1 to 3"),
        ("position = 3", "position = []", r"runs.B.columns.position: got \[\], expected a table of channel"),
    ],
)
def test_a_mistake_in_a_runs_own_columns_is_named(bench: Path, old: str, new: str, words: str) -> None:
    _other_names(bench)
    own = OWN.replace(old, new, 1)
    assert own != OWN
    with pytest.raises(ExperimentError, match=words):
        load(changed(bench, 'file = "b.csv"', f'file = "b.csv"\n{own}'))


def test_a_unit_of_a_run_that_its_heading_contradicts_is_told(bench: Path) -> None:
    _other_names(bench)
    (bench / "b.csv").write_text((bench / "b.csv").read_text().replace("weg", "weg [um]"))
    own = OWN.replace("position = 3", 'position = "weg [um]"').replace('"um"', '"nm"')
    got = load(changed(bench, 'file = "b.csv"', f'file = "b.csv"\n{own}'))
    assert any("runs.B.units.position is 'nm', and the heading 'weg [um]' says um" in text for text in got.warnings)


def test_matlab_files_one_a_channel(bench: Path) -> None:
    for name, interval, values in (("Duty", 0.001, np.full(3001, 0.2)), ("Pos", 0.01, np.arange(300) * 1e-5)):
        record = {"time": interval * np.arange(values.size), "signals": {"values": values}, "blockName": "m"}
        scipy.io.savemat(bench / f"{name}.mat", {name: record})
    text = BENCH.replace('[time]\ncolumn = "time"\nunit = "ms"\n', "")
    text = text.replace('column = "duty"\nunit = "%"', 'variable = "Duty"\nunit = "1"')
    text = text.replace('column = "pos"\nunit = "mm"', 'variable = "Pos"\nunit = "m"')
    both = 'files = { duty = "Duty.mat", position = "Pos.mat" }'
    text = text.replace('file = "a.csv"', both).replace('file = "b.csv"', both)
    (bench / "experiment.toml").write_text(text)
    got = load(bench)
    run = got.runs[0]
    assert run.time.shape == (60,)
    np.testing.assert_allclose(run.inputs["duty"], 0.2)
    np.testing.assert_allclose(run.output, 1e-3 * run.time, atol=1e-12)
    assert [file.name for file in run.files] == ["Duty.mat", "Pos.mat"]
    assert any("runs 'A' and 'B' have the same data" in one for one in got.warnings)
    assert any("the input 'duty' never changes in any run" in one for one in got.warnings)


COUPON = """
[model]
wire = "niti"
load = "coupon"
drive = "none"
[time]
kind = "sample"
[channels.temperature]
role = "input"
column = 1
unit = "K"
[channels.strain]
role = "output"
column = 2
unit = "%"
noise = "0.01 %"
[[runs]]
name = "50 MPa"
role = "fit"
file = "50.txt"
[runs.inputs]
stress = "50 MPa"
[effects]
exclude = ["friction"]
"""


def test_a_coupon_without_time_and_with_a_constant_input(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "50.txt", np.stack([300.0 + np.arange(30.0), np.linspace(4.0, 0.0, 30) ** 2], axis=1))
    (tmp_path / "isobaric.toml").write_text(COUPON)
    got = load_experiment(tmp_path / "isobaric.toml", CATALOGUE)
    (run,) = got.runs
    assert got.name == "isobaric"
    np.testing.assert_array_equal(run.time, np.arange(30.0))
    np.testing.assert_allclose(run.inputs["temperature"], 26.85 + np.arange(30.0), rtol=1e-12)
    np.testing.assert_array_equal(run.inputs["stress"], 50e6)
    assert run.output[0] == pytest.approx(0.16)
    assert (got.noise_sigma, got.step, got.effects_only, got.effects_excluded) == (1e-4, 1.0, None, ("friction",))


def test_the_data_folder_from_the_environment_or_beside_a_parent(bench: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changed(bench, "[nuisance]", '[data]\nfolder = "${SMAJAX_DATA}/mine"\n[nuisance]')
    monkeypatch.delenv("SMAJAX_DATA", raising=False)
    with pytest.raises(ExperimentError, match=r"data.folder: .*SMAJAX_DATA"):
        load(bench)
    for root in (bench.parent / "shared" / "data", bench.parent / "elsewhere"):
        (root / "mine").mkdir(parents=True)
        write_run(root / "mine" / "a.csv", count=100 if root.name == "elsewhere" else 200)
        write_run(root / "mine" / "b.csv", seed=1)
    assert load(bench).runs[0].time.size == 40
    monkeypatch.setenv("SMAJAX_DATA", str(bench.parent / "elsewhere"))
    assert load(bench).runs[0].time.size == 20
    monkeypatch.setenv("SMAJAX_DATA", str(bench.parent / "gone"))
    with pytest.raises(ExperimentError, match=r"data.folder: .*does not exist"):
        load(bench)


MISTAKES = [
    (
        "offset = true",
        "ofset = true",
        r"nuisance.ofset: is not a known key; did you mean 'offset'\? Known here: offset",
    ),
    ("[sampling]", "[samplng]", r"experiment\.toml: samplng: is not a known key; did you mean 'sampling'"),
    (
        'wire = "flexinol"',
        'wire = "flexinoll"',
        r"model.wire: there is no wire 'flexinoll'; did you mean 'flexinol'\? There are",
    ),
    ('load = "bias_spring"', 'load = "spring"', r"model.load: there is no load 'spring'"),
    ('load = "bias_spring"', 'load = "coupon"', r"model: a coupon has no drive"),
    ('drive = "duty"', 'drive = "duti"', r"model.drive: .*did you mean 'duty'"),
    ('drive = "duty"', "drive = 3", r"model.drive: got 3, expected the name of a drive"),
    ('drive = "duty"\n', "", r"model.drive: is missing; expected the name of a drive"),
    ("wire_length =", "wire_lenght =", r"model.parameters.wire_lenght: .*did you mean 'wire_length'"),
    ('"96 cm"', '"96 s"', r"model.parameters.wire_length: got unit 's'.*expected one like 'm'"),
    ('"96 cm"', "0.96", r"model.parameters.wire_length: got 0.96 without a unit"),
    ('"96 cm"', "[1]", r"model.parameters.wire_length: got \[1\], expected a table of name"),
    ('"96 cm"', '"960 km"', r"model.parameters.wire_length: got '960 km', that is 960000 m; expected 0.001 to 100 m"),
    ("wire_length =", 'specific_heat = "1 J/(kg K)"\nwire_length =', r"specific_heat: is given here and is an unknown"),
    ("[unknown.specific_heat]", "[unknown.specific_het]", r"unknown.specific_het: .*did you mean 'specific_heat'"),
    ('"300 J/(kg K)"', '"3000 J/(kg K)"', r"unknown.specific_heat.low: got '3000 .*not below high"),
    ('start = "0.2 cal', 'start = "0.9 cal', r"unknown.specific_heat.start: got '0.9 .*expected between"),
    ('low = "300 J/(kg K)"', 'low = "300 J/K"', r"experiment\.toml: unknown.specific_heat.low: got unit 'J/K'"),
    ('low = "300 J/(kg K)"\n', "", r"unknown.specific_heat.low: is missing"),
    ('step = "50 ms"', 'step = "50"', r"sampling.step: got '50' without a unit, expected one like 'ms'; write '50 ms'"),
    ('step = "50 ms"', "step = 50", r"sampling.step: got 50.0 without a unit, expected one like 'ms'; write '50 ms'"),
    ('name = "A"', 'name = "A"\nstart = "500"', r"runs.A.start: got '500' without a unit, .*; write '500 ms'"),
    ('noise = "0.01 mm"', "noise = 0.01", r"position.noise: got 0.01 without a unit, .*; write '0.01 mm'; give"),
    ('step = "50 ms"', 'step = "50 mm"', r"sampling.step: got unit 'mm'"),
    ('step = "50 ms"', 'step = "-1 s"', r"sampling.step: got '-1 s', expected a time above zero"),
    ('step = "50 ms"', 'step = "1 ns"', r"sampling.step: .*cuts run 'A' .*; take a longer step"),
    ('step = "50 ms"', 'step = "1 h"', r"sampling.step: run 'A' lasts 4.99 s"),
    ('column = "time"\n', "", r"time: names no column"),
    ('unit = "%"', 'unit = "V"', r"channels.duty.unit: got unit 'V'.*expected one like '1'"),
    ('role = "input"\n', "", r"channels.duty.role: is missing; expected 'input' or 'output'"),
    (
        'role = "input"',
        'role = "output"',
        r"channels.duty: the model has no output 'duty'; its outputs are: position, t",
    ),
    ("[channels.duty]", "[channels.ambient_temperature]", r"channels.ambient_temperature.unit: got unit '%'"),
    (
        "[channels.duty]",
        "[channels.dutty]",
        r"channels.dutty: the model has no input 'dutty'; did you mean 'duty'\? Its inputs are: a",
    ),
    (
        '[channels.duty]\nrole = "input"\ncolumn = "duty"\nunit = "%"\n',
        "",
        r"channels: the model needs the input 'duty', which no channel gives",
    ),
    ('column = "duty"\n', "", r"channels.duty: has no column or variable and run 'A' gives no constant"),
    (
        'column = "duty"',
        'column = "dutty"',
        r"runs.A.file: .*no column 'dutty'; did you mean 'duty'\? It has: time, duty, pos",
    ),
    ('column = "time"', 'column = "posn"', r"runs.A.file: .*no column 'posn'; it has: time, duty, pos$"),
    ('column = "duty"', 'column = "tim"', r"runs.A.file: .*no column 'tim'; it has: time, duty, pos$"),
    ('unit = "mm"', 'unit = "mMeter"', r"channels.position.unit: unit 'mMeter' is not known; did you mean 'mm'\?"),
    ('column = "pos"', 'column = "pos"\nvariable = "x"', r"channels.position: got both column and variable"),
    (
        'noise = "0.01 mm"',
        'noise = "auto"',
        r"channels.position.noise: got 'auto', .*; give a noise like '0.01 mm', or 'estimate'",
    ),
    ('noise = "0.01 mm"', 'noise = "0.01 s"', r"channels.position.noise: got unit 's'"),
    ('noise = "0.01 mm"', 'noise = "0 mm"', r"channels.position.noise: got '0 mm', expected a noise above zero"),
    ('unit = "%"', 'unit = "%"\nnoise = "1 %"', r"channels.duty: got a noise for an input"),
    ('role = "fit"', 'role = "held-out"', r"runs: no run has role = 'fit'"),
    ('role = "fit"', 'role = "train"', r"runs.A.role: got 'train', expected 'fit' or 'held-out'"),
    ('name = "B"', 'name = "A"', r"runs.A.name: is used by two runs"),
    ('name = "B"\n', "", r"runs.\[2\].name: is missing"),
    ('file = "a.csv"', 'file = "aa.csv"', r"runs.A.file: .*aa.csv: there is no such file; did you mean 'a.csv'"),
    ('file = "a.csv"\n', "", r"runs.A: got neither file nor files"),
    ('file = "a.csv"', 'files = { duty = "a.csv" }', r"runs.A.files: gives no file for channel 'position'"),
    (
        'file = "a.csv"',
        'files = { dut = "a.csv" }',
        r"runs.A.files.dut: there is no channel 'dut'; did you mean 'duty'",
    ),
    ("ambient_temperature =", "ambient =", r"runs.B.parameters.ambient: there is no parameter 'ambient'"),
    ('"297.15 K"', '"297.15 V"', r"runs.B.parameters.ambient_temperature: got unit 'V'"),
    ("[[runs]]", '[effects]\nonly = ["latent"]\n[[runs]]', r"effects.only: .*did you mean 'latent_heat'"),
    ("[[runs]]", '[data]\nfolder = "${HOME}"\n[[runs]]', r"data.folder: got \$\{HOME\}; only"),
    (
        "offset = true",
        'offset = true\ninitial_temprature = { low = "0 degC", high = "1 degC", start = "0 degC" }',
        r"nuisance.initial_temprature: is not a known key; did you mean 'initial_temperature'",
    ),
    (
        "offset = true",
        'initial_temperature = { low = "0 degC", high = "1 degC" }',
        r"nuisance.initial_temperature.start: is missing",
    ),
    ("[nuisance]", "prior = { mean = '1 J/(kg K)' }\n[nuisance]", r"prior: got neither sigma nor log_sigma; give"),
    (
        "[nuisance]",
        "prior = { mean = '900 J/(kg K)', sigma = '1 s' }\n[nuisance]",
        r"unknown.specific_heat.prior.sigma: got unit 's'",
    ),
    (
        "[nuisance]",
        "prior = { mean = '900 J/(kg K)', sigma = '0 J/(kg K)' }\n[nuisance]",
        r"unknown.specific_heat.prior.sigma: got '0 J/\(kg K\)', expected a standard deviation above zero",
    ),
    (
        "[nuisance]",
        "prior = { mean = '900 J/(kg K)', log_sigma = -1.0 }\n[nuisance]",
        r"unknown.specific_heat.prior.log_sigma: got -1.0, expected a number above 0",
    ),
    (
        "[nuisance]",
        "prior = { mena = '900 J/(kg K)', log_sigma = 1.0 }\n[nuisance]",
        r"unknown.specific_heat.prior.mena: is not a known key; did you mean 'mean'",
    ),
    ("[nuisance]", "per_run = 3\n[nuisance]", r"unknown.specific_heat.per_run: got 3, expected true"),
    ("[nuisance]", "fixed = true\nper_run = true\n[nuisance]", r"unknown.specific_heat: is fixed, so per_run and"),
    ('unit = "%"', 'unit = "%"\nmissing = "skip"', r"channels.duty: got missing = 'skip' for an input"),
    ('unit = "%"', 'unit = "%"\noffset = true', r"channels.duty: got an offset for an input"),
    ('unit = "mm"', 'unit = "mm"\nmissing = "drop"', r"channels.position.missing: got 'drop', expected 'refuse' or 's"),
    ('title = "Bench"', "title = ", r"experiment\.toml: is not TOML: .*line 2"),
]


@pytest.mark.parametrize(("old", "new", "words"), MISTAKES, ids=[words for _, _, words in MISTAKES])
def test_a_mistake_is_named_with_its_file_and_key(bench: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(ExperimentError, match=words) as caught:
        load(changed(bench, old, new))
    assert str(caught.value).startswith(str(bench / "experiment.toml") + ": ")
    assert "pydantic" not in str(caught.value)


def test_commas_before_three_decimals_are_settled_by_a_key(bench: Path) -> None:
    rows = "".join(f"{10 * k};20;{k // 1000},{k % 1000:03}\n" for k in range(1000, 1500))
    for name in ("a.csv", "b.csv"):
        (bench / name).write_text("time;duty;pos\n" + rows)
    with pytest.raises(ExperimentError, match=r"set thousands apart: .*, or decimal = ',' under \[data\]"):
        load(bench)
    got = load(changed(bench, '[[runs]]\nname = "A"', '[data]\nfolder = "."\ndecimal = ","\n[[runs]]\nname = "A"'))
    assert got.runs[0].output[-1] == pytest.approx(1.495e-3)
    with pytest.raises(ExperimentError, match=r"data\.decimal: got ';', expected ',' or '\.'"):
        load(changed(bench, 'decimal = ","', 'decimal = ";"'))


def test_a_held_unknown_is_a_known_value(bench: Path) -> None:
    got = load(changed(bench, "[nuisance]", "fixed = true\n[nuisance]"))
    assert got.unknowns == ()
    assert got.parameters["specific_heat"] == pytest.approx(836.8)


def test_two_outputs_each_with_its_own_noise_and_zero(bench: Path) -> None:
    warm = (
        '[channels.temperature]\nrole = "output"\ncolumn = "pos"\nunit = "K"\nnoise = "0.5 K"\noffset = false\n[[runs]]'
    )
    got = load(changed(bench, "[[runs]]", warm))
    position, temperature = got.outputs
    assert (position.name, position.offset, temperature.name, temperature.offset) == (
        "position",
        True,
        "temperature",
        False,
    )
    assert temperature.noise_sigma == pytest.approx(0.5 * 0.427, rel=0.01)
    np.testing.assert_allclose(got.runs[0].outputs["temperature"], 1e3 * got.runs[0].output - 273.15, atol=1e-9)


def test_missing_samples_and_gaps_in_time_are_left_out(bench: Path) -> None:
    lines = (bench / "a.csv").read_text().splitlines()
    lines[100:140] = [line.rsplit(",", 1)[0] + "," for line in lines[100:140]]
    (bench / "a.csv").write_text("\n".join(lines[:200] + lines[300:]) + "\n")
    words = r"the cell is empty; expected a number in every line; or write missing = 'skip'"
    with pytest.raises(ExperimentError, match=words):
        load(bench)
    got = load(changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"\nmissing = "skip"'))
    run = got.runs[0]
    away = np.isnan(run.output)
    # 1 s to 1.4 s in the cells, 2 s to 3 s in the time.
    assert away[(run.time > 1.03) & (run.time < 1.35)].all()
    assert away[(run.time > 2.05) & (run.time < 2.95)].all()
    assert not away[(run.time < 0.95) | ((run.time > 1.45) & (run.time < 1.9)) | (run.time > 3.05)].any()
    assert np.isfinite(run.inputs["duty"]).all()
    assert got.noise_sigma == pytest.approx(1e-5 * 0.427, rel=0.3)
    assert not any("gap" in one for one in got.warnings if "'position'" in one)


def test_a_start_that_the_model_prescribes_is_refused(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "50.txt", np.stack([300.0 + np.arange(30.0), np.linspace(4.0, 0.0, 30) ** 2], axis=1))
    start = 'initial_temperature = { low = "0 degC", high = "50 degC", start = "20 degC" }'
    (tmp_path / "isobaric.toml").write_text(f"{COUPON}\n[nuisance]\n{start}\n")
    with pytest.raises(
        ExperimentError, match=r"nuisance.initial_temperature: the temperature of this load is an input"
    ):
        load_experiment(tmp_path / "isobaric.toml", CATALOGUE)


def test_a_file_without_runs_or_without_a_file(bench: Path) -> None:
    (bench / "experiment.toml").write_text(BENCH[: BENCH.index("[[runs]]")])
    with pytest.raises(ExperimentError, match=r"runs: is missing; expected one section \[\[runs\]\] a run"):
        load(bench)
    with pytest.raises(ExperimentError, match="there is no such file"):
        load_experiment(bench / "other.toml", CATALOGUE)


def test_a_bad_sample_is_refused_with_its_run(bench: Path) -> None:
    for cells, words in (
        ("5000,nan,0", "column 'duty' has 1 value.*, the first is nan in line 502"),
        ("5000,0,zero", "line 502, column 'pos': 'zero' is not a number"),
        ("nan,0,0", "column 'time' has 1 value.*, the first is nan in line 502"),
        ("4990,0,0", r"time column 'time' does not increase at line 502 \(4990 ms then 4990 ms\)"),
    ):
        write_run(bench / "a.csv")
        with (bench / "a.csv").open("a") as file:
            file.write(cells + "\n")
        with pytest.raises(ExperimentError, match=f"runs.A.file: .*a.csv: .*{words}"):
            load(bench)


def test_samples_at_one_time_are_taken_out_or_refused(bench: Path) -> None:
    lines = (bench / "a.csv").read_text().splitlines()
    (bench / "a.csv").write_text("\n".join([*lines, lines[-1]]) + "\n")
    told = [one for one in load(bench).warnings if "taken out" in one]  # one row of a log: one sentence
    assert told == ["run 'A': 1 sample of 'duty' and 'position' at a time that another one has was taken out"]
    with (bench / "a.csv").open("a") as file:
        file.write("4990,0,0\n")
    with pytest.raises(ExperimentError, match=r"does not increase.*or write repeated = 'mean'"):
        load(bench)
    text = (bench / "experiment.toml").read_text()
    (bench / "experiment.toml").write_text(text.replace('unit = "ms"', 'unit = "ms"\nrepeated = "last"', 1))
    assert load(bench).runs[0].time.shape == (100,)


def test_a_run_is_the_part_of_its_log_between_its_start_and_end(bench: Path) -> None:
    whole = load(bench).runs[0]
    part = load(changed(bench, 'file = "a.csv"', 'file = "a.csv"\nstart = "0.5 s"\nend = "2000 ms"')).runs[0]
    assert (part.time[0], part.time[-1]) == (pytest.approx(0.5), pytest.approx(2.0))
    inside = slice(10, 10 + len(part.time) - 1)  # the mean over a step needs what follows the last one
    np.testing.assert_allclose(part.output[:-1], whole.output[inside], atol=1e-12)
    np.testing.assert_allclose(part.inputs["duty"][:-1], whole.inputs["duty"][inside], atol=1e-12)


@pytest.mark.parametrize("key", ["start", "end"])
def test_a_run_that_begins_or_ends_outside_of_its_log_is_refused(bench: Path, key: str) -> None:
    with pytest.raises(ExperimentError, match=rf"runs.A.{key}: got '90 s', expected a time of the log between 0 s and"):
        load(changed(bench, 'file = "a.csv"', f'file = "a.csv"\n{key} = "90 s"'))


def test_an_uneven_clock_is_a_warning(bench: Path) -> None:
    lines = (bench / "a.csv").read_text().splitlines()
    kept = [line for number, line in enumerate(lines) if number % 5 != 2 or number == 0]
    (bench / "a.csv").write_text("\n".join(kept) + "\n")
    assert any("'position' is sampled unevenly (0.01 to 0.02 s apart)" in told for told in load(bench).warnings)


def rewrite(path: Path, duty: float = 20.0, position: np.ndarray | None = None, count: int = 500) -> None:
    """The run of `write_run` in one of its wrong forms."""
    time = 10.0 * np.arange(count)
    noisy = 0.01 * np.random.default_rng(7).normal(size=count) + 0.002 * time
    columns = [time, np.where(time < 100, 0, duty), noisy if position is None else position]
    np.savetxt(path, np.stack(columns, axis=1), delimiter=",", header="time,duty,pos", comments="")


def test_what_looks_wrong_is_a_warning(bench: Path) -> None:
    swing = 10.0 * np.sin(np.arange(500) / 20.0)
    cases: list[tuple[str, dict[str, object]]] = [
        ("outside 0 to 1; is it in percent", {"duty": 2000.0}),
        ("the output 'position' is constant", {"position": np.zeros(500)}),
        ("runs into its highest value and stays exactly there", {"position": np.minimum(swing, 7.0)}),
        ("runs into its lowest value and stays exactly there", {"position": np.maximum(swing, -7.0)}),
        ("increment of 0.0005 m is larger than its noise of 1e-05 m", {"position": 0.5 * np.round(swing / 0.5)}),
        ("only 10 samples", {"count": 50}),
    ]
    for words, change in cases:
        rewrite(bench / "a.csv", **change)  # type: ignore[arg-type]
        assert any(words in one for one in load(bench).warnings), (words, load(bench).warnings)
    rewrite(bench / "a.csv")
    assert load(bench).warnings == (ONE_FIT,)
    assert any("shorter than the sensor's" in one for one in load(changed(bench, '"50 ms"', '"2 ms"')).warnings)


def test_a_gap_in_time_is_a_warning(bench: Path) -> None:
    lines = (bench / "a.csv").read_text().splitlines()
    (bench / "a.csv").write_text("\n".join(lines[:200] + lines[300:]) + "\n")
    assert any("'position' has a gap of 1.01 s" in one for one in load(bench).warnings)


def test_a_noise_that_cannot_be_seen_has_to_be_given(bench: Path) -> None:
    rewrite(bench / "a.csv", position=np.zeros(500))
    with pytest.raises(ExperimentError, match=r"channels.position.noise: no noise can be seen"):
        load(changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"'))


def test_too_few_samples_for_the_noise_name_the_run_and_the_step(bench: Path) -> None:
    changed(changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"'), '"50 ms"', '"1 s"')
    words = r"channels.position.noise: run 'A' has 5 samples at a step of 1 s, .*; take a shorter step or a longer run"
    with pytest.raises(ExperimentError, match=words):
        load(bench)
    write_run(bench / "a.csv", count=6)
    with pytest.raises(ExperimentError, match=r"run 'A' has 6 samples in its file, .*; take a longer run"):
        load(changed(bench, '"1 s"', '"5 ms"'))


def test_few_runs_and_none_held_out_are_warnings(bench: Path) -> None:
    warnings = load(changed(bench, 'role = "held-out"', 'role = "fit"')).warnings
    assert any(one.startswith("only 2 fit runs: ") for one in warnings)
    assert "no run is held out: the error after is shown on no run that the fit never saw" in warnings


def test_a_run_of_hours_is_a_warning(bench: Path) -> None:
    changed(bench, '"50 ms"', '"50 s"')
    assert "run 'B' lasts 7150 s; is the time in ms?" not in load(changed(bench, 'unit = "ms"', 'unit = "s"')).warnings
    write_run(bench / "a.csv", count=2001)
    assert "run 'A' lasts 20000 s; is the time in ms?" in load(bench).warnings
    changed(changed(bench, 'unit = "s"', 'unit = "min"'), '"50 s"', '"10 min"')
    assert "run 'A' lasts 1.2e+06 s; is the time in min, as [time] says?" in load(bench).warnings


@pytest.mark.parametrize(
    ("drive", "unit", "words"),
    [("voltage", "V", "the voltage reaches 4200 V; is it in mV?"), ("current", "A", "the current reaches 4200 A; is")],
)
def test_numbers_too_large_for_a_wire_are_a_warning(bench: Path, drive: str, unit: str, words: str) -> None:
    def driven(wire: str, load: str, drive: str, law: str = "") -> ModelDescription:
        return replace(describe(wire, load, drive), inputs_required=frozenset({drive}))

    catalogue = replace(CATALOGUE, drives={drive}, describe=driven)
    text = BENCH.replace('drive = "duty"', f'drive = "{drive}"').replace("[channels.duty]", f"[channels.{drive}]")
    (bench / "experiment.toml").write_text(text.replace('unit = "%"', f'unit = "{unit}"'))
    rewrite(bench / "a.csv", duty=4200.0)
    assert sum(words in one for one in load_experiment(bench, catalogue).warnings) == 1
    (bench / "experiment.toml").write_text(text.replace('unit = "%"', f'unit = "m{unit}"'))
    assert load_experiment(bench, catalogue).warnings == (ONE_FIT,)


def test_a_law_that_there_is_none_of_is_told_with_the_ones_there_are(bench: Path) -> None:
    (bench / "experiment.toml").write_text(BENCH.replace('drive = "duty"', 'drive = "duty"\nlaw = "lian"'))
    with pytest.raises(ExperimentError, match=r"model\.law.*lian.*liang"):
        load_experiment(bench / "experiment.toml", CATALOGUE)


def test_every_input_of_every_load_and_drive_has_a_unit() -> None:
    from smajax.core.units import convert
    from smajax.model.channels import INPUT_UNITS
    from smajax.model.presets import DRIVES, LOADS

    for made in (*LOADS.values(), *DRIVES.values()):
        own = made()
        for name in own.inputs_required | own.inputs_optional:
            assert convert(1.0, INPUT_UNITS[name], INPUT_UNITS[name]) == 1.0, name


@pytest.mark.parametrize("content", [b"Zeit;Weg\n0;1\n", "Zeit;Weg/µm\n0;1\n".encode("latin-1")])
def test_a_log_in_the_place_of_an_experiment_file_is_told_what_begins_one(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "log.csv").write_bytes(content)
    with pytest.raises(ExperimentError, match=r"`smajax new-experiment log\.csv` begins one from it"):
        load_experiment(tmp_path / "log.csv", CATALOGUE)
