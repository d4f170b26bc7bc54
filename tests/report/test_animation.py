"""A run as a moving picture: drawn, moving, and true to the phase diagram."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from smajax.core.progress import Event, Stage
from smajax.model.presets import build
from smajax.model.types import Trajectory
from smajax.model.wire.kinetics import heating_temperature
from smajax.report.animation import _arm, _slider, animate, animate_run, moving, ranges
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.own_load import Crank

ARM = build("niti_table_3_1", "arm", "amplified_voltage")
PULSE = {"voltage": jnp.where(jnp.arange(801) < 400, 8.0, 0.0)}  # V, 10 ms apart


@pytest.fixture(scope="module")
def up_and_down() -> Trajectory:
    return simulate_compiled(ARM, PULSE, 0.01)


def frames(path: Path) -> list[np.ndarray]:
    """The pictures of a GIF, (height, width, 3) each."""
    with Image.open(path) as file:
        found = []
        for number in range(getattr(file, "n_frames", 1)):
            file.seek(number)
            found.append(np.asarray(file.convert("RGB"), dtype=float))
    return found


def test_an_arm_moves_beside_its_phase_diagram(up_and_down: Trajectory, tmp_path: Path) -> None:
    path = animate(ARM, up_and_down, tmp_path / "arm.gif", frames=12)
    assert [file.name for file in tmp_path.iterdir()] == ["arm.gif"]
    pictures = frames(path)
    assert len(pictures) == 12
    half = pictures[0].shape[1] // 2
    for picture in pictures:
        assert picture[:, :half].std() > 5.0
        assert picture[:, half:].std() > 5.0
    # Up and down again: in the middle the arm is elsewhere, at the end nearly where it was.
    changed = [np.abs(picture[:, :half] - pictures[0][:, :half]).mean() for picture in pictures]
    assert max(changed) > 2.0 * changed[-1]
    # The path only grows.
    drawn = [float((picture[:, half:].sum(axis=2) < 200.0).sum()) for picture in pictures]
    assert drawn[-1] > 1.2 * drawn[0]


def test_an_upright_animation_is_narrow_and_reports_its_progress(up_and_down: Trajectory, tmp_path: Path) -> None:
    stages: list[Stage] = []

    def progress(event: Event) -> None:
        assert isinstance(event, Stage)
        stages.append(event)

    path = tmp_path / "upright.gif"
    path.write_bytes(moving(ARM, up_and_down, frames=5, upright=True, progress=progress))
    pictures = frames(path)
    height, width = pictures[0].shape[:2]
    assert width < 360
    assert height > 1.5 * width
    for half in (slice(None, height // 2), slice(height // 2, None)):
        assert pictures[0][half].std() > 5.0
        assert np.abs(pictures[2][half] - pictures[0][half]).mean() > 0.5
    assert {stage.name for stage in stages} == {"drawing the load moving, for telephones"}
    shares = [stage.share for stage in stages]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_the_animation_of_a_weight_is_drawn(tmp_path: Path) -> None:
    system = build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
    with pytest.warns(DeprecationWarning, match="animate_run"):
        path = animate_run(system, {"voltage": jnp.full(401, 5.5)}, tmp_path / "weight.gif", 0.02, frames=4)
    pictures = frames(path)
    assert len(pictures) == 4
    assert np.abs(pictures[-1] - pictures[0]).max() > 50.0


def test_any_load_that_turns_is_drawn_as_a_lever(tmp_path: Path) -> None:
    system = dataclasses.replace(build("flexinol_table_3_2", "dead_weight", "flexinol_voltage"), load=Crank())
    run = simulate_compiled(system, {"voltage": jnp.full(401, 5.5)}, 0.02)
    pictures = frames(animate(system, run, tmp_path / "crank.gif", frames=4))
    half = pictures[0].shape[1] // 2
    assert np.abs(pictures[-1][:, :half] - pictures[0][:, :half]).max() > 50.0
    axes = Figure().subplots()
    link, *_, words = _arm(axes, system, run)(400)
    angle = float(run.position[-1])
    np.testing.assert_allclose(link.get_xydata()[1], [np.cos(angle), np.sin(angle)], rtol=1e-6)
    assert f"{np.degrees(angle):.0f}°" in words.get_text()
    assert not [line for line in axes.lines if line.get_linestyle() == ":"], "it has no end stops"


def test_the_animation_of_a_blocked_wire_shows_its_force_and_not_the_micrometres_that_it_moves(tmp_path: Path) -> None:
    system = build("flexinol_table_3_2", "blocked_wire", "current")
    run = simulate_compiled(system, {"current": jnp.full(201, 0.42)}, 0.02)
    pictures = frames(animate(system, run, tmp_path / "held.gif", frames=4))
    axes = Figure().subplots()
    draw = _slider(axes, system, run)
    words = draw(200)[-1].get_text()
    assert axes.get_ylabel() == "force (N)"
    assert f"{float(run.reading[-1]):.1f} N" in words
    assert np.abs(pictures[-1] - pictures[0]).max() > 50.0


def test_the_drawn_transformation_ranges_are_those_of_the_kinetics() -> None:
    law = ARM.wire.kinetics
    stress = np.asarray([0.0, 75e6, 200e6])
    found = ranges(law, stress)
    for at, pulled in enumerate(jnp.asarray(stress)):
        assert heating_temperature(law, found["A_f'"][at], pulled) == pytest.approx(float(law.austenite_finish))
        assert found["M_s'"][at] == pytest.approx(float(law.martensite_start) + pulled / 10.3e6)


def test_a_load_that_cannot_be_animated_is_an_error(up_and_down: Trajectory, tmp_path: Path) -> None:
    coupon = build("niti_table_3_1", "coupon", "none")
    with pytest.raises(ValueError, match="Coupon moves nothing"):
        animate(coupon, up_and_down, tmp_path / "a.gif")
    with pytest.raises(ValueError, match=r"ends in .gif; got `a.mp4`"):
        animate(ARM, up_and_down, tmp_path / "a.mp4")
    with pytest.raises(ValueError, match="90 frames of 1 samples"):
        animate(ARM, jax.tree.map(lambda series: series[:1], up_and_down), tmp_path / "a.gif")
    assert list(tmp_path.iterdir()) == []
