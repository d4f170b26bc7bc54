"""An experiment file and its logs become one record in SI units."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from tests.helpers.bench_experiment import BENCH, CATALOGUE, ONE_FIT, changed, load, write_run


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


def test_a_unit_of_a_run_that_its_heading_contradicts_is_a_warning(bench: Path) -> None:
    _other_names(bench)
    (bench / "b.csv").write_text((bench / "b.csv").read_text().replace("weg", "weg [um]"))
    own = OWN.replace("position = 3", 'position = "weg [um]"').replace('"um"', '"nm"')
    got = load(changed(bench, 'file = "b.csv"', f'file = "b.csv"\n{own}'))
    assert any("runs.B.units.position is 'nm', and the heading 'weg [um]' says um" in text for text in got.warnings)


def test_a_run_may_be_one_matlab_file_a_channel(bench: Path) -> None:
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


def test_a_coupon_may_have_no_time_and_a_constant_input(tmp_path: Path) -> None:
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


def test_the_data_folder_is_found_from_the_environment_or_beside_a_parent(
    bench: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_a_fixed_unknown_is_a_known_value(bench: Path) -> None:
    got = load(changed(bench, "[nuisance]", "fixed = true\n[nuisance]"))
    assert got.unknowns == ()
    assert got.parameters["specific_heat"] == pytest.approx(836.8)


def test_two_outputs_have_their_own_noise_and_offset(bench: Path) -> None:
    for log in bench.glob("*.csv"):
        head, *rows = log.read_text().splitlines()
        log.write_text("\n".join([f"{head},kelvin", *(f"{row},{row.split(',')[-1]}" for row in rows)]))
    warm = '[channels.temperature]\nrole = "output"\ncolumn = "kelvin"\nunit = "K"\nnoise = "0.5 K"\noffset = false\n[[runs]]'
    got = load(changed(bench, "[[runs]]", warm))
    position, temperature = got.outputs
    assert (position.name, position.offset, temperature.name, temperature.offset) == (
        "position",
        True,
        "temperature",
        False,
    )
    assert temperature.noise_sigma == pytest.approx(0.5 * 0.466, rel=0.01)
    np.testing.assert_allclose(got.runs[0].outputs["temperature"], 1e3 * got.runs[0].output - 273.15, atol=1e-9)
    # These numbers are degrees Celsius, and are declared to be kelvins.
    assert any(
        "the temperature falls to -273.18 degC" in told and "is it in degC, and not in K?" in told
        for told in got.warnings
    )


def test_the_temperature_that_a_run_starts_with_may_be_known(bench: Path) -> None:
    first = 'file = "a.csv"\nparameters = { initial_temperature = "40 degC" }'
    with pytest.raises(
        ExperimentError, match=r"runs.B.parameters.initial_temperature: is missing, and other runs have"
    ):
        load(changed(bench, 'file = "a.csv"', first))
    second = '[runs.parameters]\ninitial_temperature = "310 K"'
    got = load(changed(bench, "[runs.parameters]", second))
    assert [run.parameters["initial_temperature"] for run in got.runs] == pytest.approx([40.0, 36.85])


def test_a_start_that_the_model_prescribes_is_refused(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "50.txt", np.stack([300.0 + np.arange(30.0), np.linspace(4.0, 0.0, 30) ** 2], axis=1))
    start = 'initial_temperature = { low = "0 degC", high = "50 degC", start = "20 degC" }'
    (tmp_path / "isobaric.toml").write_text(f"{COUPON}\n[nuisance]\n{start}\n")
    with pytest.raises(
        ExperimentError, match=r"nuisance.initial_temperature: the temperature of this load is an input"
    ):
        load_experiment(tmp_path / "isobaric.toml", CATALOGUE)


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
