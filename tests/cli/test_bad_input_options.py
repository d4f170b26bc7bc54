"""Options that cannot be used, of every other command: one message with what there is instead, exit code 2, nothing written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.helpers.small_bench import log, refused, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")

WIRE = ("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
SIMULATE = {
    "a wire there is none of": (
        ["flexinol", "--step", "5V:1s"],
        "No wire preset `flexinol`; did you mean 'flexinol_ht_500um'? There are: flexinol_ht_500um, ",
    ),
    "a load there is none of": (
        [*WIRE[:1], "weight", "voltage", "--step", "5V:1s"],
        "No load preset `weight`; did you mean 'dead_weight'? There are: arm",
    ),
    "no time": ([*WIRE, "--step", "5V"], "nothing says how long the run is: give levels with times (6V:5s,0V:10s)"),
    "minutes as metres": ([*WIRE, "--step", "5V:8m"], "Invalid value for --step: '5V:8m': got unit 'm'"),
    "what minutes are": ([*WIRE, "--step", "5V:8m"], "minutes are 'min'"),
    "a level left out": ([*WIRE, "--step", "8V:2s,,5V:1s"], "got '' in '8V:2s,,5V:1s', nothing between two commas"),
    "a coupon without inputs": (
        ["flexinol_isobaric", "coupon", "none"],
        "the model needs the inputs 'stress' and 'temperature': give --input stress=LEVEL:10s --input temperature=LEVEL:10s",
    ),
    "levels without times": ([*WIRE, "--step", "6V,0V"], "got '6V', expected LEVEL:TIME, such as '6V:5s'"),
    "no input": (
        [*WIRE, "--seconds", "3"],
        "the model needs the input 'voltage': give --step LEVEL:TIME,LEVEL:TIME or --input voltage=6V:10s",
    ),
    "a length for a voltage": ([*WIRE, "--step", "5mm:1s"], "got unit 'mm', expected one like 'V', to which"),
    "no step": ([*WIRE, "--step", "5V:1s", "--dt", "0"], "'--dt': more than 0 s, not `0`; give one such as 5ms"),
    "a step back": (
        [*WIRE, "--step", "5V:1s", "--dt", "-5ms"],
        "'--dt': more than 0 s, not `-5ms`; give one such as 5ms",
    ),
    "a step of a volt": ([*WIRE, "--step", "5V:1s", "--dt", "5V"], "'--dt': got unit 'V'"),
    "minutes as metres in a length": (
        [*WIRE, "--step", "5V:1s", "--seconds", "2m"],
        "'--seconds': got unit 'm' (minutes are 'min')",
    ),
    "a time column without a file": (
        [*WIRE, "--step", "5V:1s", "--time", "10s"],
        "for --time: names the time column of a file, and no input is from a file: leave `10s` out (the length of "
        "the run is --seconds)",
    ),
    "a length in the place of a time column": (
        [*WIRE, "--input", "voltage={log}:U:V", "--time", "10s"],
        "no column '10s'; it has: t, U, x; a time column is named by --time, as COLUMN or COLUMN:UNIT; how long a run is says --seconds",
    ),
    "a time column before the first": (
        [*WIRE, "--input", "voltage={log}:U:V", "--time", "0"],
        "no column number 0; it has columns 1 to 3; a time column is named by --time",
    ),
    "a time column that goes back": (
        [*WIRE, "--input", "voltage={log}:x:V", "--time", "U"],
        "the time column 'U' does not increase",
    ),
    "a time in a unit there is not": (
        [*WIRE, "--input", "voltage={log}:U:V", "--time", "t:foo"],
        "the time column 't': unit 'foo' is not known; expected one like 's'",
    ),
    "a time in volts": (
        [*WIRE, "--input", "voltage={log}:U:V", "--time", "t:V"],
        "the time column 't': got unit 'V', expected one like 's'",
    ),
    "a run of less than a step": (
        [*WIRE, "--input", "voltage={log}:U:V", "--time", "t:us"],
        "take a shorter --dt or a longer run, or correct the unit of the times",
    ),
    "no run": (
        [*WIRE, "--step", "5V:1s", "--seconds", "0s"],
        "'--seconds': more than 0 s, not `0s`; give one such as 10s",
    ),
    "a decimal comma": (
        [*WIRE, "--step", "6,5V"],
        "got '6,5V', expected a decimal point, as in '6.5V': a comma stands between levels",
    ),
    "a decimal comma in a time": (
        [*WIRE, "--step", "6V:2,5s,0V:1s"],
        "got '6V:2,5s', expected a decimal point, as in '6V:2.5s'",
    ),
    "a decimal comma in a length": (
        [*WIRE, "--step", "6V:2s", "--seconds", "1,5s"],
        "'--seconds': got '1,5s', expected a decimal point; write '1.5s'",
    ),
    "a step that is none": (
        [*WIRE, "--step", "5V:1s", "--dt", "nan"],
        "'--dt': got 'nan', expected a number and a unit like '1.5 s'",
    ),
    "too many steps": ([*WIRE, "--step", "5V:1s", "--dt", "1 fs"], "are over 20,000,000 samples: take a longer --dt"),
    "too long": ([*WIRE, "--step", "5V:1e300s"], "are over 20,000,000 samples"),
    "a misspelt parameter": (
        [*WIRE, "--step", "5V:1s", "--set", "wire_lenght=4"],
        "Invalid value for --set: no parameter 'wire_lenght'; did you mean 'wire_length'",
    ),
    "a negative diameter": (
        [*WIRE, "--step", "5V:1s", "--set", "wire_diameter=-1mm"],
        "Invalid value for --set: outside of the bounds: `wire_diameter` = -0.001 m (from 1e-05",
    ),
    "nan": ([*WIRE, "--step", "5V:1s", "--set", "wire_diameter=nan"], "`wire_diameter` = nan m (from"),
    "A_s above A_f": (
        [*WIRE, "--step", "5V:1s", "--set", "austenite_start=90"],
        "= 90 degC is not below `austenite_finish`",
    ),
    "a missing file": ([*WIRE, "--input", "voltage=no.csv:U:V"], "no.csv: there is no such file"),
    "a missing column": ([*WIRE, "--input", "voltage={log}:W:V"], "no column 'W'; it has: t, U, x"),
    "a column without unit": (
        [*WIRE, "--input", "voltage={log}:U"],
        "does not say its unit; write it behind: a.csv:U:V",
    ),
    "an input there is none of": (
        [*WIRE, "--input", "voltag=5V:1s"],
        "Invalid value for --input voltag: no input 'voltag'; did you mean 'voltage'?",
    ),
    "a second input in another unit": (
        [*WIRE, "--step", "5V:1s", "--input", "mass=3K"],
        "Invalid value for --input mass: got unit 'K', expected one like 'kg'",
    ),
    "a time column there is none of": (
        [*WIRE, "--input", "voltage={log}:U:V", "--time", "s"],
        "Invalid value for --input voltage or --time: ",
    ),
    "a set point in another unit": (
        ["--controller", "pid", "--set-point", "4N:5s"],
        "Invalid value for --set-point: '4N:5s': got unit 'N'",
    ),
    "a controller there is none of": (
        ["--controller", "pdi", "--set-point", "4deg:5s"],
        "no controller 'pdi'; did you mean 'pid'",
    ),
    "a size that does not say which way": (
        ["--controller", "pid", "--set-point", "4deg:5s", "--mismatch", "inertia=20%"],
        "Invalid value for --mismatch: got inertia=20%, expected +20% or -20%, a change of what it is, or a value",
    ),
    "a size that goes both ways": (
        ["--controller", "pid", "--set-point", "4deg:5s", "--mismatch", "damping=+-20%"],
        "got damping=+-20%, expected +20% or -20%",
    ),
    "a change of an effect that is not believed": (
        ["--controller", "pid", "--set-point", "4deg:5s", "--mismatch", "latent_heat.enthalpy=+20%"],
        "is a change of what is there, and the effect latent_heat is not: give a value in J/kg, such as '",
    ),
    "a change of zero": (
        ["--controller", "pid", "--set-point", "4deg:5s", "--set", "damping=0", "--mismatch", "damping=+20%"],
        "damping=+20% is a change of what is there, which is 0, as any share of it: give a value in N m s/rad.",
    ),
    "a share of a temperature": (
        [*WIRE, "--step", "5V:1s", "--set", "austenite_start=+10%"],
        "austenite_start=+10% is a share of degrees Celsius, which says little: expected the temperature, such as '",
    ),
    "a change below the bounds": ([*WIRE, "--step", "5V:1s", "--set", "damping=-150%"], "`damping` = -"),
    "a decimal comma in a change": (
        [*WIRE, "--step", "5V:1s", "--set", "damping=+2,5%"],
        "damping: got '+2,5%', expected a decimal point; write '+2.5%'",
    ),
    "one parameter by two names": (
        [*WIRE, "--step", "5V:1s", "--set", "convection=80,convection_coefficient=90"],
        "'convection_coefficient' and 'convection' are the same parameter: give it once",
    ),
    "a short name of what the model has not": (
        [*WIRE, "--step", "5V:1s", "--set", "inertia=+20%"],
        "no parameter 'inertia' (inertia_ratio); `smajax presets WIRE LOAD DRIVE` lists those of a model",
    ),
    "gains that are not there": (["--gains", "no.json", "--set-point", "4deg:5s"], "gains file no.json cannot be read"),
}


@pytest.mark.parametrize("name", SIMULATE)
def test_an_impossible_simulation_is_refused(tmp_path: Path, name: str) -> None:
    words, expected = SIMULATE[name]
    path = log(tmp_path / "a.csv")
    said = refused("simulate", *[one.format(log=path) for one in words], "--out", tmp_path / "out")
    assert expected in said
    assert not (tmp_path / "out").exists()


GAINS = {
    "a list": ("[1]", "must have `controller` and `gains`"),
    "a controller of another type": ('{"controller": ["pid"], "gains": {}}', "no controller ['pid']"),
    "brackets without end": ("[" * 100_000, "is not JSON ("),
    "a number without end": (
        '{"controller": "pid", "gains": {"proportional_gain": ' + "9" * 5000 + "}}",
        "is not JSON (",
    ),
    "a number that is none": (
        '{"controller": "pid", "gains": {"proportional_gain": NaN}}',
        "proportional_gain must be a number, not nan",
    ),
    "text": ('{"controller": "pid", "gains": {"proportional_gain": "3"}}', "must be a number, not '3'"),
    "a misspelt gain": ('{"controller": "pid", "gains": {"proportional": 3}}', "did you mean 'proportional_gain'"),
}


@pytest.mark.parametrize("name", GAINS)
def test_a_file_without_gains_is_refused(tmp_path: Path, name: str) -> None:
    content, expected = GAINS[name]
    (tmp_path / "gains.json").write_text(content)
    for words in (["simulate", "--gains"], ["sweep", "--gains"], ["tune", "pid", "--start"]):
        more = ["--set-point", "4deg:5s"] if words[0] == "simulate" else []
        assert expected in refused(*words, tmp_path / "gains.json", *more, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


LONG = {
    "sweep --controllers pdi": "no controller `pdi`; did you mean 'pid'? There are: pid,",
    "sweep --controllers ,": "no controller is named, expected some of pid,",
    "sweep --controllers pid --over convection,damp": "for --over: no mismatch `damp`; did you mean 'damping'? There are: in",
    "sweep --controllers pid --over austenite_start": "for --over: `austenite_start` is a temperature, or of the start",
    "sweep --controllers pid --over damping,damping": "for --over: `damping` twice, expected one mismatch or different ones",
    "sweep --controllers pid --over convection,damping,convection_coefficient": "for --over: `convection` twice",
    "sweep --controllers pid --over convection,,damping": "for --over: no mismatch ``",
    "sweep --controllers pid --over convection,damping,payload --points 3": "of a map, and 3 mismatches are on plants",
    "sweep --controllers pid --over convection,damping,payload --plants 0": "for --plants: at least one, not 0",
    "sweep --set-points a": "finite numbers with commas between them, not `a`",
    "sweep --set-points nan": "finite numbers with commas between them, not `nan`",
    "sweep --set-points 400": "set points are angles between the arm's stops, -45 to 95 degrees",
    "sweep --gain-ratios 1,inf": "finite numbers with commas between them, not `1,inf`",
    "sweep --gain-ratios=-1": "ratios of the main gain are numbers above 0",
    "sweep --points 1": "'--points': 2 or more, not `1`",
    "sweep --seconds inf": "'--seconds': got 'inf', expected a number and a unit like '1.5 s'",
    "sweep --seconds 10ms": "'--seconds': 0.1 to 86400 s, not `10ms`",
    "sweep --seconds 10kg": "'--seconds': got unit 'kg'",
    "sweep --noise nan": "'--noise': got 'nan', expected a number and a unit like '1.5 deg'",
    "tune pid --quantum nan": "'--quantum': got 'nan', expected a number and a unit like '1.5 deg'",
    "sweep --noise 9rad": "'--noise': 0 to 360 deg, not `9rad`",
    "sweep --period nan": "'--period': got 'nan', expected a number and a unit like '1.5 s'",
    "sweep --period 15ms": "a whole number of simulation steps of 0.01 s, not 0.015 s",
    "sweep --set-points 10V": "not `10V`: got unit 'V'",
    "sweep --quantum 9rad": "'--quantum': 0 to 360 deg, not `9rad`",
    "sweep --ratios 0.9": "two numbers, such as 0.9,1.1, not `0.9`",
    "sweep --ratios 1.1,0.9": "ratios of plant over model go from below 1 to above 1, such as 0.9 to 1.1; not 1.1 to 0.9",
    "sweep --estimator kalman": "no filter `kalman`; there are: printed, model",
    "tune pdi": "no controller `pdi`; did you mean 'pid'?",
    "tune pid --variation inertai=0.2": "for --variation: no variation `inertai`; did you mean 'inertia'?",
    "tune pid --variation inertia=nan": "for --variation: got inertia=nan, expected a share such as inertia=20% or inertia=0.2",
    "tune pid --variation inertia=2%damping=3%": "got inertia=2%damping=3%, expected a share such as inertia=20% or inertia=0.2, "
    "with a comma before the next name.",
    "tune pid --variation inertia=0,2": "the next name (got '0,2', expected a decimal point; write '0.2').",
    "tune pid --variation inertia=20": "not inertia=20; 20 per cent is inertia=20%",
    "tune pid --variation inertia=+20%": "expected a variation, which goes both ways: inertia=20% is from -20% to +20%",
    "tune pid --variation convection=20%,convection_coefficient=10%": "is `convection`, which is given already",
    "sweep --over damping=20%": "names alone, as in `convection,damping`, not `damping=20%`",
    "tune pid --variation inertia=2": "a variation is a share between 0 and 1",
    "tune pid --limits overshot=2": "no term `overshot`; did you mean 'overshoot'?",
    "tune pid --limits overshoot=nan": "each name once with its number",
    "tune pid --weights overshoot=-2": "weights are no less than 0",
    "tune pid --objective best": "no objective `best`; there are: nominal, worst, mean-variance",
    "tune pid --by newton": "no rule `newton`; there are: trust-region, adam",
    "tune pid --limits overshoot=2kg": "not `overshoot=2kg`: got unit 'kg'",
    "tune pid --limits overshoot=2,5": "got '2,5', expected a decimal point; write '2.5'",
    "tune pid --seconds 1e9s": "'--seconds': 0.1 to 86400 s, not `1e9s`",
    "figures M99": "No figure `M99`; there are chapter3",
}


@pytest.mark.parametrize("words", LONG)
def test_impossible_options_of_long_work_are_refused(tmp_path: Path, words: str) -> None:
    said = refused(*words.split(), "--out", tmp_path / "out")
    assert LONG[words] in said
    assert not (tmp_path / "out").exists()


def test_a_new_experiment_of_a_file_that_is_no_log_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "experiment.toml"
    for name, content, expected in (
        ("no.csv", None, "there is no such file"),
        ("empty.csv", "", "the file is empty"),
        ("heading.csv", "t,U,x\n", "holds a header and no data line"),
        ("text.csv", "a,b\nfoo,bar\nfoo,baz\n", "no column of numbers; line 2, column 'a': 'foo' is not a number"),
        ("log.xlsx", "t,U,x\n0,1,2\n", "files ending in '.xlsx' cannot be read; expected .csv"),
    ):
        if content is not None:
            (tmp_path / name).write_text(content)
        assert expected in refused("new-experiment", tmp_path / name, "--out", out)
        assert not out.exists()
    good = log(tmp_path / "good.csv")
    assert "the folder" in refused("new-experiment", good, "--out", tmp_path / "no" / "experiment.toml")
    out.write_text("mine")
    assert "exists; give another name, or --overwrite" in refused("new-experiment", good, "--out", out)
    assert out.read_text() == "mine"


@pytest.mark.parametrize("cell", ["nan", "inf", "0"])
def test_a_new_experiment_of_a_strange_log_is_begun_and_says_what_is_wrong(tmp_path: Path, cell: str) -> None:
    path = tmp_path / "strange.csv"
    path.write_text("t,U,x\n" + "".join(f"{cell if cell == '0' else k},{cell},{k}\n" for k in range(30)))
    ended = smajax("new-experiment", path, "--out", tmp_path / "experiment.toml")
    assert ended.code == 3
    assert "It cannot be loaded yet: " in ended.out
    assert "Warning" not in ended.said


def test_a_logs_name_cannot_become_a_section(tmp_path: Path) -> None:
    path = log(tmp_path / 'q"\n[model]\nwire = "x.csv')
    ended = smajax("new-experiment", path, "--out", tmp_path / "experiment.toml", "--json")
    assert ended.code == 0, ended.out
    assert (tmp_path / "experiment.toml").read_text().count("\n[model]") == 1


def test_a_melting_wire_is_reported(tmp_path: Path) -> None:
    ended = smajax("simulate", *WIRE, "--step", "1000000V:1s", "--out", tmp_path / "out")
    assert ended.code == 0
    assert "The wire reaches" in ended.said
    assert "and it melts at 1310 degC: is the input's unit right?" in ended.said


@pytest.mark.parametrize(("mass", "told"), [("200", "1.11e5 MPa"), ("5", "27.. MPa"), ("3", "")])
def test_a_stress_that_no_wire_carries_is_reported(tmp_path: Path, mass: str, told: str) -> None:
    ended = smajax("simulate", *WIRE, "--set", f"load_mass={mass}", "--step", "3V:1s", "--out", tmp_path / "out")
    assert ended.code == 0
    words = f"The stress reaches {told}, and no wire carries more than 1900 MPa: is the load's unit right"
    assert bool(re.search(words, ended.said)) == bool(told)
    assert ("no wire carries" in ended.said) == bool(told)
