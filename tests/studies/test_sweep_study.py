"""The stored sweeps: their tables are of their numbers, their pictures draw them, and the code gives them again."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from PIL import Image

from smajax.control.least_time import distance, least_reach_times
from smajax.control.presets import CONTROLLERS, OF_THE_SOURCE
from smajax.control.signal_path import interface_of
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.run_sweep import sweep_controllers
from smajax.model.rigs import arm
from smajax.report.sweep_numbers import IN_PICTURE, comparison_digest, digest_of, map_numbers, merit_values
from studies.requirement.run import COMPARED
from studies.sweep.run import SWEEPS, settings_of
from studies.sweep.table import HERE, MARK, OTHERS, OTHERS_MARK, others_table, record_of, table

RECORDS = {folder: record_of(folder) for folder in SWEEPS}
RECORD = RECORDS["."]


def _infinite(values: list[float | None]) -> np.ndarray:
    return np.asarray([np.inf if value is None else value for value in values])


def test_the_tables_are_of_the_stored_numbers() -> None:
    page = (HERE / "README.md").read_text(encoding="utf-8")
    assert page.split(MARK)[1].strip() == table(RECORD)
    assert page.split(OTHERS_MARK)[1].strip() == others_table({folder: RECORDS[folder] for folder in OTHERS})
    assert all(set(one["sweep"]["maps"]) == set(COMPARED) for one in RECORDS.values())
    assert set(CONTROLLERS) >= set(RECORD["least_times"]) == set(COMPARED) > set(OF_THE_SOURCE)


def test_what_the_page_says_of_the_controllers_is_what_is_stored() -> None:
    found = {
        folder: {name: one["all_controllers"] for name, one in record["sweep"]["settling_over_least_time"].items()}
        for folder, record in RECORDS.items()
    }
    first = sorted(found["."], key=lambda name: -found["."][name]["settled"])[:3]
    assert first == ["receding_horizon", "backstepping1_integral", "pid"]
    assert [found["."][name]["settled"] for name in first] == [1919, 1908, 1894]
    assert {one["unreachable"] for one in found["."].values()} == {105}
    assert min(found["."], key=lambda name: found["."][name]["median"]) == "backstepping1_integral"
    never = {name: one["never"] for name, one in found["near"].items()}
    assert (list(never.values()).count(0), never["sld"], sorted(never.values())[7] > 2) == (6, 2, True)
    settled = {name for name, one in found["inertia"].items() if one["never"] == 0}
    assert settled == {"pid", "vsc3", "feedforward_pi"}
    horizon = RECORDS["inertia"]["sweep"]["maps"]["receding_horizon"]
    assert found["inertia"]["receding_horizon"]["never"] == 11
    assert {row.index(None) for row in horizon["settling_time"]["worst"] if None in row} == {14}  # +20 K


@pytest.mark.parametrize("folder", SWEEPS)
def test_the_loops_are_on_the_filter_with_noise_steps_and_delay_at_the_ratios_that_are_said(folder: str) -> None:
    record, settings = RECORDS[folder], settings_of(folder)
    assert record["between"] == settings.between
    assert "1 period late and are told their states from the filter `adaptive`" in record["between"]
    assert "0.1° of noise in steps of 0.1°" in record["between"]
    np.testing.assert_allclose(record["sweep"]["ratios"], settings.grid.ratios, rtol=1e-12)
    assert record["sweep"]["mismatches"] == [settings.first, settings.second]
    assert RECORDS["near"]["sweep"]["ratios"][::14] == pytest.approx([0.9, 1.1])
    assert RECORDS["inertia"]["sweep"]["mismatches"] == ["inertia", "ambient"]


@pytest.mark.parametrize("folder", SWEEPS)
def test_each_picture_draws_the_numbers_of_the_record(folder: str) -> None:
    """The digest in the file is that of the record, and that one is of the record's own numbers."""
    digests: dict[str, str] = RECORDS[folder]["pictures"]
    there = {path.name for path in (HERE / folder).glob("*.png")}
    expected = set(digests) if folder == "." else {f"{name}_maps.png" for name in COMPARED}
    assert there == expected
    for name in there:
        with Image.open(HERE / folder / name) as picture:
            assert picture.info[IN_PICTURE] == digests[name], (
                f"{folder}/{name} is not of this record: run studies.sweep.run"
            )
    assert digests["comparison.png"] == comparison_digest(RECORDS[folder])
    for name, numbers in RECORDS[folder]["sweep"]["maps"].items():
        assert digests[f"{name}_maps.png"] == digest_of(numbers)
        for summaries in numbers.values():
            median, worst = (np.asarray(summaries[how], dtype=float) for how in ("median", "worst"))
            assert median.shape == worst.shape == (15, 15)
            both = np.isfinite(median) & np.isfinite(worst)
            assert (worst[both] >= median[both]).all()


@pytest.mark.parametrize("name", sorted(RECORD["least_times"]))
def test_the_distances_are_of_the_settling_times_and_the_least_times(name: str) -> None:
    settling = _infinite(RECORD["controllers"][name]["settling_time"])
    drive, own = (RECORD["least_times"][name][of] for of in ("all_controllers", "controller"))
    for least in (drive, own):
        stored = [np.nan if one is None else one for one in least["settling_over_least_time"].values()]
        np.testing.assert_allclose(stored, list(distance(settling, _infinite(least["seconds"]))), rtol=1e-9)
    assert (_infinite(own["seconds"]) >= _infinite(drive["seconds"]) - 1e-9).all()
    perturbed = RECORD["sweep"]["settling_over_least_time"][name]
    for one in perturbed.values():
        assert one["settled"] + one["never"] + one["unreachable"] == 15 * 15 * len(settling)
        assert one["median"] is None or one["median"] >= 1.0
    assert perturbed["controller"]["unreachable"] >= perturbed["all_controllers"]["unreachable"] > 0


def test_stored_least_times_are_those_of_the_largest_commands() -> None:
    """To the steps of both: stored samples are 10 ms apart, these 5 ms."""
    targets, stored = np.asarray(RECORD["set_points_rad"]), RECORD["least_times"]["sld"]
    for least in stored.values():
        again = least_reach_times(arm(), targets, least["largest_command"])
        np.testing.assert_allclose(_infinite(least["seconds"]), again, atol=0.0151)
    assert stored["all_controllers"]["largest_command"] > stored["controller"]["largest_command"]


def test_the_code_gives_the_first_cell_of_a_map_again() -> None:
    """Nine of the loops, with their noise, at the least ratio of both mismatches."""
    settings, record = settings_of("near"), RECORDS["near"]
    assert record["integration_error"]["sld"]["how"] == "one step a sample"
    (gains,) = (one for one in settings.tuned if one.controller == "sld")
    between = settings.estimator, settings.noise, settings.period, settings.dt, settings.delay, settings.quantum
    setup = LoopSetup(
        arm(),
        gains.put(arm()),
        CONTROLLERS["sld"].main_gain,
        settings.seconds,
        settings.dt,
        interface_of(arm(), *between),
    )
    merits = closed_loops(setup, settings.grid.rows()[: len(settings.set_points)]).merits
    for name, summaries in record["sweep"]["maps"]["sld"].items():
        values = merit_values(merits, name)
        assert np.median(values) == pytest.approx(summaries["median"][0][0], rel=1e-3), name
        assert values.max() == pytest.approx(summaries["worst"][0][0], rel=1e-3), name


@pytest.mark.slow
def test_the_code_gives_the_maps_of_a_controller_again() -> None:
    settings = dataclasses.replace(settings_of("near"), controllers=("sld",))
    settings = dataclasses.replace(settings, tuned=tuple(one for one in settings.tuned if one.controller == "sld"))
    (swept,) = sweep_controllers(arm(), settings)
    for name, summaries in map_numbers(settings.grid, swept).items():
        for how, values in summaries.items():
            stored = np.asarray(RECORDS["near"]["sweep"]["maps"]["sld"][name][how], dtype=float)
            np.testing.assert_allclose(np.asarray(values, dtype=float), stored, rtol=2e-3, err_msg=f"{name}, {how}")
