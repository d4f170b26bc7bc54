"""A thermocouple on the wire that is declared as the air's temperature is asked about; the air of a room is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.data.open_experiment import open_experiment
from tests.helpers.small_bench import bench

CHANNEL = '[channels.ambient_temperature]\nrole = "input"\ncolumn = "TC1"\nunit = "degC"\n[[runs]]\nname = "A"'


def _asked(folder: Path, rise: float, drift: float = 0.0, noise: float = 0.1) -> list[str]:
    """The warnings of a bench whose recorded air rises by `rise` K with the heat and by `drift` K in a minute."""
    path = bench(folder, ('[[runs]]\nname = "A"', CHANNEL))
    for name, seed in (("a.csv", 0), ("b.csv", 1)):
        columns = np.loadtxt(folder / name, delimiter=",", skiprows=1)
        air = 23.0 + rise * columns[:, 2] / 18.0 + drift * columns[:, 0] / 60.0
        air += noise * np.random.default_rng(seed).normal(size=air.size)
        np.savetxt(
            folder / name, np.column_stack([columns, air]), delimiter=",", header="t,U,x,TC1", comments="", fmt="%.6g"
        )
    return [text for text in open_experiment(path).warnings if "'ambient_temperature' (column 'TC1')" in text]


@pytest.mark.parametrize(
    ("rise", "words"), [(60.0, "within 10 s, which the air of a room does not"), (4.5, "follows the heat (rank")]
)
def test_a_thermocouple_on_the_wire_as_the_air_is_a_warning(tmp_path: Path, rise: float, words: str) -> None:
    (told,) = _asked(tmp_path, rise)
    assert words in told
    assert "The temperature of the wire is an output: declare the column as [channels.temperature]" in told


@pytest.mark.parametrize(("drift", "noise"), [(0.0, 0.1), (3.0, 0.5), (10.0, 1.0)])
def test_the_air_of_a_room_or_a_chamber_raises_no_question(tmp_path: Path, drift: float, noise: float) -> None:
    assert _asked(tmp_path, 0.0, drift, noise) == []
