# %% [markdown]
# # Tune gains
#
# The gains of a controller that switches with a layer (VSC3), moved so that the worst of all loops costs least: several set points at once, on the plant as
# believed and with 20 % errors of its damping, with a limit on the overshoot. On the command line:
#
#     smajax tune vsc3 --set-points 0,30 --variation damping=20% --limits overshoot=0.1 --out tuned

# %%
import os
import tempfile
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from smajax.control.tune.settings import TuneSettings  # noqa: E402
from smajax.model.rigs import arm  # noqa: E402
from smajax.report.tune_folder import tune_into  # noqa: E402

fast = bool(os.environ.get("SMAJAX_FAST"))
settings = TuneSettings(
    "vsc3",
    (0.0, 30.0),
    {"damping": 0.2},
    limits={"overshoot": 0.1},  # degrees
    tried=4 if fast else 32,
    starts=2 if fast else 6,
    rounds=4 if fast else 30,
    finish=3 if fast else 60,
    seconds=3.0,
    unseen=2 if fast else 32,
)
print(settings.plants_in_words())
print(settings.goal_in_words())

# %% [markdown]
# Every loop gives the slopes of every term in every gain with it; a step is the least of the largest of all loops' straight lines, within a trust region.
# Near the end another loop is the worst after every step, and slopes say little: a search without them (CMA-ES) follows, `finish` generations of it.
# Rounds and generations are kept in the folder, so it can be interrupted.

# %%
out = Path(tempfile.mkdtemp()) / "tuned"
found = tune_into(arm(), settings, out)
for name, before in found.before.items():
    print(f"{name:16s} {before:8.3g} -> {found.after.values[name]:8.3g} {found.units[name]}")
print(f"worst cost {found.costs[0]:.2f} -> {found.costs[1]:.2f}")
print(f"limits met, also on plants that tuning never saw: {found.within_limits}")

# %%
figure, panels = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True, layout="constrained")
for panel, angles, title in zip(panels, found.lines.angles, ("before", "after"), strict=True):
    panel.plot(found.lines.time, np.degrees(angles.T), linewidth=0.8)
    panel.set(xlabel="time (s)", title=title)
panels[0].set_ylabel("angle (degrees)")

# %% [markdown]
# `smajax sweep --gains tuned/gains.json` runs what was found on ten thousand plants.
