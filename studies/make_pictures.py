"""Write the pictures of docs/ that are made from the demo: `python -m studies.make_pictures`; some minutes.

loop.png: a held-out run before and after the loop. check.png: what `smajax check` shows of a run whose sensor was turned round.
"""

from __future__ import annotations

import dataclasses
import shutil
import tempfile
from importlib import resources
from pathlib import Path

from rich.console import Console

from smajax.attribution.close_loop import close_loop
from smajax.cli.progress_display import displayed
from smajax.core.runtime import prepare
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.experiment_check import check_experiment
from smajax.report.check_page import run_plot_of
from smajax.report.run_plots import over_time
from smajax.report.series_picture import as_picture

DOCS = Path(__file__).parents[1] / "docs"
RUN = "mass_change"  # held out
TURNED = "steps"
DPI = 150


def loop(folder: Path) -> bytes:
    """A run that no fit saw, before and after the loop on the demo's wire with a latent heat."""
    experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    with tempfile.TemporaryDirectory() as kept, displayed(Console(stderr=True)) as progress:
        findings = close_loop(experiment, memory=Path(kept), progress=progress)
    run = next(one for one in findings.runs if one.name == RUN)
    return as_picture(over_time(findings, run), DPI)


def check(folder: Path) -> bytes:
    """A run of the demo with its sensor turned round, beside the model at the initial guess."""
    with tempfile.TemporaryDirectory() as place:
        copy = Path(shutil.copytree(folder, Path(place) / "bench"))
        file = copy / "experiment.toml"
        text = file.read_text(encoding="utf-8")
        named = f'name = "{TURNED}"\n'
        assert text.count(named) == 1
        file.write_text(text.replace(named, f'{named}reversed = ["position"]\n'), encoding="utf-8")
        found = check_experiment(load_experiment(file, CATALOGUE))
    run = next(one for one in found.runs if one.name == TURNED)
    plot = run_plot_of(run, 0)
    return as_picture(dataclasses.replace(plot, panels=plot.panels[:1]), DPI)


def main() -> None:
    with resources.as_file(resources.files("smajax") / "data" / "demo" / "latent") as folder:
        (DOCS / "check.png").write_bytes(check(folder))
        (DOCS / "loop.png").write_bytes(loop(folder))


if __name__ == "__main__":
    prepare(cores=True)
    main()
