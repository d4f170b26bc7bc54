"""Write docs/loop.png, the picture of a closed loop, from the demo: `python -m studies.make_pictures`; some minutes."""

from __future__ import annotations

import tempfile
from importlib import resources
from pathlib import Path

from rich.console import Console

from smajax.attribution.close_loop import close_loop
from smajax.cli.progress_display import displayed
from smajax.core.runtime import prepare
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.report.run_plots import over_time
from smajax.report.series_picture import as_picture

PICTURE = Path(__file__).parents[1] / "docs" / "loop.png"
RUN = "mass_change"  # held out
DPI = 150


def main() -> None:
    """Closes the loop on the demo's wire with a latent heat, and draws a run that no fit saw."""
    with resources.as_file(resources.files("smajax") / "data" / "demo" / "latent") as folder:
        experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    with tempfile.TemporaryDirectory() as kept, displayed(Console(stderr=True)) as progress:
        findings = close_loop(experiment, memory=Path(kept), progress=progress)
    run = next(one for one in findings.runs if one.name == RUN)
    PICTURE.write_bytes(as_picture(over_time(findings, run), DPI))


if __name__ == "__main__":
    prepare(cores=True)
    main()
