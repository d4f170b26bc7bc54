"""Another package adds an effect and a load by entry points alone; what cannot be used is refused by name."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from smajax.core.plugins import EFFECTS, PluginError, brought
from smajax.model.effects.library import _OWN, _wrong

PACKAGE = """
from dataclasses import replace
from typing import ClassVar

from smajax import AbstractEffect, parameter
from smajax.model.effects.candidate import Candidate
from smajax.model.load.dead_weight import DeadWeight
from smajax.model.wire.heat import HeatTerm

WIND = Candidate(
    title="breeze",
    equation="heat",
    formula="P' = k (T - T_inf)",
    sentence="Moving air takes more heat away.",
    switches=("strength",),
    initial_guess={"strength": 0.1},
)


class Still(AbstractEffect, HeatTerm):
    candidate: ClassVar[Candidate] = WIND
    strength: object = parameter("W/(m K)", 0.0, 10.0, "k", default=0.0)


class Breeze(Still):
    effect_name: ClassVar[str] = "breeze"

    def heat_loss(self, wire, at):
        return self.strength * (at.temperature - at.ambient)


def bucket():
    return DeadWeight(load_mass=1.0, damping=20.0)


def heap():
    return 3.0


class Gale(Breeze):
    effect_name: ClassVar[str] = "gale"

    def heat_loss(self, wire, at):
        return self.strength * (at.temperature - at.ambient) + 1.0


class Misspelt(Still):
    effect_name: ClassVar[str] = "misspelt"

    def heat_los(self, wire, at):
        return self.strength * (at.temperature - at.ambient)


class Outside(AbstractEffect):
    effect_name: ClassVar[str] = "outside"
    candidate: ClassVar[Candidate] = WIND
    strength: object = parameter("W/(m K)", 0.0, 10.0, "k", default=0.0)


class Untitled(AbstractEffect, HeatTerm):
    effect_name: ClassVar[str] = "untitled"


class Switched(Breeze):
    effect_name: ClassVar[str] = "switched"
    candidate: ClassVar[Candidate] = replace(WIND, switches=("strenght",))


class Started(Breeze):
    effect_name: ClassVar[str] = "started"
    candidate: ClassVar[Candidate] = replace(WIND, initial_guess={"x": 0.1})


nothing = 3
"""
# As effects were written for version 0.1: one class with a method for every equation, and what the search needs in it.
OLD = """
from typing import ClassVar

from smajax import AbstractEffect, parameter


class Old(AbstractEffect):
    title: ClassVar[str] = "breeze"
    equation: ClassVar[str] = "heat"
    formula: ClassVar[str] = "P' = k (T - T_inf)"
    sentence: ClassVar[str] = "Moving air takes more heat away."
    switches: ClassVar[tuple[str, ...]] = ("strength",)
    starts: ClassVar[dict[str, float]] = {"strength": 0.1}
    effect_name: ClassVar[str] = "breeze"
    strength: object = parameter("W/(m K)", 0.0, 10.0, "k")

    @classmethod
    def base(cls):
        return cls(strength=0.0)

    @classmethod
    def places(cls, extent):
        return ({"strength": extent.seconds},)

    def heat_loss(self, wire, temperature, ambient):
        return self.strength * (temperature - ambient)


class Breeze(Old):
    def heat_loss(self, wire, temperature, ambient):
        return self.strength * (temperature - ambient)


def bucket():
    from smajax.model.load.dead_weight import DeadWeight

    return DeadWeight(load_mass=1.0, damping=20.0)
"""
LOOK = """
import json
from smajax.control.compose import compose
from smajax.simulation.compiled import simulate_compiled
import jax.numpy as jnp
from smajax.model.effects.library import LIBRARY
from smajax.core.plugins import versions
ends = []
for strength in ("0 W/m/K", "0.1 W/m/K"):
    system = compose("flexinol_table_3_2", "bucket", "voltage", values={"breeze.strength": strength})
    ends.append(float(simulate_compiled(system, {"voltage": jnp.full(101, 3.0)}, 0.01).temperature[-1]))
print(json.dumps([list(LIBRARY)[-1], float(system.load.load_mass), ends, versions()]))
"""


def _installed(folder: Path, points: str, package: str = PACKAGE) -> dict[str, str]:
    """A package as an installer leaves it, and the environment in which it is found."""
    (folder / "airflow.py").write_text(package)
    info = folder / "airflow-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: airflow\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(points)
    return _with(folder)


def _with(folder: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}


def _asked(code: str, environment: dict[str, str], cwd: Path) -> subprocess.CompletedProcess[str]:
    here = str(Path(__file__).parents[2])
    path = os.pathsep.join([here, environment["PYTHONPATH"]])
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**environment, "PYTHONPATH": path},
        check=False,
    )


@pytest.mark.parametrize(
    "package",
    [
        pytest.param(PACKAGE, id="of today"),
        pytest.param(OLD, id="of version 0.1", marks=pytest.mark.slow),  # in this process in `test_old_contract`
    ],
)
def test_an_effect_and_a_load_of_another_package(package: str, tmp_path: Path) -> None:
    """One of the form of version 0.1 does the same, with a warning that says what to inherit from."""
    points = "[smajax.effects]\nbreeze = airflow:Breeze\n[smajax.loads]\nbucket = airflow:bucket\n"
    environment = {**_installed(tmp_path, points, package), "PYTHONWARNINGS": "default"}
    told = _asked(LOOK, environment, tmp_path)
    assert told.returncode == 0, told.stderr
    warned = "airflow.Breeze is an effect of the old form, which goes in version 0.3: let it inherit from HeatTerm too"
    assert (warned in told.stderr) == (package == OLD), told.stderr
    last, mass, (still, moving), versions = json.loads(told.stdout)
    assert (last, mass) == ("breeze", 1.0)
    assert moving < still - 1.0
    assert versions == ["smajax.effects breeze airflow 1.2", "smajax.loads bucket airflow 1.2"]


@pytest.mark.parametrize(
    ("point", "told"),
    [
        ("latent_heat = airflow:Breeze", "of airflow 1.2 in the group 'smajax.effects' has a name that is taken"),
        ("draft = airflow:Breeze", "calls itself 'breeze'"),
        ("breeze = airflow:nothing", "expected a class of `smajax.AbstractEffect`"),
        ("breeze = airflow:missing", "cannot be loaded"),
        ("misspelt = airflow:Misspelt", "and overrides none of the methods stored_heat"),
        (
            "outside = airflow:Outside",
            "override a method: HeatTerm (stored_heat, heat_loss, ambient_shift); ResistanceTerm (",
        ),
        ("untitled = airflow:Untitled", "lacks candidate, which every effect says of itself"),
        ("switched = airflow:Switched", "has switches of what is none of its parameters: strenght; these are strength"),
        ("started = airflow:Started", "has an initial guess of what is none of its parameters: x; these are strength"),
    ],
)
def test_an_unusable_plug_in_is_refused_by_name(
    point: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _installed(tmp_path, f"[smajax.effects]\n{point}\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(PluginError, match=re.escape(told)):
        brought(EFFECTS, _OWN, _wrong)


@pytest.mark.parametrize(
    ("points", "told"),
    [
        pytest.param(
            "[smajax.effects]\ngale = airflow:Gale\n",
            ["the effect 'gale', which must change nothing at its base value"],
            id="not neutral",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "[smajax.effects]\ndraft = airflow:Breeze\n[smajax.loads]\nbucket = nowhere:bucket\n",
            ["calls itself 'breeze'", "'smajax.loads' cannot be loaded (ModuleNotFoundError"],
            id="misnamed, missing",
        ),
        pytest.param(
            "[smajax.effects]\nbreeze = nowhere:Breeze\n[smajax.loads]\nweight = airflow:DeadWeight\n",
            [
                "'smajax.effects' cannot be loaded (ModuleNotFoundError",
                "is the class DeadWeight, which cannot be called without",
            ],
            id="missing, a class",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "[smajax.loads]\nheap = airflow:heap\n",
            ["returns 3.0; expected a function without arguments"],
            id="no load",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_doctor_reports_faulty_plug_ins_and_nothing_else(points: str, told: list[str], tmp_path: Path) -> None:
    code = "import sys; sys.argv = ['smajax', 'doctor']; from smajax.cli.main import main; main()"
    ended = _asked(code, _installed(tmp_path, points), tmp_path)
    assert ended.returncode == 3, ended.stderr
    assert [text for text in told if text not in ended.stdout] == []
    assert "several times slower" not in ended.stdout
    assert f"{len(told)} remark{'s' * (len(told) > 1)}." in ended.stdout


@pytest.mark.slow
def test_the_loop_refuses_an_effect_that_is_not_neutral_and_says_by_how_much(tmp_path: Path) -> None:
    demo = Path(__file__).parents[2] / "smajax" / "data" / "demo" / "latent" / "experiment.toml"
    code = f"import sys; sys.argv = ['smajax', 'close-loop', {str(demo)!r}]; from smajax.cli.main import main; main()"
    ended = _asked(code, _installed(tmp_path, "[smajax.effects]\ngale = airflow:Gale\n"), tmp_path)
    assert ended.returncode == 2, ended.stderr
    assert re.search(r"changes the position by up to [0-9.]+ mm, the temperature by up to [0-9.]+ °C", ended.stderr)
    assert "Traceback" not in ended.stderr
    neutral = "from smajax.core.runtime import prepare; prepare(); from smajax.attribution.neutral_at_base import check_neutral; check_neutral()"
    (tmp_path / "airflow-1.2.dist-info" / "entry_points.txt").write_text("[smajax.effects]\nbreeze = airflow:Breeze\n")
    ended = _asked(neutral, _with(tmp_path), tmp_path)
    assert ended.returncode == 0, ended.stderr


@pytest.mark.slow  # an effect is, below
def test_a_load_that_is_no_preset_is_refused_without_a_traceback(tmp_path: Path) -> None:
    environment = _installed(tmp_path, "[smajax.loads]\nweight = airflow:DeadWeight\n")
    code = "import sys; sys.argv = ['smajax', 'simulate', 'flexinol_table_3_2', 'weight', 'voltage', '--step', '3V:1s']; from smajax.cli.main import main; main()"
    ended = _asked(code, environment, tmp_path)
    assert ended.returncode == 2, ended.stderr
    assert "cannot be called without arguments" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_the_command_line_reports_a_faulty_plug_in_without_a_traceback(tmp_path: Path) -> None:
    environment = _installed(tmp_path, "[smajax.effects]\nlatent_heat = airflow:Breeze\n")
    code = "import sys; sys.argv = ['smajax', 'effects']; from smajax.cli.main import main; main()"
    ended = _asked(code, environment, tmp_path)
    assert ended.returncode == 2, ended.stderr
    assert "a name that is taken: rename it there, or uninstall" in " ".join(ended.stderr.split())
    assert "Traceback" not in ended.stderr
