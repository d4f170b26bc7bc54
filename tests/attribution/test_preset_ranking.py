"""What a draft leaves to the presets is ranked by what the outputs of its runs change by, which simulations of changed values confirm."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.preset_ranking import PresetRanking, rank_presets
from smajax.core.parameters import set_parameters
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.base_model import base_model
from smajax.report.preset_words import remarks, sentence
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.small_bench import bench


def ranked(experiment: Experiment) -> PresetRanking:
    found = rank_presets(experiment)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """A weight that 5 V lifts by 18 mm: one value is known, one to be fitted."""
    folder = tmp_path_factory.mktemp("bench")
    known = ("[unknown]", '[model.parameters]\nload_mass = "75 g"\n[unknown]')
    return load_experiment(bench(folder, known, ('start = "100 W', 'start = "50 W')), CATALOGUE)


def test_an_influence_is_what_a_simulation_with_the_changed_value_is_off_by(experiment: Experiment) -> None:
    """Central differences of a tenth of the change, over the fit run alone and over the noise."""
    found = {one.name: one for one in ranked(experiment).influences}
    (run,) = [one for one in experiment.runs if one.role == "fit"]
    model = base_model(experiment)

    def shown(name: str, value: float) -> np.ndarray:
        inputs = {channel: jnp.asarray(series) for channel, series in run.inputs.items()}
        return np.asarray(simulate_compiled(set_parameters(model, {name: value}), inputs, experiment.step).reading)

    for name in ("wire_diameter", "wire_length", "density", "resistivity_martensite", "ambient_temperature"):
        one = found[name]
        step = 0.01 * (one.change * one.value if one.relative else one.change)
        differences = (shown(name, one.value + step) - shown(name, one.value - step)) / 0.02
        noises = np.sqrt(np.mean(differences**2)) / experiment.noise_sigma
        assert noises > 0.05
        assert one.noises == pytest.approx(noises, rel=0.02), name


def test_the_most_important_is_first_and_what_is_given_or_fitted_is_no_part(experiment: Experiment) -> None:
    found = ranked(experiment)
    noises = [one.noises for one in found.influences]
    assert noises == sorted(noises, reverse=True)
    names = [one.name for one in found.influences]
    assert not {"load_mass", "convection_coefficient", "start_fraction"} & set(names)
    assert {"wire_diameter", "wire_length", "amplifier_gain"} <= set(names[:6])
    assert names[-1] == "amplifier_limit"  # never met
    assert list(remarks(found)) == [one.name for one in found.influences if one.noises >= 0.1]


def test_a_start_at_which_nothing_moves_is_left_for_one_with_more_heat(experiment: Experiment) -> None:
    """At 200 and at 100 W/(m^2 K) 5 V do not transform this wire, at 50 they do."""
    assert not ranked(experiment).changed
    (free,) = experiment.unknowns
    cold = dataclasses.replace(experiment, unknowns=(dataclasses.replace(free, start=200.0),))
    found = ranked(cold)
    assert found.changed == {"convection_coefficient": (50.0, "W/(m^2 K)")}
    assert found.moves >= 0.5
    assert "in place of the start, at which the wire transforms too little)" in sentence(found)
    held = dataclasses.replace(cold, unknowns=(), parameters={**cold.parameters, "convection_coefficient": 200.0})
    still = ranked(held)
    assert still.moves < 0.5
    assert "of what was measured there, so this may change: give what you know" in sentence(still)


def test_the_words_have_the_changes_and_their_noises(experiment: Experiment) -> None:
    found = ranked(experiment)
    first = found.influences[0]
    said = sentence(found)
    assert f"{first.name} ({100.0 * first.change:.3g} % changes the output by " in said
    assert remarks(found)["ambient_temperature"].startswith("2 K changes the output by ")
    nothing = PresetRanking((), {}, 1.0)
    assert sentence(nothing) == "Of what was left to the preset, nothing changes the output by a tenth of the noise."
