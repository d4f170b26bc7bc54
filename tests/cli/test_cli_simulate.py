"""`smajax simulate`: the run is that of the model asked for, in every format, open and closed loop; mistakes are answered."""

from __future__ import annotations

import csv
import importlib.metadata
import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from PIL import Image
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.cli.result_folder import FolderTaken
from smajax.control.compose import compose
from smajax.control.mismatch import MISMATCHES
from smajax.control.perturbed_plant import perturbed_plant
from smajax.control.run_notes import TooManySetPoints
from smajax.control.run_request import LoopRequest, RunRequest, run_closed, run_open
from smajax.core.parameters import parameter_values, set_parameters
from smajax.core.units import UnitError
from smajax.data.text_input import clock_of, given, levels
from smajax.model.presets import build
from smajax.report.note_words import note_sentences
from smajax.report.simulate_page import as_csv, write_run
from smajax.report.simulate_words import conclusions, merit_rows, summary_rows
from smajax.simulation.compiled import simulate_compiled

pytestmark = pytest.mark.usefixtures("blank_pictures")

run = CliRunner()
HANGING = ("flexinol_table_3_2", "dead_weight", "flexinol_voltage")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("simulated") / "run"
    words = ["simulate", *HANGING, "--step", "5V:2s,0V:1s", "--set", "wire.heat.convection_coefficient=80"]
    told = run.invoke(app, [*words, "--dt", "10ms", "--gif", "--no-open", "--out", str(out)])
    assert told.exit_code == 0, told.output
    return out


def test_the_files_hold_the_run_of_the_model(folder: Path) -> None:
    system = set_parameters(build(*HANGING), {"convection_coefficient": 80.0})
    voltage = jnp.where(jnp.arange(301) < 200, 5.0, 0.0)
    expected = simulate_compiled(system, {"voltage": voltage}, 0.01, 1e-4)
    with xr.open_dataset(folder / "simulate.nc", engine="scipy") as found:
        np.testing.assert_allclose(found["position"], expected.position, rtol=1e-9)
        np.testing.assert_allclose(found["voltage"], voltage, rtol=1e-12)
        assert (found["position"].attrs["units"], found["stress"].attrs["units"]) == ("m", "Pa")
    with (folder / "simulate.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[150]["position [m]"]) == pytest.approx(float(expected.position[150]), rel=1e-9)
    record = json.loads((folder / "simulate.json").read_text(encoding="utf-8"))
    assert record["parameters"]["convection_coefficient"] == 80.0
    assert (record["provenance"]["dt"], record["series"]["time"]) == (0.01, [0.01 * k for k in range(301)])
    assert record["summary"]["temperature"]["greatest"] == pytest.approx(float(expected.temperature.max()))
    assert (folder / "simulate.png").stat().st_size > 10_000
    page = (folder / "simulate.html").read_text(encoding="utf-8")
    images = [
        page.count(f'{where}="data:image/{form};base64,')
        for where, form in (("src", "png"), ("srcset", "png"), ("src", "webp"), ("srcset", "webp"))
    ]
    assert images == [2, 0, 1, 1]  # the picture, the hysteresis, the animation, the same for a telephone
    assert page.count('<figure class="series"') == 1
    assert len(page.encode()) < 800_000
    assert f"lies between {float(expected.martensite_fraction.min()):.2f} and 1.00" in page
    assert (folder / "simulate.svg").read_text(encoding="utf-8").rstrip().endswith("</svg>")
    with Image.open(folder / "simulate.gif") as film:
        assert getattr(film, "n_frames", 1) > 40


def test_the_page_describes_the_run_in_words() -> None:
    told = " ".join(conclusions(run_closed(RunRequest(dt=0.01), LoopRequest("pid", "30deg:6s"))))
    assert "It transforms: the martensite fraction lies between 0.42 and 1.00, at the end 0.42." in told
    assert "The angle starts at -45 deg, lies between -45 deg and 30 deg, and ends at 30 deg." in told
    assert "The loop settles after 2.17 s." in told
    slow = run_closed(RunRequest(dt=0.01), LoopRequest("pid", "30deg:2s"))
    assert "The loop does not settle within 2 s." in conclusions(slow)
    assert ["settling time", "not within 2 s", ""] in merit_rows(slow)


def test_each_set_point_has_its_own_figures_of_merit(tmp_path: Path) -> None:
    """The first as the run to it alone has them; the energies are those of the whole run."""
    words = ["simulate", "--controller", "pid", "--dt", "10ms", "--json", "--set-point"]
    told = run.invoke(app, [*words, "40deg:3s,10deg:4s,-20deg:2s", "--out", str(tmp_path / "three")])
    alone = run.invoke(app, [*words, "40deg:3s", "--out", str(tmp_path / "one")])
    assert (told.exit_code, alone.exit_code) == (0, 0), told.output + alone.output
    record = json.loads(told.stdout)
    first, second, last = record["merit_by_set_point"]
    assert (record["merit"], json.loads(alone.stdout)["merit_by_set_point"]) == ({}, [])
    for name, figure in json.loads(alone.stdout)["merit"].items():
        assert first["merit"][name]["value"] == pytest.approx(figure["value"], rel=1e-6, abs=1e-9), name
    ends = [(one["begin_s"], one["end_s"]) for one in (first, second, last)]
    assert ends == [(0.0, 3.0), (3.0, 7.0), (7.0, 9.0)]  # to the last digit
    assert record["series"]["time"] == [0.01 * k for k in range(901)]
    assert np.degrees(second["set_point_rad"]) == pytest.approx(10.0)
    assert record["provenance"]["dt"] == 0.01
    position, time = (np.asarray(record["series"][name]) for name in ("position", "time"))
    there = (time > 2.995) & (time < 7.005)
    beyond = np.max(np.radians(10.0) - position[there])  # it comes from above
    assert beyond > np.radians(1.0)
    assert second["merit"]["overshoot"]["value"] == pytest.approx(beyond, rel=1e-9)
    steady = there & (time > 3.0 + 0.8 * 4.0 - 0.005)
    error = np.mean(np.abs(position[steady] - np.radians(10.0)))
    assert second["merit"]["steady_error"]["value"] == pytest.approx(error, rel=1e-6)
    assert last["merit"]["settling_time"]["value"] is None
    assert any("settles at 1 of 3 set points: 40 deg after" in one for one in record["conclusions"])
    page = (tmp_path / "three" / "simulate.html").read_text(encoding="utf-8")
    assert page.count('">not within 4 s</td>') == 1
    assert page.count('">not within 2 s</td>') == 1


def test_a_set_point_beyond_the_stops_is_reported_and_several_are_a_table(tmp_path: Path) -> None:
    words = ["simulate", "--controller", "pid", "--dt", "10ms", "--out", str(tmp_path / "loop"), "--set-point"]
    told = run.invoke(app, [*words, "20deg:1s,400deg:1s"])
    assert told.exit_code == 0, told.output
    assert "cannot be reached: set points are angles between the arm's stops, -45 to 95 degrees" in told.output
    lines = told.output.splitlines()
    at = next(k for k, line in enumerate(lines) if "set point (deg)" in line)
    assert [lines[at + k].split()[:3] for k in (1, 2)] == [["20", "0", "1"], ["400", "1", "2"]]
    assert len({len(line) for line in lines[at : at + 3]}) == 1


def test_the_page_shows_the_controllers_model_beside_the_plant(tmp_path: Path) -> None:
    words = ["simulate", "--controller", "pid", "--dt", "10ms", "--set-point", "10deg:1s"]
    wrong = ["convection_coefficient=80", "latent_heat.enthalpy=20 J/g", "payload_mass=57.19 g"]  # the mass as believed
    wrong.append("ambient=+10%")
    words += [word for one in wrong for word in ("--mismatch", one)]
    told = run.invoke(app, [*words, "--out", str(tmp_path / "loop")])
    assert told.exit_code == 0, told.output
    said = " ".join(told.output.split())
    assert said.count("convection_coefficient assumed 150 -> true 80 W/(m^2 K), 0.5333 times (-46.67 %)") == 1
    assert said.count("ambient_temperature assumed 20 -> true 22 degC, +2 K") == 1
    record = json.loads((tmp_path / "loop" / "simulate.json").read_text(encoding="utf-8"))
    assert record["mismatch"] == {
        "convection_coefficient": {
            "assumed": 150.0,
            "believed": 150.0,
            "true": 80.0,
            "unit": "W/(m^2 K)",
            "ratio": 80.0 / 150.0,
        },
        "ambient_temperature": {"assumed": 20.0, "believed": 20.0, "true": 22.0, "unit": "degC", "ratio": 1.1},
        "latent_heat.enthalpy": {"assumed": None, "believed": None, "true": 20_000.0, "unit": "J/kg", "ratio": None},
    }
    page = (tmp_path / "loop" / "simulate.html").read_text(encoding="utf-8")
    assert "<td>convection_<wbr>coefficient</td><td class=n>150</td><td class=n>80</td>" in page
    assert "not in its model" in page


def test_a_mismatch_is_relative_to_the_controllers_model() -> None:
    """Of the preset's value or the one put in its place, of an effect that is believed, of the law that a controller is for."""
    changes = {"convection": "+20%", "latent_heat.enthalpy": "-50%", "ambient_temperature": "+10 %", "inertia": "1.5"}
    asked = RunRequest(dt=0.01, values={"convection_coefficient": "80", "latent_heat.enthalpy": "20 J/g"})
    found = run_closed(asked, LoopRequest("pid", "10deg:0.1s", mismatch=changes)).mismatches
    assert {one.name: (one.assumed, one.true, one.ratio) for one in found} == {
        "convection_coefficient": pytest.approx((80.0, 96.0, 1.2)),
        "latent_heat.enthalpy": pytest.approx((20_000.0, 10_000.0, 0.5)),
        "ambient_temperature": pytest.approx((20.0, 22.0, 1.1)),  # in degC, as a sweep takes it
        "inertia_ratio": pytest.approx((1.0, 1.5, 1.5)),
    }
    with pytest.raises(ValueError, match="which is 0"):  # the law of section 4.8 has no thermal term
        run_closed(
            RunRequest(dt=0.01), LoopRequest("backstepping1", "10deg:0.1s", mismatch={"thermal_modulus": "+20%"})
        )


def test_a_mismatch_is_the_same_plant_in_a_sweep_and_a_run() -> None:
    believed = build("niti_table_3_1", "arm", "amplified_voltage")
    swept = perturbed_plant(believed, dict.fromkeys(MISMATCHES, jnp.asarray(0.8)))
    asked = compose("niti_table_3_1", "arm", "amplified_voltage", values=dict.fromkeys(MISMATCHES, "-20%"))
    assert parameter_values(asked) == pytest.approx(parameter_values(swept), rel=1e-12)
    assert parameter_values(asked)["damping"] == pytest.approx(0.8 * parameter_values(believed)["damping"])


def test_a_set_point_that_moves_all_the_time_has_no_figures_of_merit(tmp_path: Path) -> None:
    rows = "\n".join(f"{k / 50},{0.2 * np.sin(k / 10)}" for k in range(101))
    (tmp_path / "sine.csv").write_text(f"time (s),angle (rad)\n{rows}\n")
    found = run_closed(RunRequest(dt=0.01), LoopRequest("pid", f"{tmp_path / 'sine.csv'}:angle (rad):held"))
    assert (found.merit, found.by_set_point) == ({}, ())
    assert TooManySetPoints(100) in found.notes
    assert any("50 at most: this reference has 100." in note for note in note_sentences(found.notes))


def test_a_written_run_can_be_an_input(folder: Path, tmp_path: Path) -> None:
    words = [
        "simulate",
        *HANGING,
        "--input",
        f"voltage={folder / 'simulate.csv'}:voltage [V]",
        "--dt",
        "10ms",
        "--json",
    ]
    told = run.invoke(app, [*words, "--set", "convection_coefficient=80 W/m^2/K", "--out", str(tmp_path / "again")])
    assert told.exit_code == 0, told.output
    first = json.loads((folder / "simulate.json").read_text(encoding="utf-8"))
    again = json.loads(told.stdout)
    np.testing.assert_allclose(again["series"]["position"], first["series"]["position"], rtol=1e-6)


def test_the_same_run_may_be_repeated_and_another_needs_its_own_folder(folder: Path) -> None:
    words = ["simulate", *HANGING, "--step", "5V:2s,0V:1s", "--dt", "10ms", "--out", str(folder)]
    again = run.invoke(app, [*words, "--set", "wire.heat.convection_coefficient=80", "--json"])
    assert again.exit_code == 0, again.output
    other = run.invoke(app, [*words, "--set", "wire.heat.convection_coefficient=90"])
    assert isinstance(other.exception, FolderTaken)
    assert "wire.heat.convection_coefficient: 80 there, 90 requested" in str(other.exception)


def test_a_gains_file_closes_the_loop(tmp_path: Path) -> None:
    gains = {"controller": "pid", "gains": {"proportional_gain": 13.0}}
    (tmp_path / "gains.json").write_text(json.dumps(gains))
    words = ["simulate", "--gains", str(tmp_path / "gains.json"), "--set-point", "30deg:6s", "--dt", "10ms", "--json"]
    told = run.invoke(app, [*words, "--out", str(tmp_path / "loop")])
    assert told.exit_code == 0, told.output
    record = json.loads(told.stdout)
    assert record["merit"]["steady_error"]["value"] < np.radians(1.0)
    assert np.degrees(record["series"]["wanted"][-1]) == pytest.approx(30.0)
    assert record["series"]["position"][-1] == pytest.approx(np.radians(30.0), abs=np.radians(1.0))
    assert record["provenance"]["gains"]["proportional_gain"] == 13.0
    assert record["provenance"]["version of jax"] == importlib.metadata.version("jax")
    with xr.open_dataset(tmp_path / "loop" / "simulate.nc", engine="scipy") as found:
        assert json.loads(found.attrs["gains"]) == record["provenance"]["gains"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--step", "7V"], "how long the run is"),
        (["--step", "7V:1s,3V"], "LEVEL:TIME"),
        (["--step", "7V:1s", "--set", "convection_coeficient=80"], "did you mean 'convection_coefficient'"),
        (["--step", "7V:1s", "--set", "convection_coefficient=-80"], "outside of the bounds"),
        (["--step", "7V:1s", "--set", "convection_coefficient=80 kg"], "convection_coefficient: got unit 'kg'"),
        (["--input", "voltage=5V"], "how long the run is"),
        (["--input", "current=5A", "--seconds", "1"], "no input 'current'"),
        (["flexinol", "--step", "7V:1s"], "No wire preset"),
        (["--controller", "pdi", "--set-point", "1deg:1s"], "did you mean 'pid'"),
        (["--controller", "pid"], "needs --set-point"),
        (["flexinol_isobaric", "coupon", "none", "--gif"], "moves nothing"),
        (["flexinol_table_3_2", "coupon", "voltage", "--step", "7V:1s"], "takes the drive `none`"),
        (["--input", "voltage=nowhere.csv:U"], "no such file"),
    ],
)
def test_mistakes_are_errors_and_leave_no_folder(words: list[str], told: str, tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    ended = run.invoke(app, ["simulate", *words, "--out", str(out)])
    said = " ".join((ended.output + str(ended.exception)).replace("│", " ").split())
    assert ended.exit_code == 2
    assert told in said
    assert not out.parent.exists()


def test_an_effect_comes_with_its_parameter() -> None:
    system = compose(*HANGING, values={"latent_heat.enthalpy": "20 J/g", "ambient_temperature": "300 K"}, law="liang")
    values = parameter_values(system)
    assert values["latent_heat.enthalpy"] == pytest.approx(20e3)
    assert values["ambient_temperature"] == pytest.approx(26.85)
    assert type(system.wire.kinetics.conditions).__name__ == "Liang"


def test_levels_hold_until_the_next(tmp_path: Path) -> None:
    one = levels("6V:1s,200mV:500ms", "V")
    clock = clock_of([one], None, 0.25)
    np.testing.assert_allclose(one.on(clock, 0.25), [6, 6, 6, 6, 0.2, 0.2, 0.2])
    (tmp_path / "log.csv").write_text("Time (ms);U [mV]\n0;1000\n500;2000\n1000;2000\n")
    held = given(f"{tmp_path / 'log.csv'}:U [mV]", "V")
    np.testing.assert_allclose(held.on(clock_of([held], None, 0.25), 0.25), [1, 1, 2, 2, 2])
    clock = clock_of([held], None, 0.25)
    np.testing.assert_allclose(held.on(clock, 0.25, sampled=True)[1], 1.5, atol=0.2)  # a file's samples: lines between
    np.testing.assert_allclose(one.on(clock, 0.25, sampled=True), [6, 6, 6, 6, 0.2])  # levels: none
    with pytest.raises(UnitError, match="above zero"):
        levels("6V:0s", "V")


@pytest.mark.slow  # the help is held to the unit in `test_options`
def test_a_quantity_without_a_unit_has_that_of_its_option(tmp_path: Path) -> None:
    """The same run in both ways, of every option that takes one."""

    def asked(name: str, *words: str) -> tuple[dict[str, list[float]], str]:
        told = run.invoke(app, ["simulate", *words, "--json", "--out", str(tmp_path / name)])
        assert told.exit_code == 0, told.output
        record = json.loads(told.stdout)
        return record["series"], record["provenance"].get("between", "")

    loop = ["--controller", "pid", "--set-point"]
    said = ["10deg:500 ms,0.5rad:1s", "--dt", "10 ms", "--period", "20ms", "--noise", "0.05rad", "--seconds", "1.2 s"]
    alone = [
        "10:0.5,28.64788975654116:1",
        "--dt",
        "0.01",
        "--period",
        "0.02",
        "--noise",
        "2.8647889756541160",
        "--seconds",
        "1.2",
    ]
    first, second = asked("said", *loop, *said), asked("alone", *loop, *alone)
    assert len(first[0]["time"]) == 121
    assert "called every 20 ms" in first[1]
    assert "with 2.86479° of noise" in first[1]
    assert first[1] == second[1]
    np.testing.assert_allclose(first[0]["position"], second[0]["position"], rtol=1e-6)
    held = asked("held", "--input", "voltage=5:1,0V:500ms", "--input", "ambient_temperature=25", "--dt", "0.1")[0]
    np.testing.assert_allclose(held["voltage"], [5.0] * 10 + [0.0] * 6, atol=1e-12)
    assert set(held["ambient_temperature"]) == {25.0}


def test_a_coupon_is_given_its_temperature_and_stress(tmp_path: Path) -> None:
    words = [
        "simulate",
        "flexinol_isobaric",
        "coupon",
        "none",
        "--dt",
        "100ms",
        "--json",
        "--out",
        str(tmp_path / "out"),
    ]
    inputs = ["--input", "temperature=30degC:1s,99degC:1s", "--input", "stress=100MPa"]
    told = run.invoke(app, [*words, *inputs])
    assert told.exit_code == 0, told.output
    record = json.loads(told.stdout)
    assert record["series"]["temperature"][9:11] == [30.0, 99.0]
    assert record["series"]["stress"] == [100e6] * 21
    assert record["series"]["martensite_fraction"][-1] == pytest.approx(0.0, abs=1e-6)
    assert record["series"]["reading"][0] - record["series"]["reading"][-1] == pytest.approx(0.04, abs=5e-3)


@pytest.mark.usefixtures("drawn")
@pytest.mark.parametrize(
    ("load", "values", "beside"),
    [
        ("coupon", {}, []),
        pytest.param("strain_coupon", {}, [], marks=pytest.mark.slow),
        # What is read is not the strain.
        pytest.param("coupon", {"sensor_gain.error": "0.1"}, ["reading"], marks=pytest.mark.slow),
    ],
)
def test_a_coupon_has_no_position_on_its_page_and_each_number_once(
    load: str, values: dict[str, str], beside: list[str], tmp_path: Path
) -> None:
    inputs = {
        "temperature": "30degC:1s,99degC:1s",
        **({"stress": "100MPa"} if load == "coupon" else {"strain": "0.01"}),
    }
    ran = run_open(RunRequest("flexinol_isobaric", load, "none", values=values, dt=0.1, inputs=inputs))
    rows = [row[0] for row in summary_rows(ran.data)]
    assert sorted(rows) == sorted(
        ["temperature", "stress", "strain", "martensite fraction", "detwinned fraction", "force", "resistance", *beside]
    )
    # No data is lost.
    assert {"position [1]", "velocity [1/s]", "reading [" + ("1]" if load == "coupon" else "Pa]")} <= set(
        as_csv(ran.data).splitlines()[0].split(",")
    )
    svg = write_run(ran, tmp_path, "A coupon", "").with_suffix(".svg").read_text(encoding="utf-8")
    assert svg.count("<!-- strain (%) -->") == 2
    assert "<!-- position" not in svg


@pytest.mark.parametrize(("values", "beside"), [({}, set()), ({"sensor_gain.error": "0.1"}, {"reading"})])
def test_a_moving_load_has_its_position_on_its_page_and_a_reading_that_differs(
    values: dict[str, str], beside: set[str]
) -> None:
    found = run_open(RunRequest(dt=0.01, values=values, inputs={"voltage": "5V:1s"})).data
    rows = {row[0] for row in summary_rows(found)}
    assert {"position", "velocity", "strain"} <= rows
    assert {"reading"} & rows == beside


def test_a_stop_and_a_slack_wire_are_reported() -> None:
    told = " ".join(conclusions(run_open(RunRequest(dt=0.01, inputs={"voltage": "9V:5s,0V:5s"}))))
    assert "It runs into its upper stop, first 1.8" in told
    assert "The wire goes slack, first 1.8" in told
    told = " ".join(conclusions(run_open(RunRequest(dt=0.01, inputs={"voltage": "5V:5s"}))))
    assert "stop" not in told
    assert "slack" not in told
