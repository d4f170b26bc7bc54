"""A draft of an experiment from logs with empty cells: an output may lack samples, an input may not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.data.experiment.draft import draft
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE


def _log(path: Path, lacking: str) -> Path:
    rows = [[f"{k / 20:g}", f"{5 * (k > 20)}", f"{3.0 + np.sin(k / 9):.4f}"] for k in range(200)]
    for row in rows[7::50]:
        row[("time", "voltage", "position").index(lacking)] = ""
    path.write_text("\n".join(["time [s],U [V],displacement [mm]", *(",".join(row) for row in rows)]) + "\n")
    return path


def test_an_output_with_empty_cells_is_the_output_and_its_gaps_are_omitted(tmp_path: Path) -> None:
    made = draft([_log(tmp_path / "log.csv", "position")], tmp_path / "experiment.toml")
    assert 'position: some of its cells are empty: these samples are omitted (missing = "skip")' in made.messages
    assert not any("MISSING" in one or "left out" in one for one in made.messages)
    (tmp_path / "experiment.toml").write_text(made.text)
    (run,) = load_experiment(tmp_path / "experiment.toml", CATALOGUE).runs
    assert np.flatnonzero(np.isnan(run.outputs["position"])).tolist() == [7, 57, 107, 157]


def test_an_input_with_empty_cells_is_the_input_and_has_to_be_filled(tmp_path: Path) -> None:
    made = draft([_log(tmp_path / "log.csv", "voltage")], tmp_path / "experiment.toml")
    assert any(one.startswith("voltage: some of its cells are empty") and "fill them" in one for one in made.messages)
    (tmp_path / "experiment.toml").write_text(made.text)
    with pytest.raises(ExperimentError, match=r"line 9, column 'U \[V\]': the cell is empty"):
        load_experiment(tmp_path / "experiment.toml", CATALOGUE)


def test_an_output_without_gaps_has_no_line_about_them(tmp_path: Path) -> None:
    rows = "\n".join(f"{k / 20:g},{5 * (k > 20)},{3.0 + np.sin(k / 9):.4f}" for k in range(200))
    (tmp_path / "log.csv").write_text("time [s],U [V],displacement [mm]\n" + rows + "\n")
    assert "missing" not in draft([tmp_path / "log.csv"], tmp_path / "experiment.toml").text
