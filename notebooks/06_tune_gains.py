# %% [markdown]
# # Tune gains
#
# The gains of a switching controller with a boundary layer (VSC3) are moved to lower the cost of the worst loop: several set points at once, on the nominal
# plant and with 20 % errors of its damping, with a limit on the overshoot. On the command line:
#
#     smajax tune vsc3 --set-points 0,30 --variation damping=20% --limits overshoot=0.1 --out tuned

# %% tags=["skip-execution"]
# %pip install -q smajax

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import smajax as sma

sma.prepare()  # float64, and compiled programs are kept for the next time

# %% [markdown]
# The settings are small, for a short wait. Left out, `tried` (points of the box), `starts`, `rounds`, `finish` and `unseen` (plants of the check) are several times as large.

# %%
settings = sma.TuneSettings(
    "vsc3",
    (0.0, 30.0),
    {"damping": 0.2},
    limits={"overshoot": 0.1},  # degrees
    tried=4,
    starts=2,
    rounds=4,
    finish=3,
    seconds=3.0,
    unseen=2,
)
words = sma.narrate(settings)
print(words.plants)
print(words.goal)

# %% [markdown]
# Every loop also returns the derivatives of every term in every gain. A step minimises the largest of all loops' linear models within a trust region.
# Near the end another loop is the worst after every step, and derivatives say little. A derivative-free search (CMA-ES) of `finish` generations follows.
# Rounds and generations are cached in the folder, so that an interrupted tuning resumes.

# %%
out = Path(tempfile.mkdtemp()) / "tuned"
arm = sma.compose("niti_table_3_1", "arm", "amplified_voltage")
result = sma.tune_in_folder(arm, settings, out)
sma.write_tuning(result, out)
for name, before in result.before.items():
    print(f"{name:16s} {before:8.3g} -> {result.after.values[name]:8.3g} {result.units[name]}")
print(f"worst cost {result.costs[0]:.2f} -> {result.costs[1]:.2f}")
print(f"limits met, also on plants that were not used for tuning: {result.within_limits}")

# %%
figure, panels = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True, layout="constrained")
for panel, angles, title in zip(panels, result.lines.angles, ("before", "after"), strict=True):
    panel.plot(result.lines.time, np.degrees(angles.T), linewidth=0.8)
    panel.set(xlabel="time (s)", title=title)
panels[0].set_ylabel("angle (degrees)")
plt.show()

# %% [markdown]
# `smajax sweep --gains tuned/gains.json` runs the tuned gains on ten thousand plants.
