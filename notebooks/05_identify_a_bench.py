# %% [markdown]
# # Identify a measured wire
#
# Flexinol in an oven at constant stress: strain over temperature at 50, 100, 172 and 200 MPa, published openly. The folder with the measured data is
# the one that `SMAJAX_DATA` names; the experiment file is `studies/flexinol_isobaric/identify.toml`. One stress is held out.

# %%
import os
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib.pyplot as plt  # noqa: E402

from smajax.data.experiment.load import load_experiment  # noqa: E402
from smajax.data.model_catalogue import CATALOGUE  # noqa: E402
from smajax.fit.identify import identify  # noqa: E402

studies = next(one / "studies" for one in (Path.cwd(), *Path.cwd().parents) if (one / "studies").is_dir())
experiment = load_experiment(studies / "flexinol_isobaric" / "identify.toml", CATALOGUE)
for run in experiment.runs:
    print(f"{run.name:10s} {run.role:10s} {run.time.size} samples")
print(len(experiment.unknowns), "unknowns, of them of effects:", ", ".join(experiment.declared_effects))

# %% [markdown]
# From many points of the box, the best carried to their end with exact derivatives. Fewer starts are quicker, and may end higher.

# %%
found = identify(experiment, starts=0 if os.environ.get("SMAJAX_FAST") else 64)
for one in found.estimates:
    error = "not told by these runs" if one.standard_error is None else f"± {one.standard_error:.3g}"
    print(f"{one.name:42s} {one.value:12.5g} {error} {one.unit} {one.remark}")

# %% [markdown]
# What counts is the stress that no fit saw.

# %%
errors = {run.name: (run.role, 100 * run.series[0].rmse) for run in found.runs}
for name, (role, error) in errors.items():
    print(f"{name:10s} {role:10s} {error:.3f} % strain")

# %%
figure, axes = plt.subplots(1, len(found.runs), figsize=(12, 3.2), sharey=True, layout="constrained")
for panel, run, measured in zip(axes, found.runs, experiment.runs, strict=True):
    temperature = measured.inputs["temperature"]
    panel.plot(temperature, 100 * run.series[0].measured, linewidth=3, alpha=0.4, label="measured")
    panel.plot(temperature, 100 * run.series[0].simulated, linewidth=1.2, label="simulated")
    panel.set(xlabel="temperature (°C)", title=f"{run.name}, {run.role}")
axes[0].set_ylabel("strain (%)")
axes[0].legend()
