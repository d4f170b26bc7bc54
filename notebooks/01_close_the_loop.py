# %% [markdown]
# # From measured runs to the missing effect
#
# A virtual bench lifts a weight with a wire whose latent heat the base model leaves out. The loop gets six logged
# runs and an experiment file, and has to identify it.

# %% tags=["skip-execution"]
# %pip install -q smajax

# %%
import dataclasses
import tempfile
from importlib import resources
from pathlib import Path

import smajax as sma

sma.prepare()  # float64, and compiled programs are kept for the next time

# %% [markdown]
# The experiment: the known parameters, the unknown ones with their bounds, and the held-out runs.

# %%
with resources.as_file(resources.files("smajax") / "data" / "demo" / "latent") as folder:
    experiment = sma.load_experiment(folder / "experiment.toml")
for unknown in experiment.unknowns:
    print(f"{unknown.name:25s} {unknown.low:10.4g} .. {unknown.high:10.4g} {unknown.unit}")
for run in experiment.runs:
    print(f"{run.name:15s} {run.role:10s} {len(run.time)} samples")

# %% [markdown]
# The loop tries every effect of the library, which takes minutes; here it chooses between two. Without the first line it tries all. Finished fits
# are cached in a folder, so that an interrupted loop resumes.

# %%
experiment = dataclasses.replace(experiment, effects_only=("latent_heat", "sensor_lag"))
out = Path(tempfile.mkdtemp())
findings = sma.close_loop(experiment, memory=out / "fits")
print(findings.verdict)
print(*sma.narrate(findings).summary, sep="\n")

# %% [markdown]
# Every number of the page is in `findings`; the page itself is one file.

# %%
for run in findings.runs:
    print(f"{run.name:15s} {run.role:10s} {1e3 * run.rmse_before:8.3f} -> {1e3 * run.rmse_after:8.3f} mm")
page = sma.write_report(findings, out)
print(page.name)
