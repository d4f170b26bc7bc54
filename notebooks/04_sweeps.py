# %% [markdown]
# # Sweeps
#
# Any parameter and any input may vary: on a grid, as samples of a box, and as products of these. Results are labelled, with units.

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
# How certain is the stroke at each voltage if payload, convection and air are known only to a few per cent? `keep=()` stores no trajectories, `measures`
# are updated during a run, and `tolerance` selects adaptive steps.

# %%
arm = sma.compose("niti_table_3_1", "arm", "amplified_voltage")
voltages = [6.0, 6.5, 7.0, 7.5, 8.0]
box = {"payload_mass": (0.054, 0.060), "convection_coefficient": (140.0, 160.0), "ambient_temperature": (18.0, 22.0)}
runs = 64  # of each voltage; thousands take seconds
result = sma.run_batch(
    arm,
    {},
    sma.grid(voltage=voltages) * sma.sampled(runs, **box),
    seconds=20.0,
    dt=0.05,
    tolerance=1e-4,
    keep=(),
    measures=(sma.measure.Last("position"), sma.measure.Largest("stress"), sma.measure.Largest("temperature")),
)
print(sma.status_summary(result))
angles = np.degrees(sma.good(result)["last_position"])
spread = (angles.quantile(0.95, "sample") - angles.quantile(0.05, "sample")).values
for volts, middle, wide in zip(voltages, angles.median("sample").values, spread, strict=True):
    print(f"{volts} V: {middle:6.1f} degrees, nine in ten within {wide:.1f}")

# %% [markdown]
# The spread is largest in the middle, where the wire is partly transformed and the arm near its unstable angle. A voltage alone does not hold it there.

# %%
figure, axes = plt.subplots(figsize=(5, 3.4), layout="constrained")
axes.boxplot([angles.sel(voltage=volts).dropna("sample").values for volts in voltages], tick_labels=voltages)
axes.set(xlabel="voltage (V)", ylabel="angle after 20 s (degrees)")
plt.show()

# %% [markdown]
# With `out` the results are streamed to a store, one chunk at a time, and the same call resumes where it stopped. A store needs the extra: `pip install 'smajax[store]'`.

# %%
store = Path(tempfile.mkdtemp()) / "stored"
stored = sma.run_batch(
    arm,
    {},
    sma.sampled(runs, voltage=(6.0, 8.0)),
    seconds=10.0,
    dt=0.05,
    tolerance=1e-4,
    keep=(),
    measures=(sma.measure.Last("position"),),
    out=store,
)
print(dict(stored["last_position"].sizes), stored["last_position"].attrs["units"])
