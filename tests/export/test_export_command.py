"""`smajax export` from files to files: whole or not at all, and errors that say which part and why."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.control.gains_file import Gains, write_gains
from smajax.control.loop_around import loop_around
from smajax.control.loop_settings import LoopSettings
from smajax.data.model_file.of_presets import model_of_presets
from smajax.export import fmu as units
from smajax.export.errors import ExportError
from smajax.export.fmu import platform_of
from smajax.export.from_files import controller_source, plant_source
from smajax.export.write import write_c
from smajax.model.extended import extended
from smajax.model.rigs import arm
from tests.helpers.c_programs import needs_gcc


def run(*words: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["export", *map(str, words)])
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.stdout, done.stderr


def gains_file(folder: Path, controller: str = "pid", **values: float) -> Path:
    gains = Gains(controller, values)
    return write_gains(folder / "gains.json", gains, gains.units(arm()), {})


@needs_gcc
def test_a_model_file_becomes_a_unit(tmp_path, monkeypatch):
    monkeypatch.setattr(units, "FLAGS", tuple("-O0" if one == "-O2" else one for one in units.FLAGS))
    model = model_of_presets("flexinol_table_3_2", "coupon", "none").save(tmp_path / "model.toml")
    out = tmp_path / "units" / "actuator.fmu"
    code, printed, _ = run(model, "--to", "fmu", "--fmi", "3.0", "--out", out, "--json")
    assert code == 0
    told = json.loads(printed)
    assert told["inputs"] == ["stress", "temperature"]
    assert told["files"] == [str(out)]
    with zipfile.ZipFile(out) as archive:
        folder, end = platform_of("3.0")
        assert {"modelDescription.xml", f"binaries/{folder}/actuator{end}", "sources/buildDescription.xml"} <= set(
            archive.namelist()
        )
    with pytest.raises(ExportError, match="is there already: give another --out, or --overwrite"):
        run(model, "--to", "fmu", "--out", out)


def test_presets_become_a_unit_before_anything_is_measured(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    parts = ["--wire", "flexinol_table_3_2", "--load", "dead_weight", "--drive", "voltage"]
    code, printed, _ = run("--to", "fmu", *parts, "--set", "load_mass=120 g", "--source-only", "--json")
    assert code == 0
    told = json.loads(printed)
    assert told["title"] == "Model of an actuator: flexinol_table_3_2, dead_weight, voltage"
    assert told["files"] == ["flexinol_table_3_2_dead_weight.fmu"]
    assert "voltage" in told["inputs"]
    # As that of a model file of the same presets and values.
    model = model_of_presets(*parts[1::2]).save(tmp_path / "model.toml")
    other = Path("other") / told["files"][0]
    assert run(model, "--to", "fmu", "--set", "load_mass=120 g", "--source-only", "--out", other)[0] == 0
    own, of_file = (
        zipfile.ZipFile(one).read("sources/flexinol_table_3_2_dead_weight.c") for one in (other.name, other)
    )
    assert own == of_file
    for words, said in (
        ([], "or the presets of --wire, --load and --drive"),
        (["--model", "model.toml"], "give it as FILE, `smajax export model.toml`"),
        ([*parts, "--period", "10ms"], "--estimator, --period and --delay are for gains.json"),
    ):
        code, _, told = run("--to", "fmu", *words, "--out", "third.fmu")
        assert code == 2
        assert said in " ".join(told.replace("│", " ").split())


def test_gains_become_a_header_and_a_source(tmp_path):
    gains = gains_file(tmp_path, proportional_gain=7.5)
    code, printed, _ = run(gains, "--to", "c", "--out", tmp_path / "bench", "--period", "5ms")
    assert code == 0
    header = next((tmp_path / "bench").glob("*.h")).read_text()
    assert "proportional_gain; /* V/rad, 0 to 1e+06, start 7.5: K_p */" in header
    assert "_PERIOD 0.005 /* s" in header
    assert "inputs: reading [rad], set_point [rad], set_point_rate [rad/s]" in printed
    assert sorted(one.suffix for one in (tmp_path / "bench").iterdir()) == [".c", ".h"]


def test_the_arithmetic_of_a_single_build_is_said_with_what_was_measured(tmp_path):
    gains = gains_file(tmp_path)
    for words, macro, said in (
        (
            (),
            0,
            "inputs and outputs single, arithmetic double. With single-precision arithmetic commands were within 1e-05",
        ),
        (
            ("--arithmetic", "single"),
            1,
            "all of it single. With single-precision arithmetic commands were within 1e-05",
        ),
    ):
        code, printed, _ = run(gains, "--to", "c", "--out", tmp_path / f"bench{macro}", *words)
        assert code == 0
        header = next((tmp_path / f"bench{macro}").glob("*.h")).read_text()
        assert f"_SINGLE_ARITHMETIC {macro}\n" in header
        assert "30,000 closed loops with a period of 10 ms" in " ".join(header.replace("\n *", " ").split())
        assert f"with -DSMAJAX_SINGLE=1: {said}" in printed


def test_what_cannot_be_exported_is_named_and_nothing_is_written(tmp_path):
    gains, out = gains_file(tmp_path, "sld"), tmp_path / "bench"
    with pytest.raises(
        ExportError, match=r"controller `sld` cannot be exported without an estimator: it reads the vel"
    ):
        run(gains, "--to", "c", "--out", out)
    assert not out.exists()
    late = extended(arm(), ["input_delay"])
    with pytest.raises(ExportError, match=r"the effect input_delay cannot be exported: it needs the whole series"):
        plant_source(late)
    with pytest.raises(ExportError, match="the tolerance of a step is 1; expected 1e-9 to 1e-2"):
        plant_source(arm(), tolerance=1.0)


def test_a_write_that_fails_leaves_what_was_there(tmp_path, monkeypatch):
    source = controller_source(arm(), gains_file(tmp_path))
    write_c(source, tmp_path / "bench")
    before = {path.name: path.read_text() for path in (tmp_path / "bench").iterdir()}

    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_c(source, tmp_path / "bench", overwrite=True)
    assert {path.name: path.read_text() for path in (tmp_path / "bench").iterdir()} == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--to", "matlab"], "`c` or `fmu`, not `matlab`"),
        (["--to", "fmu", "--fmi", "1.0"], "`2.0` or `3.0`, not `1.0`"),
        (["--to", "c", "--estimator", "perfect"], "no filter 'perfect'"),
        (["--to", "c", "--arithmetic", "half"], "`single` or `double`, not `half`"),
        (["--to", "fmu", "--arithmetic", "single"], "an FMU computes in double precision"),
    ],
)
def test_options_that_make_no_sense_are_refused(tmp_path, words, said):
    code, _, told = run(gains_file(tmp_path), *words, "--out", tmp_path / "out")
    assert code == 2
    assert said in " ".join(told.replace("│", " ").split())
    assert not (tmp_path / "out").exists()


def test_period_delay_and_filter_are_those_that_the_gains_were_tuned_with(tmp_path):
    tuned = Gains("pid", {}, loop=LoopSettings(period=0.02, delay=1, estimator="printed", position_unit="rad"))
    file = write_gains(tmp_path / "tuned.json", tuned, tuned.units(arm()), {})
    source = controller_source(arm(), file)
    assert source.block.period == 0.02
    assert "behind the estimator PrintedFilter" in source.block.title
    assert "queue[1]" in source.header
    alone = controller_source(arm(), file, estimator="", delay=0, period=0.005)
    assert alone.block.period == 0.005
    assert "queue" not in alone.header
    with pytest.raises(ExportError, match="the period is 0 s and the delay 1 periods; expected more than 0 s"):
        controller_source(arm(), file, period=0.0)


def test_the_filter_expects_the_noise_that_the_gains_were_tuned_with(tmp_path):
    def of_noise(noise):
        tuned = Gains("pid", {}, loop=LoopSettings(estimator="model", noise=noise, position_unit="rad"))
        file = write_gains(tmp_path / "tuned.json", tuned, tuned.units(arm()), {})
        return controller_source(arm(), file).source

    assert of_noise(None) == of_noise(0.0)
    assert of_noise(0.01) != of_noise(0.0)


def test_the_loop_is_the_one_that_other_commands_run(tmp_path):
    source = controller_source(arm(), gains_file(tmp_path, proportional_gain=7.5))
    loop = loop_around(arm(), "pid", {"proportional_gain": 7.5})
    starts = {one.name: one.start for one in source.parameters}
    assert starts["proportional_gain"] == 7.5
    assert starts["integral_gain"] == float(loop.controller.integral_gain)
