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
# The fit starts from many points of the box, and the best converge with exact derivatives. Fewer starts are quicker, and may end in a higher local minimum.

# %%
result = identify(experiment, starts=0 if os.environ.get("SMAJAX_FAST") else 64)
for one in result.estimates:
    error = "not identifiable from these runs" if one.standard_error is None else f"± {one.standard_error:.3g}"
    print(f"{one.name:42s} {one.value:12.5g} {error} {one.unit} {one.remark}")

# %% [markdown]
# The held-out stress validates the fit.

# %%
errors = {run.name: (run.role, 100 * run.series[0].rmse) for run in result.runs}
for name, (role, error) in errors.items():
    print(f"{name:10s} {role:10s} {error:.3f} % strain")

# %%
figure, axes = plt.subplots(1, len(result.runs), figsize=(12, 3.2), sharey=True, layout="constrained")
for panel, run, measured in zip(axes, result.runs, experiment.runs, strict=True):
    temperature = measured.inputs["temperature"]
    panel.plot(temperature, 100 * run.series[0].measured, linewidth=3, alpha=0.4, label="measured")
    panel.plot(temperature, 100 * run.series[0].simulated, linewidth=1.2, label="simulated")
    panel.set(xlabel="temperature (°C)", title=f"{run.name}, {run.role}")
axes[0].set_ylabel("strain (%)")
axes[0].legend()
