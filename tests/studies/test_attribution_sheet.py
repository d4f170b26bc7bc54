"""Values of the sheet: what the benchmark's experiment files say of them is what is true of the wires that made the runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from smajax.core.parameters import parameter_values
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.base_model import base_model
from studies.attribution_benchmark.cases import Case, true_wire
from studies.attribution_benchmark.effects import EFFECTS
from studies.attribution_benchmark.rigs import RIGS
from studies.attribution_benchmark.sheet import WIDTHS, drawn_about, on_the_sheet
from studies.attribution_benchmark.strength import NO_SUCH_WIRE, Ruler
from studies.attribution_benchmark.write import experiment_text


@pytest.mark.parametrize("name", sorted(RIGS))
def test_a_file_gives_every_value_of_the_sheet_and_its_width(name: str, tmp_path: Path) -> None:
    rig = RIGS[name]
    case = Case(name, (), 0.0, 100)
    text = experiment_text(rig, ())
    for run in rig.runs(rig.wire)[:1]:
        columns = "time_s,voltage_V,duty,temperature_degC,mass_g,stress_MPa,position_mm,angle_deg,strain_percent"
        rows = "\n".join(f"{k * rig.clock.step:g},1,0.5,30,600,100,0,0,0" for k in range(5))
        (tmp_path / f"{run.name}.csv").write_text(f"{columns}\n{rows}\n", encoding="utf-8")
        text += f'\n[[runs]]\nname = "{run.name}"\nrole = "fit"\nfile = "{run.name}.csv"\n'
    (tmp_path / "experiment.toml").write_text(text, encoding="utf-8")
    experiment = load_experiment(tmp_path / "experiment.toml", CATALOGUE)
    values, own = parameter_values(base_model(experiment)), on_the_sheet(rig)
    assert {one: spread.sigma for one, spread in experiment.priors.presets.items()} == own
    true = true_wire(case)
    for one, width in own.items():
        assert values[one] == pytest.approx(getattr(rig.wire, one)), one
        assert 0.0 < abs(np.log(getattr(true, one) / values[one])) < 4.0 * width, one
    # The wires of the first draw, which the package was developed on, have the values of the sheet.
    first = true_wire(replace(case, number=0))
    assert all(getattr(first, one) == getattr(rig.wire, one) for one in own)


def test_true_values_scatter_as_their_widths_say() -> None:
    rig = RIGS["dead_weight"]
    drawn = [drawn_about(rig, rig.wire, seed) for seed in range(400)]
    for name, width in WIDTHS.items():
        logs = np.log([getattr(one, name) / getattr(rig.wire, name) for one in drawn])
        assert logs.std() == pytest.approx(width, rel=0.15)
        assert abs(logs.mean()) < 0.2 * width


def test_a_strength_is_what_the_values_of_the_sheet_leave_too() -> None:
    """An expansion of the coupon is nearly another thermal modulus, within what the sheet leaves open."""
    rig = RIGS["coupon"]
    effects = {"thermal_expansion": 2e-6}
    held, known = (
        Ruler(rig, rig.wire, {name: factor * width for name, width in on_the_sheet(rig).items()}).strength(effects)
        for factor in (1e-6, 1.0)
    )
    assert held == pytest.approx(Ruler(rig, rig.wire).strength(effects), rel=1e-3)
    assert known < 0.3 * held


def test_what_other_values_of_the_wire_say_as_well_has_no_strength() -> None:
    """The coupon's slopes are unknowns; three steps without damping left 4.6 noises of this."""
    rig = RIGS["coupon"]
    ruler = Ruler(rig, rig.wire, on_the_sheet(rig))
    effects = {"different_slopes": 0.1}
    assert np.std(ruler.readings(rig.wire, effects) - ruler.null) > 10.0
    assert ruler.strength(effects) < 0.05


def test_an_effect_too_weak_by_nature_is_capped_with_the_strength_that_it_has() -> None:
    """An expansion is mostly another thermal modulus, however large it is."""
    rig = RIGS["coupon"]
    ruler = Ruler(rig, rig.wire, on_the_sheet(rig))
    found = ruler.find("thermal_expansion", 100.0)
    assert found.capped
    assert found.coefficient == pytest.approx(EFFECTS["thermal_expansion"].largest)
    assert 0.0 < found.strength < 50.0
    assert found.strength <= 1.01 * ruler.strength({"thermal_expansion": found.coefficient})


@pytest.mark.parametrize("name", ["residual_strain", "transformation_drift", "two_part_transformation"])
def test_a_strength_is_that_of_scipys_refit(name: str) -> None:
    """By least squares with derivatives taken anew at every step, from where the values are true."""
    rig = RIGS["coupon"]
    ruler = Ruler(rig, rig.wire, on_the_sheet(rig))
    found = ruler.find(name, 10.0)
    shown = ruler.readings(rig.wire, {name: found.coefficient})
    true = np.asarray([getattr(rig.wire, one) for one in ruler.names])
    sizes = np.where([one.endswith(("start", "finish")) for one in ruler.names], 1.0, 0.05 * true)

    def rests(moved: np.ndarray) -> np.ndarray:
        values = dict(zip(ruler.names, (true + moved * sizes).tolist(), strict=True))
        try:
            return ruler.rests(shown, replace(rig.wire, **values))
        except NO_SUCH_WIRE:
            return np.full(ruler.null.size + len(ruler.spread), 1e3)

    refit = least_squares(rests, np.zeros(len(true)), diff_step=1e-4, max_nfev=60)
    left = np.sqrt(np.mean(refit.fun[: ruler.null.size] ** 2))
    assert found.strength == pytest.approx(left, rel=0.1)
