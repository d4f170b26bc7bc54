"""A user's own simulator: with its three differences in the model, the package gives what it gives."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import set_parameters
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.simulation.compiled import simulate_compiled
from studies.own_simulator.run import BENCHES, NOISE, SAMPLE, closed, commands, true_coefficients
from studies.own_simulator.simulator import Bench, simulated

SAMPLES = 900
BEND = 1e-5  # m: of the friction's bristle, which the simulator's friction does not have


def _as_the_bench(bench: Bench) -> dict[str, float]:
    """Its values by the package's names; the simulator has neither damping nor a thermal modulus."""
    resistivity = bench.ohms_per_metre * bench.area
    return {
        "wire_length": bench.length,
        "wire_diameter": bench.diameter,
        "density": bench.density,
        "specific_heat": bench.specific_heat,
        "convection_coefficient": bench.convection,
        "ambient_temperature": bench.air,
        "resistivity_austenite": resistivity,
        "resistivity_martensite": resistivity,
        "austenite_start": bench.austenite[0],
        "austenite_finish": bench.austenite[1],
        "martensite_start": bench.martensite[0],
        "martensite_finish": bench.martensite[1],
        "stress_slope_austenite": bench.slopes[0],
        "stress_slope_martensite": bench.slopes[1],
        "young_modulus_austenite": bench.moduli[0],
        "young_modulus_martensite": bench.moduli[1],
        "recoverable_strain": bench.recoverable_strain,
        "thermal_modulus": 0.0,
        "slider_mass": 3e-4,
        "damping": 0.5,
        "spring_stiffness": bench.stiffness,
        "spring_preload": bench.preload,
    }


ALL = {"free_convection", "elastic_mismatch", "coulomb_friction"}


@pytest.mark.parametrize(
    ("bench", "name"),
    [("all-three", "steps"), ("all-three", "pulses"), ("all-three", "partial strokes"), ("nothing", "triangles")],
)
def test_the_package_with_the_true_effects_gives_what_the_simulator_gives(bench: str, name: str) -> None:
    """Two programs without a line in common, three equations of which are the effects' own."""
    current, truth = commands()[name][:SAMPLES], BENCHES[bench]
    theirs, coefficients = simulated(truth, current, SAMPLE), true_coefficients(bench)
    names = tuple(dict.fromkeys(one.split(".")[0] for one in coefficients))
    base = set_parameters(build("flexinol_ht_500um", "bias_spring", "current"), _as_the_bench(truth))

    def misfit(without: str) -> float:
        own = {one: value for one, value in coefficients.items() if one.split(".")[0] != without}
        if "coulomb_friction.limit" in own:
            own["coulomb_friction.bend"] = BEND
        model = extended(base, tuple(one for one in names if one != without), own)
        ours = np.asarray(simulate_compiled(model, {"current": jnp.asarray(current)}, SAMPLE, tolerance=1e-4).position)
        return float(np.std(ours - theirs) / np.ptp(theirs))

    assert misfit("") < 4e-4
    assert all(misfit(one) > 1e-3 for one in names)


@pytest.mark.slow
def test_the_loop_names_what_the_simulator_has_and_the_base_model_lacks(tmp_path: Path) -> None:
    found = closed(tmp_path, "no-friction")
    assert found["verdict"] == "explained"
    # Liang's rule is the simulator's too.
    assert set(found["added"]) - {"liang_conditions"} == ALL - {"coulomb_friction"}
    for name in ("free_convection.exponent", "elastic_mismatch.contrast"):
        assert found["sizes"][name] == pytest.approx(found["true"][name], rel=0.1)
    assert found["rmse"]["partial strokes"][1] < 1.1 * NOISE
