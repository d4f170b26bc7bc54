"""Options and arguments: quantities with units, lists, the completion of names, and what is said about each mistake."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.cli.options import numbers, pairs, texts, understood
from smajax.control.compose import compose, with_values
from smajax.control.mismatch import MISMATCHES, variation_of
from smajax.control.presets import CONTROLLERS
from smajax.control.tune.terms import TERMS
from smajax.core.parameters import parameter_values
from tests.helpers.command_line import DEMO

pytestmark = pytest.mark.usefixtures("blank_pictures")


@pytest.mark.parametrize(
    "command", ["simulate", "sweep", "tune", "check", "identify", "close-loop", "figures", "bench"]
)
def test_every_option_that_takes_a_quantity_says_its_unit(command: str) -> None:
    """A plain number is asked for where it is a share of something alone."""
    told = " ".join(CliRunner().invoke(app, [command, "--help"]).output.split())
    assert re.findall(r"--([\w-]+) (?:<float>|FLOAT)", told) == []
    timed = {"simulate": 3, "sweep": 2, "tune": 2, "close-loop": 1}.get(command, 0)
    assert len(re.findall(r"<s> (?:(?!--).)*without a unit in s", told.replace("--dt;", "dt;"))) == timed


@pytest.mark.parametrize("command", ["tune", "sweep"])
def test_the_help_points_to_the_one_list_of_controllers(command: str) -> None:
    """A list in the help would be a second one, which a new controller does not enter."""
    told = " ".join(CliRunner().invoke(app, [command, "--help"]).output.split())
    described = told[told.index("such as pid") :].partition("default")[0].partition("--")[0]
    assert "`smajax presets` lists them" in described
    assert len([name for name in CONTROLLERS if re.search(rf"\b{name}\b", described)]) <= 2
    listed = CliRunner().invoke(app, ["presets"]).output
    assert f"controllers: {', '.join(CONTROLLERS)}\n" in listed


@pytest.mark.parametrize(
    "command", ["close-loop", "check", "identify", "predict", "demo", "figures", "tune", "sweep", "simulate"]
)
def test_every_command_with_a_page_opens_it_on_the_same_word(command: str) -> None:
    told = " ".join(CliRunner().invoke(app, [command, "--help"], terminal_width=200).output.split())
    assert "--open / --no-open open the page in a browser when it is done [default: no-open]" in told


def test_a_page_is_opened_where_it_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    words = ["simulate", "--step", "1V:100ms", "--out", str(tmp_path / "out")]
    for more in ([], ["--no-open"], ["--open"]):
        assert CliRunner().invoke(app, [*words, *more]).exit_code == 0
        assert opened == [(tmp_path / "out" / "simulate.html").as_uri()] * (more == ["--open"])


def test_lists_and_pairs_of_numbers_take_units() -> None:
    np.testing.assert_allclose(
        numbers("--set-points", "-20,0.5 rad 10deg, 85", "deg"), [-20.0, np.degrees(0.5), 10.0, 85.0]
    )
    assert numbers("--gain-ratios", "50%,1") == (0.5, 1.0)
    limits = pairs(
        "--limits",
        ["settling_time=4000 ms,overshoot=2", "energy=0.02kJ peak_temperature=363.15K"],
        {name: term.unit for name, term in TERMS.items()},
        "overshoot=2deg",
    )
    assert limits == pytest.approx({"settling_time": 4.0, "overshoot": 2.0, "energy": 20.0, "peak_temperature": 90.0})
    told = texts("--variation", ["inertia=20%,", "damping = 0.35 payload=\N{PLUS-MINUS SIGN}5 %"])
    told |= {"convection_coefficient": "+-50%", "supply": "35%"}
    assert variation_of(told) == {"inertia": 0.2, "damping": 0.35, "supply": 0.35, "payload": 0.05, "convection": 0.5}


@pytest.mark.parametrize(
    ("typed", "unit", "told"),
    [
        ("6,5", "deg", "Set points: 6 and 5 deg."),
        ("-20,20,60", "deg", "Set points: -20, 20 and 60 deg."),
        ("1,5", "", "Set points: 1 and 5."),
        ("6, 5", "deg", ""),
        ("6.5 60deg", "deg", ""),
    ],
)
def test_an_ambiguous_decimal_comma_is_reported(typed: str, unit: str, told: str) -> None:
    assert understood("Set points", typed, numbers("--set-points", typed, unit or "1"), unit) == told


MAY_BE_WRONG = "What can differ between the plant and the controller's model: " + ", ".join(
    short if short == own else f"{short} ({own}{', in degC' if short == 'ambient' else ''})"
    for short, own in MISMATCHES.items()
)


def test_mismatches_have_the_same_names_in_every_command() -> None:
    found = set()
    for command in ("simulate", "sweep", "tune"):
        page = " ".join(CliRunner().invoke(app, [command, "--help"]).output.split())
        assert f"{MAY_BE_WRONG}. +20%" in page
        found.add(re.split(r" Example:| Options:", page[page.index(MAY_BE_WRONG) :])[0])
    assert len(found) == 1, found
    assert "1.2 times the value that the controller assumes (of 20 degC: 24 degC)" in found.pop()
    believed = compose("niti_table_3_1", "arm", "amplified_voltage", values={"ambient_temperature": "20 degC"})
    assert parameter_values(with_values(believed, {"ambient": "+20%"}))["ambient_temperature"] == pytest.approx(24.0)


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        (
            "simulate --load dead_weight",
            "`load` is the second argument, without a name: smajax simulate niti_table_3_1 dead_weight",
        ),
        ("simulate --wire=mine --step 5V:1s", "`wire` is the first argument, without a name: smajax simulate mine"),
        (
            "simulate flexinol_table_3_2 --drive",
            "third argument, without a name: smajax simulate flexinol_table_3_2 arm DRIVE",
        ),
        ("tune --controller pid", "`controller` is an argument, without a name: smajax tune pid"),
        ("sweep --controller pid", "Possible options: --controllers"),
    ],
)
def test_an_argument_given_as_an_option_is_an_error_that_shows_its_place(typed: str, told: str) -> None:
    ended = CliRunner().invoke(app, typed.split())
    assert ended.exit_code == 2
    assert f"No such option: --{typed.partition('--')[2].split()[0].split('=')[0]}" in ended.output
    assert told in ended.output


def test_a_listing_may_be_piped_into_head(tmp_path: Path) -> None:
    shell = f"{sys.executable} -m smajax presets | head -n 1; exit ${{PIPESTATUS[0]}}"
    told = subprocess.run(["bash", "-c", shell], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert told.returncode == 0, told.stderr
    assert told.stdout.count("\n") == 1


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("tune v", ["vsc1", "vsc2", "vsc3"]),
        ("sweep --controllers pid,vsc1,vsc", ["pid,vsc1,vsc2", "pid,vsc1,vsc3"]),
        ("figures M1", [f"M{number}" for number in (1, *range(10, 20))]),
        ("simulate flexinol_table_3_2 dead", ["dead_weight"]),
        (
            "simulate flexinol_table_3_2 dead_weight voltage --set martensite_",
            ["martensite_start=", "martensite_finish="],
        ),
        ("sweep --over convection,a", ["convection,ambient"]),
        ("tune sld --variation inertia=0.2,c", ["inertia=0.2,convection="]),
        ("simulate --mismatch inertia=+20%,con", ["inertia=+20%,convection=", "inertia=+20%,convection_coefficient="]),
        ("tune sld --limits s", ["settling_time=", "steady_error="]),
        ("tune sld --objective w", ["worst"]),
        ("tune sld --by a", ["adam"]),
        ("demo --only l", ["latent"]),
        (
            f"identify {DEMO} --profile martensite_finish,a",
            ["martensite_finish,austenite_start", "martensite_finish,austenite_finish", "martensite_finish,all"],
        ),
        ("identify nowhere.toml --profile a", []),
    ],
)
def test_the_tab_key_offers_the_names_there_are(typed: str, offered: list[str]) -> None:
    words = f"smajax {typed}"
    asked = {"_SMAJAX_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    told = CliRunner().invoke(app, [], env=asked, prog_name="smajax")
    assert told.stdout.split() == offered, told.output
