# %% [markdown]
# # Identify a measured wire
#
# Flexinol in an oven at constant stress: strain over temperature at 50, 100, 172 and 200 MPa, published openly. The folder with the measured data is
# the one that `SMAJAX_DATA` names; the experiment file is `studies/flexinol_isobaric/identify.toml`. One stress is held out. So this notebook
# needs a clone of the repository and the data.

# %% tags=["skip-execution"]
# %pip install -q smajax

# %%
from pathlib import Path

import matplotlib.pyplot as plt

import smajax as sma

sma.prepare()  # float64, and compiled programs are kept for the next time
studies = next(one / "studies" for one in (Path.cwd(), *Path.cwd().parents) if (one / "studies").is_dir())
experiment = sma.load_experiment(studies / "flexinol_isobaric" / "identify.toml")
for run in experiment.runs:
    print(f"{run.name:10s} {run.role:10s} {run.time.size} samples")
print(len(experiment.unknowns), "unknowns, of them of effects:", ", ".join(experiment.declared_effects))

# %% [markdown]
# Here the fit starts from the values of the file. `starts=64` starts from as many points of the box as well, and the best converge: slower, and it may end in a lower
# local minimum.

# %%
result = sma.identify(experiment, starts=0)
words = sma.narrate(result)
for one in result.estimates:
    error = "not identifiable from these runs" if one.standard_error is None else f"± {one.standard_error:.3g}"
    print(f"{one.name:42s} {one.value:12.5g} {error} {one.unit} {words.remarks[one.name]}")

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
plt.show()
