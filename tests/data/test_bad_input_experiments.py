"""Experiments whose numbers cannot be, contradict each other or look like another unit: refused, or warned of in the report."""

from __future__ import annotations

import json
import shutil
import warnings
from importlib import resources
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.cli.options import DEMOS
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.magnitude import BY_HEAT
from smajax.data.model_catalogue import CATALOGUE
from smajax.model.presets import LOADS, build
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.sensors import sensor_output, sensors_of
from tests.helpers.small_bench import bench, log, refused, smajax, table

PARAMETERS = "[model.parameters]\n{}\n[unknown]"
REFUSED: dict[str, tuple[tuple[str, str], str]] = {
    "M_f above M_s": (
        ("[unknown]", PARAMETERS.format('martensite_finish = "60 degC"')),
        "model.parameters.martensite_finish: `martensite_finish` = 60 degC is not below `martensite_start`",
    ),
    "A_s above A_f": (
        ("[unknown]", PARAMETERS.format('austenite_start = "90 degC"')),
        "model.parameters.austenite_start: `austenite_start` = 90 degC is not below `austenite_finish` = 78 degC; on heating",
    ),
    "unknown A_s that starts above A_f": (
        ("[unknown]", '[unknown]\naustenite_start = { low = "60 degC", high = "90 degC", start = "89 degC" }'),
        "unknown.austenite_start: `austenite_start` = 89 degC is not below `austenite_finish`",
    ),
    "A_s of one run above A_f": (
        ('name = "B"', 'name = "B"\nparameters = { austenite_start = "99 degC" }'),
        "runs.B.parameters: `austenite_start` = 99 degC is not below",
    ),
    "a negative diameter": (
        ("[unknown]", PARAMETERS.format('wire_diameter = "-0.1 mm"')),
        "model.parameters.wire_diameter: got '-0.1 mm', that is -0.0001 m; expected 1e-05 to 0.01 m",
    ),
    "no diameter": (
        ("[unknown]", PARAMETERS.format('wire_diameter = "0 m"')),
        "model.parameters.wire_diameter: got '0 m'",
    ),
    "nan": (("[unknown]", PARAMETERS.format("wire_diameter = nan")), "got nan, expected a finite number in 'm'"),
    "a number too large": (("[unknown]", PARAMETERS.format('wire_diameter = "1e999 m"')), "expected a finite number"),
    "a date": (
        ("[unknown]", PARAMETERS.format("wire_diameter = 2020-01-01")),
        "expected a table of name = 'number unit'",
    ),
    "a unit of another kind": (
        ("[unknown]", PARAMETERS.format('wire_diameter = "0.1 s"')),
        "got unit 's', expected one like 'm', to which",
    ),
    "no unit": (
        ("[unknown]", PARAMETERS.format("wire_diameter = 0.1")),
        "got 0.1 without a unit, expected one like 'mm'; write '0.1 mm'",
    ),
    "a tower of powers": (
        ("[unknown]", PARAMETERS.format('wire_diameter = "1 m**9**9**9**9"')),
        "model.parameters.wire_diameter: unit 'm**9**9**9**9' is not known",
    ),
    "Python": (
        ("[unknown]", PARAMETERS.format("wire_diameter = \"1 __import__('os').getcwd()\"")),
        "is not known; expected one like 'm'",
    ),
    "a misspelt parameter": (
        ("convection_coefficient", "convection_coeficient"),
        "unknown.convection_coeficient: there is no parameter 'convection_coeficient'; did you mean 'convection_coefficient'?",
    ),
    "bounds the wrong way round": (
        ('low = "40 W', 'low = "900 W'),
        "which is not below high = '400 W/m^2/K'; exchange the two",
    ),
    "a start outside": (
        ('start = "100 W', 'start = "1 W'),
        "got '1 W/m^2/K', expected between '40 W/m^2/K' and '400 W/m^2/K'",
    ),
    "a misspelt key": (
        ("[sampling]", "[smapling]"),
        "smapling: is not a known key; did you mean 'sampling'? Known here: ",
    ),
    "an effect asked for and excluded": (
        ("[sampling]", '[effects]\nonly = ["latent_heat"]\nexclude = ["latent_heat"]\n[sampling]'),
        "effects.exclude: 'latent_heat' is in effects.only too; remove it from one of them",
    ),
    "an effect of the model excluded": (
        (
            "[unknown]",
            '[effects]\nexclude = ["latent_heat"]\n' + PARAMETERS.format('"latent_heat.enthalpy" = "20 J/g"'),
        ),
        "'latent_heat' is part of the model, since the file names 'latent_heat.enthalpy'; remove one of the two",
    ),
    "a misspelt effect": (
        ("[sampling]", '[effects]\nonly = ["latent_heet"]\n[sampling]'),
        "effects.only: there is no effect 'latent_heet'; did you mean 'latent_heat'?",
    ),
    "a wrong unit of a channel": (('unit = "V"', 'unit = "A"'), "channels.voltage.unit: got unit 'A'"),
    "a channel without unit": (('unit = "V"\n', ""), "channels.voltage.unit: is missing; expected text like 'MPa'"),
    "the time in ms": (
        ('unit = "s"', 'unit = "ms"'),
        "lasts 0.01995 s, less than a step of 0.1 s; take a shorter step, or",
    ),
    "a character no name has": (('file = "a.csv"', 'file = "a\\u0000.csv"'), "which is no file's name"),
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("command", ["close-loop", "identify"])
def test_an_impossible_experiment_is_refused(tmp_path: Path, name: str, command: str) -> None:
    change, words = REFUSED[name]
    experiment = bench(tmp_path / "bench", change)
    said = refused(command, experiment, "--out", tmp_path / "out")
    assert said.startswith(f"Error: {experiment}: "), said
    assert words in said
    assert not (tmp_path / "out").exists()


def test_identify_reports_that_nothing_is_unknown_and_what_cannot_be_profiled(tmp_path: Path) -> None:
    experiment = bench(tmp_path / "bench")
    said = refused("identify", experiment, "--out", tmp_path / "out", "--profile", "convecton_coefficient")
    assert "no profile of convecton_coefficient: not fitted; fitted are convection_coefficient" in said
    text = experiment.read_text()
    experiment.write_text(text[: text.index("[unknown]")] + text[text.index("[sampling]") :])
    assert "nothing is declared unknown; add a section [unknown.NAME]" in refused(
        "identify", experiment, "--out", tmp_path / "o"
    )


@pytest.mark.slow
def test_few_samples_give_no_warning_of_their_distribution(tmp_path: Path) -> None:
    experiment = bench(tmp_path / "bench")
    log(experiment.parent / "a.csv", seconds=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ended = smajax("identify", experiment, "--starts", "0", "--out", tmp_path / "out", "--json")
    assert ended.code == 0, ended.said
    assert json.loads(ended.out)["residual"]["normality_p_value"] is None
    assert "normally distributed" not in ended.out


def _warned(experiment: Path, words: str) -> bool:
    return any(words in one for one in load_experiment(experiment, CATALOGUE).warnings)


def test_the_sound_experiment_is_warned_of_its_few_runs_alone(tmp_path: Path) -> None:
    sizes, few = load_experiment(bench(tmp_path), CATALOGUE).warnings
    assert sizes.startswith("[model.parameters] gives nothing of this bench")
    assert few.startswith("only 1 fit run")


def test_a_duty_declared_as_a_voltage_is_detected_by_its_heat(tmp_path: Path) -> None:
    experiment = bench(tmp_path)
    log(tmp_path / "a.csv", top=100.0)
    assert _warned(
        experiment, "run 'A': the mean power of the input 'voltage' would heat the wire to 8578 degC, and it melts"
    )
    assert _warned(experiment, "such as a duty in percent?")


def test_an_input_that_heats_nothing_is_a_warning(tmp_path: Path) -> None:
    experiment = bench(tmp_path, ('unit = "V"', 'unit = "mV"'))
    assert _warned(experiment, "the input 'voltage' at its highest, held for ever, would warm the wire by")


@pytest.mark.parametrize(
    ("unit", "words"),
    [
        ("m", "moves by 18.2 m, 34 times the wire's length of 0.537 m; is it in mm"),
        ("um", "was the wire heated at all?"),
    ],
)
def test_a_stroke_in_a_wrong_unit_is_detected_by_the_wires_length(tmp_path: Path, unit: str, words: str) -> None:
    changes = (('unit = "mm"', f'unit = "{unit}"'), ('noise = "0.1 mm"', 'noise = "estimate"'))
    assert _warned(bench(tmp_path, *changes), words)


def test_exchanged_columns_are_a_warning(tmp_path: Path) -> None:
    changes = (('column = "U"', 'column = "y"'), ('column = "x"', 'column = "U"'), ('column = "y"', 'column = "x"'))
    words = "the output 'position' rests at a few levels and the input 'voltage' moves all the time; are the two columns exch"
    assert _warned(bench(tmp_path, *changes), words)
    assert not _warned(bench(tmp_path), "exchanged")


@pytest.mark.parametrize("name", DEMOS)
def test_a_sensor_of_reversed_sign_is_a_warning_and_can_be_reversed(tmp_path: Path, name: str) -> None:
    shutil.copytree(Path(str(resources.files("smajax") / "data" / "demo" / name)), tmp_path / name)
    experiment = tmp_path / name / "experiment.toml"
    before = load_experiment(experiment, CATALOGUE)
    assert not any("moves against" in one for one in before.warnings)
    for file in (tmp_path / name).glob("*.csv"):
        head, *lines = file.read_text().splitlines()
        place = head.split(",").index("position_mm")
        cells = [line.split(",") for line in lines]
        turned = [[*row[:place], str(-float(row[place])), *row[place + 1 :]] for row in cells]
        file.write_text("\n".join([head, *map(",".join, turned)]))
    assert _warned(experiment, "the output 'position' moves against the model (rank correlation with the heat -0.")
    assert _warned(experiment, "reversed = true under [channels.position]")
    experiment.write_text(experiment.read_text().replace('unit = "mm"', 'unit = "mm"\nreversed = true'))
    after = load_experiment(experiment, CATALOGUE)
    assert after.warnings == before.warnings
    for old, new in zip(before.runs, after.runs, strict=True):
        np.testing.assert_array_equal(old.output, new.output)


@pytest.mark.parametrize(("mass", "warned"), [("300 g", False), ("300 kg", True)])
def test_a_load_that_no_wire_moves_is_a_warning(tmp_path: Path, mass: str, warned: bool) -> None:
    experiment = bench(
        tmp_path, ('drive = "voltage"\n', f'drive = "voltage"\n\n[model.parameters]\nload_mass = "{mass}"\n')
    )
    assert _warned(experiment, "load_mass is 300 kg; is it in g?") is warned


def test_only_an_output_can_be_reversed(tmp_path: Path) -> None:
    said = refused("identify", bench(tmp_path, ('unit = "V"', 'unit = "V"\nreversed = true')))
    assert "channels.voltage: got reversed for an input" in said
    assert "did you mean 'reversed'" in refused(
        "identify", bench(tmp_path, ('unit = "mm"', 'unit = "mm"\nreverse = true'))
    )


@pytest.mark.parametrize("load", [name for name in LOADS if "coupon" not in name])
def test_the_sign_check_agrees_with_the_model_for_every_output(load: str) -> None:
    system = (
        build("flexinol_table_3_2", load, "flexinol_voltage")
        if load != "arm"
        else build("niti_table_3_1", "arm", "amplified_voltage")
    )
    run = simulate_compiled(system, {"voltage": jnp.repeat(jnp.asarray([0.0, 6.0]), 1000)})
    for name in BY_HEAT.keys() & sensors_of(system).keys():
        shown = np.asarray(sensor_output(system, run, name))
        assert BY_HEAT[name] * (shown[-1] - shown[900]) > 0.0, (load, name)


def test_a_constant_or_clipped_channel_is_a_warning(tmp_path: Path) -> None:
    experiment = bench(tmp_path)
    t = np.arange(0.0, 20.0, 0.05)
    u, x = np.where(t < 10.0, 5.0, 0.0), 18.0 * np.sin(t / 3.0) ** 2
    for given, words in (
        ((0.0 * t + 5.0, x), "the input 'voltage' never changes in any run; is it the right column?"),
        ((u, 0.0 * t + 3.0), "the output 'position' is constant (0.003); nothing can be learnt from it"),
        ((u, np.minimum(x, 12.0)), "runs into its highest value and stays exactly there"),
    ):
        for name in ("a.csv", "b.csv"):
            table(tmp_path / name, t, *given)
        assert _warned(experiment, words), words
    assert _warned(experiment, "runs 'A' and 'B' have the same data")
    table(tmp_path / "a.csv", t, u, x)
    table(tmp_path / "b.csv", t, 0.0 * u, x)
    assert _warned(
        experiment, "run 'B': the input 'voltage' is 0 throughout, and the output moves: is it the right column?"
    )
    for other in (0.01 * x, 18.0 * np.exp(-t / 3.0)):  # a wire at rest, a hot one that cools
        table(tmp_path / "b.csv", t, 0.0 * u, other)
        assert not _warned(experiment, "is 0 throughout")
    # Another constant in each run is what was changed between them.
    for name, level in (("a.csv", 5.0), ("b.csv", 6.0)):
        table(tmp_path / name, t, 0.0 * t + level, x)
    assert not _warned(experiment, "never changes")


def test_a_run_too_short_or_a_step_too_long_for_the_dynamics_is_a_warning(tmp_path: Path) -> None:
    experiment = bench(tmp_path, ('step = "100 ms"', 'step = "5 ms"'))
    log(tmp_path / "a.csv", seconds=0.4, interval=0.005)
    words = (
        "run 'A' lasts 0.395 s, less than the wire's time constant rho c_p d / (4 h) of 0.779 s where the search starts"
    )
    assert _warned(experiment, words)
    assert not _warned(experiment, "run 'B' lasts")
    assert _warned(
        bench(tmp_path, ('step = "100 ms"', 'step = "2 s"')), "the step of 2 s is more than half of the wire's time"
    )


def test_two_sampling_rates_and_two_lengths_are_a_warning(tmp_path: Path) -> None:
    both = ('file = "a.csv"', 'files = { voltage = "a.csv", position = "x.csv" }')
    experiment = bench(tmp_path, both)
    log(tmp_path / "x.csv", interval=0.5)
    assert _warned(experiment, "the step of 0.1 s is shorter than the sensor's 0.5 s")
    log(tmp_path / "x.csv", seconds=5.0)
    assert _warned(
        experiment, "run 'A': 'voltage' lasts 19.95 s, and only 4.9 s are common to all signals; the rest is not used"
    )
    experiment = bench(tmp_path)
    t = np.concatenate([np.arange(0.0, 10.0, 0.05), np.arange(10.0, 20.0, 0.5)])
    table(tmp_path / "a.csv", t, np.where(t < 10.0, 5.0, 0.0), 18.0 * np.sin(t / 3.0) ** 2)
    assert _warned(
        experiment, "'position' is sampled at two rates, every 0.05 s and every 0.5 s, the latter first at 10 s"
    )


def test_gaps_and_repeated_samples_are_a_warning(tmp_path: Path) -> None:
    experiment = bench(tmp_path)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    (tmp_path / "a.csv").write_text("\n".join(lines[:100] + lines[150:]) + "\n")
    assert _warned(experiment, "'position' has a gap of 2.55 s at 4.9 s (usual interval 0.05 s); it is bridged")
    (tmp_path / "a.csv").write_text("\n".join([*lines[:50], lines[49], *lines[50:]]) + "\n")
    assert _warned(experiment, "1 sample of 'voltage' and 'position' at a time that another one has was taken out")


def test_an_effect_that_the_load_cannot_show_is_a_warning(tmp_path: Path) -> None:
    experiment = bench(tmp_path, ("[sampling]", '[effects]\nonly = ["nonlinear_spring", "latent_heat"]\n[sampling]'))
    assert _warned(experiment, "effects.only names 'nonlinear_spring', which changes nothing of this load and drive")
    assert not _warned(experiment, "effects.only names 'latent_heat'")


def test_an_effect_that_is_kept_out_and_could_not_be_shown_anyway_is_warned_of(tmp_path: Path) -> None:
    excluded = '[effects]\nexclude = ["nonlinear_spring", "latent_heat"]\n[sampling]'
    experiment = bench(tmp_path, ("[sampling]", excluded))
    assert _warned(
        experiment,
        "effects.exclude names 'nonlinear_spring', which changes nothing of this load and drive; it would not be tried anyway",
    )
    assert not _warned(experiment, "effects.exclude names 'latent_heat'")


def _with_line(path: Path, number: int, text: str) -> None:
    lines = path.read_text().splitlines()
    lines[number - 1] = text
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("reading", ["1e300", "-1.7976931348623157e308", "1e155"])
def test_a_reading_beyond_any_sensor_is_refused(tmp_path: Path, reading: str) -> None:
    experiment = bench(tmp_path)
    _with_line(tmp_path / "a.csv", 50, f"2.4,5,{reading}")
    with pytest.raises(
        ExperimentError, match=r"a.csv: column 'x' is .*e\+\d+ mm in line 50; no sensor shows more than 1e\+15"
    ):
        load_experiment(experiment, CATALOGUE)


@pytest.mark.parametrize(("mass", "line"), [("0", 30), ("-75", 40)])
def test_a_load_without_mass_is_refused(tmp_path: Path, mass: str, line: int) -> None:
    channel = '[channels.mass]\nrole = "input"\ncolumn = "m"\nunit = "g"\n[[runs]]'
    experiment = bench(tmp_path, ("[[runs]]", channel))
    for name in ("a.csv", "b.csv"):
        lines = (tmp_path / name).read_text().splitlines()
        (tmp_path / name).write_text("\n".join([f"{lines[0]},m", *(f"{one},75" for one in lines[1:])]) + "\n")
    load_experiment(experiment, CATALOGUE)
    _with_line(tmp_path / "a.csv", line, f"{0.05 * (line - 2)},5,3,{mass}")
    with pytest.raises(ExperimentError, match=rf"a.csv: column 'm' is .* in line {line}; expected more than 0 kg"):
        load_experiment(experiment, CATALOGUE)


def test_a_constant_below_absolute_zero_is_refused(tmp_path: Path) -> None:
    air = '[channels.ambient_temperature]\nrole = "input"\nunit = "degC"\n[[runs]]'
    place = 'file = "a.csv"\n', 'file = "a.csv"\n[runs.inputs]\nambient_temperature = "-300 degC"\n'
    other = 'file = "b.csv"\n', 'file = "b.csv"\n[runs.inputs]\nambient_temperature = "23 degC"\n'
    experiment = bench(tmp_path, ("[[runs]]", air), place, other)
    with pytest.raises(ExperimentError, match=r"got '-300 degC'.* expected more than -273.15 degC"):
        load_experiment(experiment, CATALOGUE)


@pytest.mark.parametrize("noise", ["1e-160 m", "1e200 m"])
def test_a_noise_that_no_sensor_has_is_refused(tmp_path: Path, noise: str) -> None:
    experiment = bench(tmp_path, ('noise = "0.1 mm"', f'noise = "{noise}"'))
    with pytest.raises(ExperimentError, match=r"channels.position.noise: got '1e.* no sensor has that noise there"):
        load_experiment(experiment, CATALOGUE)


def test_a_single_sample_far_off_is_warned_of(tmp_path: Path) -> None:
    experiment = bench(tmp_path)
    _with_line(tmp_path / "a.csv", 50, "2.4,5,9999")
    assert _warned(
        experiment, "run 'A': 1 sample of the output 'position' lies far from all others, the first at 2.4 s with 9.999"
    )
