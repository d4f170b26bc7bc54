"""Write docs/loop.png, the picture of a closed loop, from the demo: `python -m studies.make_pictures`; some minutes."""

from __future__ import annotations

import tempfile
from importlib import resources
from pathlib import Path

from rich.console import Console

from smajax.catalogue import CATALOGUE
from smajax.close_loop import close_loop
from smajax.experiment.load import load_experiment
from smajax.progress import shown
from smajax.report.pictures import run_over_time
from smajax.runtime import prepare

PICTURE = Path(__file__).parents[1] / "docs" / "loop.png"
RUN = "mass_change"  # held out


def main() -> None:
    """Closes the loop on the demo's wire with a latent heat, and draws a run that no fit saw."""
    with resources.as_file(resources.files("smajax") / "demo" / "latent") as folder:
        experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    with tempfile.TemporaryDirectory() as kept, shown(Console(stderr=True)) as progress:
        findings = close_loop(experiment, memory=Path(kept), progress=progress)
    run = next(one for one in findings.runs if one.name == RUN)
    PICTURE.write_bytes(run_over_time(findings, run))


if __name__ == "__main__":
    prepare(cores=True)
    main()
