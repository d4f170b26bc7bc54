"""A base model with two effects that exclude each other is refused where the experiment file is read."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.data.experiment.errors import ExperimentError
from smajax.data.open_experiment import open_experiment
from tests.helpers.small_bench import bench

HELD = ("[unknown]\n", '[model.parameters]\n"smooth_transformation.weight" = 0.5\n[unknown]\n')
FREE = ("[unknown]\n", '[unknown]\n"asymmetric_transformation.heating" = { low = -0.5, high = 0.5, start = 0.1 }\n')


def test_two_shapes_of_the_transformation_are_refused(tmp_path: Path) -> None:
    said = (
        r"unknown\.asymmetric_transformation\.heating: got 'asymmetric_transformation' beside 'smooth_transformation' \(the file names "
        r"'smooth_transformation\.weight'\), expected one effect at most that describes the shape of the transformation: they exclude each other; "
        "remove the values of one of the two"
    )
    with pytest.raises(ExperimentError, match=said):
        open_experiment(bench(tmp_path, FREE, HELD))


@pytest.mark.parametrize("one", [HELD, FREE])
def test_one_shape_is_a_base_model(tmp_path: Path, one: tuple[str, str]) -> None:
    assert len(open_experiment(bench(tmp_path, one)).declared_effects) == 1
