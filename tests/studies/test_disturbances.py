"""Set points up and down, disturbances and payload changes: what is stored is what the code gives, and what the page says of it holds."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from smajax.control.presets import CONTROLLERS, OF_THE_SOURCE
from smajax.core.parameters import get_parameters
from smajax.model.rigs import arm
from smajax.report.sweep_numbers import IN_PICTURE
from studies.disturbances.loops import events_of, plants, positions
from studies.disturbances.run import COLUMNS, DRAWN_EVERY, FIGURES, HERE, draw, judged, table
from studies.disturbances.scenarios import COLDER, EVENTS, HELD, STEP, Scenario, scenarios
from studies.requirement.run import COMPARED

RESULTS: dict[str, Any] = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
PAGE = (HERE / "README.md").read_text(encoding="utf-8")
EVERY = scenarios()
DISTURBED = [name for name in EVERY if name != "set_points"]
# Back after every event, as the page says.
HOLDING = ("backstepping1_integral", "feedforward_pi", "nvsc", "receding_horizon", "vsc3")


def test_the_tables_and_pictures_are_of_the_stored_numbers() -> None:
    assert list(RESULTS["controllers"]) == list(COMPARED)
    assert set(OF_THE_SOURCE) < set(COMPARED) <= set(CONTROLLERS)
    np.testing.assert_allclose(RESULTS["plants"], plants())
    for name in EVERY:
        assert PAGE.split(f"<!-- {name} -->")[1].strip() == table(RESULTS, name)
        with Image.open(HERE / f"{name}.png") as picture:
            assert picture.info[IN_PICTURE] == RESULTS["pictures"][f"{name}.png"]


def test_what_the_page_says_of_the_controllers_is_what_is_stored() -> None:
    found = RESULTS["controllers"]
    back = {name for name, of in found.items() if all(of[one]["recovered"] == of[one]["events"] for one in EVERY)}
    assert back == set(HOLDING)
    assert sum(found["pid"][one]["events"] for one in EVERY) == 153
    for name in HOLDING:
        assert max(found[name][one]["steady_error_deg"]["worst"] for one in EVERY) < 0.75
        assert 1.4 < found[name]["load_torque"]["peak_deg"]["median"] < 2.3
    for name in ("vsc1", "vsc2", "backstepping1", "backstepping2"):
        assert all(of["recovered"] < 0.25 * of["events"] for of in (found[name][one] for one in EVERY))
    assert found["pid"]["set_points"]["recovered"] < 72 == found["feedforward_pi"]["set_points"]["recovered"]
    worst = {name: max(found[name][one]["peak_deg"]["worst"] for one in DISTURBED) for name in HOLDING}
    assert min(worst, key=lambda name: worst[name]) in ("feedforward_pi", "vsc3")
    back_after = {name: max(found[name][one]["recovery_s"]["worst"] for one in EVERY) for name in HOLDING}
    colder = found["receding_horizon"]["draught"]["recovery_s"]["worst"]
    assert back_after.pop("receding_horizon") == colder == pytest.approx(8.0, abs=0.05)
    others = [name for name in EVERY if name != "draught"]
    assert max(found["receding_horizon"][name]["recovery_s"]["worst"] for name in others) < 1.95
    assert 3.65 < min(back_after.values()) < max(back_after.values()) < 4.85


def test_how_far_a_loop_moves_depends_on_its_noise() -> None:
    """Forty loops of the nominal plant, each with a noise of its own: as the air is that of the room again, and as it is colder."""
    alike = np.repeat(plants(corners=False), 40, axis=0)

    def peaks(name: str, event: int) -> list[float]:
        return [events_of(EVERY["draught"], one)[event].peak for one in positions(name, [EVERY["draught"]], alike)[0]]

    back = peaks("feedforward_pi", 1)
    assert np.median(back) == pytest.approx(2.2, abs=0.05)
    assert max(back) == pytest.approx(2.9, abs=0.05)
    assert np.sum(np.asarray(peaks("receding_horizon", 0)) > 1.0) == 3


@pytest.mark.parametrize("count", [10, 11, 12])
def test_the_lowest_panel_of_each_column_has_the_times_below_it(count: int) -> None:
    """Also where the last row is not full."""
    angles = {name: np.zeros((1, len(EVERY["payload"].wanted)))[:, ::DRAWN_EVERY] for name in COMPARED[:count]}
    figure = Figure(figsize=(11.0, 10.0))
    draw(figure, EVERY["payload"], angles)
    FigureCanvasAgg(figure).draw()
    for number, axes in enumerate(figure.axes[:count]):
        lowest = number >= count - COLUMNS
        assert axes.get_xlabel() == ("time (s)" if lowest else "")
        assert any(label.get_visible() and label.get_text() for label in axes.get_xticklabels()) == lowest


def test_the_nominal_loops_of_a_controller_are_as_stored() -> None:
    """With their noise."""
    angles = positions("feedforward_pi", list(EVERY.values()), plants(corners=False))
    for (name, scenario), each in zip(EVERY.items(), angles, strict=True):
        found, stored = judged(scenario, each)["nominal"], RESULTS["controllers"]["feedforward_pi"][name]["nominal"]
        assert len(found) == len(stored) == len(scenario.events)
        for one, before in zip(found, stored, strict=True):
            for figure in FIGURES:
                assert one[figure] == pytest.approx(before[figure], rel=0.02, abs=0.02), (name, figure)


def test_the_disturbances_are_those_that_are_named() -> None:
    payload, convection, air = map(
        float, get_parameters(arm(), ["payload_mass", "convection_coefficient", "ambient_temperature"])
    )
    at = [round(time / STEP) + 1 for time in (0.0, *EVENTS)]
    mass, cold = EVERY["payload"].disturbance["added_mass"][at], EVERY["draught"].disturbance["ambient_temperature"][at]
    np.testing.assert_allclose(mass / payload, [0.0, 0.2, 0.0, -0.2], atol=1e-12)
    np.testing.assert_allclose(cold - air, [0.0, -COLDER, 0.0, COLDER], atol=1e-12)
    # As a draught: the loss of a wire at 87 C with 1.3 times the convection.
    assert convection * (87.0 - (air - COLDER)) == pytest.approx(1.3 * convection * (87.0 - air), rel=2e-3)
    torque = EVERY["load_torque"].disturbance["load_torque"][at]
    np.testing.assert_allclose(torque / torque[1], [0.0, 1.0, 0.0, -1.0], atol=1e-12)
    assert torque[1] == pytest.approx(6.19e-3, rel=1e-2)  # N m, against the angle


def test_an_event_is_measured_by_peak_return_and_rest() -> None:
    time = STEP * np.arange(4801)
    wanted = np.full(time.shape, HELD)
    none: dict[str, np.ndarray] = {}
    held = Scenario("held", "N m", wanted, none, (4.0, 14.0), 1.0)
    angle = HELD + np.where(time >= 4.0, 5.0 * np.exp(-(time - 4.0)), 0.0)
    first, second = events_of(held, angle)
    assert (first.peak, first.recovery) == pytest.approx((5.0, np.log(5.0)), abs=0.01)
    assert (second.recovery, second.steady) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert events_of(held, angle + 2.0)[1].recovery == np.inf
    steps = Scenario("up", "", np.where(time < 10.0, HELD, HELD + 30.0), none, (0.0, 10.0), 0.0)
    assert events_of(steps, np.where(time < 11.0, HELD, HELD + 32.0))[1].peak == pytest.approx(2.0)
