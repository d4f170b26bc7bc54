"""A controller that a script defines and puts into the table: kept work of other code or values of it is not taken for its own."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import pytest

from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.preset import ANGLE, ControllerPreset
from smajax.control.measured_state import MeasuredState
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import Reference
from smajax.control.sweep.run_sweep import TRUE_STATE, SweepSettings, begun_sweep, sweep_controllers
from smajax.control.tune.settings import TuneSettings, settings_for
from smajax.control.tune.tuning_folder import check_folder, settings_record
from smajax.core.files import json_text
from smajax.core.parameters import get_parameters, parameter, set_parameters
from smajax.model.rigs import arm
from smajax.model.types import Scalar
from smajax.report.sweep_page import limit_sentences

SWEEP = SweepSettings(("own",), "payload", "supply", 2, (0.0, 30.0), (1.0,), seconds=3.0, tolerance=None, **TRUE_STATE)


class Proportional(AbstractController):
    """A holding voltage, and a share of the error."""

    gain: Scalar = parameter("V/rad", 0.0, 1e3, "gain")
    bias: Scalar = parameter("V", 0.0, 100.0, "holding voltage")
    most: Scalar = parameter("V", 0.0, 100.0, "limit", limits_command=True)

    def start(self, measured: MeasuredState, wanted: Reference) -> Scalar:
        return jnp.zeros_like(measured.position)

    def step(self, memory: Scalar, measured: MeasuredState, wanted: Reference, period: Scalar) -> tuple[Scalar, Any]:
        command = self.bias + self.gain * (wanted.position - measured.position)
        return memory, jnp.clip(command, 0.0, self.most)


class Weaker(Proportional):
    """The same by name and parameters, other code."""

    def step(self, memory: Scalar, measured: MeasuredState, wanted: Reference, period: Scalar) -> tuple[Scalar, Any]:
        memory, command = Proportional.step(self, memory, measured, wanted, period)
        return memory, 0.9 * command


Weaker.__qualname__ = Proportional.__qualname__


def preset(cls: type[Proportional] = Proportional, gain: float = 6.0) -> ControllerPreset:
    return ControllerPreset(
        lambda system: cls(gain=gain, bias=6.5, most=9.0), "gain", ANGLE, {"gain": (0.5, 100.0), "bias": (1.0, 9.0)}
    )


def test_a_sweep_in_a_folder_is_run_again_where_the_controllers_code_or_gains_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    computed: list[str] = []

    def counted(*_: Any, **__: Any) -> None:
        computed.append("again")
        raise InterruptedError

    monkeypatch.setitem(CONTROLLERS, "own", preset())
    (kept,) = sweep_controllers(arm(), SWEEP, tmp_path)
    monkeypatch.setattr("smajax.control.sweep.run_sweep._computed", counted)
    monkeypatch.setitem(CONTROLLERS, "own", preset())  # of the same code and values
    (again,) = sweep_controllers(arm(), SWEEP, tmp_path)
    assert computed == []
    assert (again.nominal.settling_time == kept.nominal.settling_time).all()
    for other in (preset(Weaker), preset(gain=7.0)):
        monkeypatch.setitem(CONTROLLERS, "own", other)
        with pytest.raises(InterruptedError):
            list(sweep_controllers(arm(), SWEEP, tmp_path))
    assert len(computed) == 2


class Silent(Proportional):
    """One that does not say its limit."""

    def largest_command(self) -> Scalar:
        return jnp.asarray(jnp.inf)


def test_a_controller_that_does_not_say_its_limit_leaves_the_least_times_of_the_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    both, drive = dataclasses.replace(SWEEP, controllers=("pid", "own")), float(arm().drive.largest_command())
    monkeypatch.setitem(CONTROLLERS, "own", preset(Silent))
    pid, silent = sweeps = tuple(sweep_controllers(arm(), both))
    assert (pid.least.limit, pid.own_least.limit) == (10.0, 10.0)
    assert silent.least.limit == silent.own_least.limit == pytest.approx(drive)
    assert drive > 500.0, "the rig does not show what is controlled here"
    (alone,) = sweep_controllers(arm(), dataclasses.replace(SWEEP, controllers=("pid",)))
    assert pid.nominal_distance(pid.least) == alone.nominal_distance(alone.least)
    (said,) = limit_sentences(dataclasses.replace(begun_sweep(arm(), both), sweeps=sweeps))
    assert said.startswith(
        f"own does not say its largest command: its least times are with the drive's limit of {drive:.4g} V"
    )
    monkeypatch.setitem(CONTROLLERS, "own", preset())
    pid, own = sweeps = tuple(sweep_controllers(arm(), both))
    assert (pid.least.limit, own.least.limit, own.own_least.limit) == (10.0, 10.0, 9.0)
    assert limit_sentences(dataclasses.replace(begun_sweep(arm(), both), sweeps=sweeps)) == ()


def test_a_parameter_that_limits_the_command_gets_the_limit_of_an_amplifier() -> None:
    gain = float(get_parameters(arm(), ["amplifier_gain"])[0])
    made = preset().make(set_parameters(arm(), {"amplifier_limit": 6.0 * gain}))
    assert float(made.most) == pytest.approx(6.0)


def test_a_tuning_in_a_folder_is_not_gone_on_with_where_the_controllers_code_or_gains_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = TuneSettings("own", (0.0, 30.0))

    def record() -> dict[str, Any]:
        return settings_record(arm(), settings)

    monkeypatch.setitem(CONTROLLERS, "own", preset())
    (tmp_path / "asked.json").write_text(json_text(record()), encoding="utf-8")
    monkeypatch.setitem(CONTROLLERS, "own", preset())
    check_folder(tmp_path, record())
    for other in (preset(Weaker), preset(gain=7.0)):
        monkeypatch.setitem(CONTROLLERS, "own", other)
        with pytest.raises(ValueError, match="other code or values of the controller"):
            check_folder(tmp_path, record())


def test_a_controller_where_a_name_is_expected_is_told_how_to_get_one() -> None:
    """It ended in `unhashable type`."""
    own: Any = Proportional(gain=1.0, bias=1.0, most=10.0)
    for begin in (
        lambda: settings_for(arm(), own),
        lambda: next(iter(sweep_controllers(arm(), dataclasses.replace(SWEEP, controllers=(own,))))),
    ):
        with pytest.raises(TypeError, match=r"expected the name of a controller, got a Proportional.*CONTROLLERS"):
            begin()
