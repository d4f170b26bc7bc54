# %% [markdown]
# # From measured runs to the missing effect
#
# A virtual bench lifts a weight with a wire whose latent heat the base model leaves out. The loop gets six logged
# runs and an experiment file, and has to identify it. Open this file as a notebook (jupytext) or run it as it is.

# %%
import dataclasses
import os
import tempfile
from importlib import resources
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

from smajax.attribution.close_loop import close_loop  # noqa: E402
from smajax.data.experiment.load import load_experiment  # noqa: E402
from smajax.data.model_catalogue import CATALOGUE  # noqa: E402
from smajax.report.narrative import narrate  # noqa: E402
from smajax.report.write import write_report  # noqa: E402

# %% [markdown]
# The experiment: the known parameters, the unknown ones with their bounds, and the held-out runs.

# %%
with resources.as_file(resources.files("smajax") / "data" / "demo" / "latent") as folder:
    experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
for unknown in experiment.unknowns:
    print(f"{unknown.name:25s} {unknown.low:10.4g} .. {unknown.high:10.4g} {unknown.unit}")
for run in experiment.runs:
    print(f"{run.name:15s} {run.role:10s} {len(run.time)} samples")

# %% [markdown]
# The loop tries every effect of the library, which takes minutes. Finished fits are cached in a folder, so that an interrupted loop
# resumes. With `SMAJAX_FAST=1` it tries two candidates.

# %%
if os.environ.get("SMAJAX_FAST"):
    experiment = dataclasses.replace(experiment, effects_only=("latent_heat", "sensor_lag"))
out = Path(tempfile.mkdtemp())
findings = close_loop(experiment, memory=out / "fits", progress=lambda event: None)
print(findings.verdict)
print(*narrate(findings).summary, sep="\n")

# %% [markdown]
# Every number of the page is in `findings`; the page itself is one file.

# %%
for run in findings.runs:
    print(f"{run.name:15s} {run.role:10s} {1e3 * run.rmse_before:8.3f} -> {1e3 * run.rmse_after:8.3f} mm")
print(write_report(findings, out))
