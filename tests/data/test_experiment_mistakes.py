"""An error in an experiment file names the file, the key and the valid choices."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from tests.helpers.bench_experiment import BENCH, CATALOGUE, changed, load, write_run

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
    (
        'column = "pos"',
        'column = "duty"',
        r"channels.position: is read from 'duty' in run 'A', as 'duty' is; give the column",
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


def test_a_missing_file_and_a_file_without_runs_are_errors(bench: Path) -> None:
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


def test_an_unknown_law_is_an_error_with_the_valid_choices(bench: Path) -> None:
    (bench / "experiment.toml").write_text(BENCH.replace('drive = "duty"', 'drive = "duty"\nlaw = "lian"'))
    with pytest.raises(ExperimentError, match=r"model\.law.*lian.*liang"):
        load_experiment(bench / "experiment.toml", CATALOGUE)


@pytest.mark.parametrize("content", [b"Zeit;Weg\n0;1\n", "Zeit;Weg/µm\n0;1\n".encode("latin-1")])
def test_a_log_in_place_of_an_experiment_file_is_an_error_that_names_new_experiment(
    tmp_path: Path, content: bytes
) -> None:
    (tmp_path / "log.csv").write_bytes(content)
    with pytest.raises(ExperimentError, match=r"`smajax new-experiment log\.csv` begins one from it"):
        load_experiment(tmp_path / "log.csv", CATALOGUE)
