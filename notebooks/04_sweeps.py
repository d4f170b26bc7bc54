# %% [markdown]
# # Sweeps
#
# Any parameter and any input may vary: on a grid, as samples of a box, and as products of these. Results are labelled, with units.

# %%
import os
import tempfile
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from smajax.model.presets import build  # noqa: E402
from smajax.simulation.batch.axes import grid, sampled  # noqa: E402
from smajax.simulation.batch.run_batch import good, run_batch, status_summary  # noqa: E402
from smajax.simulation.measures import Largest, Last  # noqa: E402

runs = 64 if os.environ.get("SMAJAX_FAST") else 4096

# %% [markdown]
# How certain is the stroke at each voltage if payload, convection and air are known only to a few per cent? `keep=()` stores no trajectories, `measures`
# are updated during a run, and `tolerance` selects adaptive steps.

# %%
arm = build("niti_table_3_1", "arm", "amplified_voltage")
voltages = [6.0, 6.5, 7.0, 7.5, 8.0]
box = {"payload_mass": (0.054, 0.060), "convection_coefficient": (140.0, 160.0), "ambient_temperature": (18.0, 22.0)}
result = run_batch(
    arm,
    {},
    grid(voltage=voltages) * sampled(runs, **box),
    seconds=20.0,
    dt=0.05,
    tolerance=1e-4,
    keep=(),
    measures=(Last("position"), Largest("stress"), Largest("temperature")),
)
print(status_summary(result))
angles = np.degrees(good(result)["last_position"])
spread = (angles.quantile(0.95, "sample") - angles.quantile(0.05, "sample")).values
for volts, middle, wide in zip(voltages, angles.median("sample").values, spread, strict=True):
    print(f"{volts} V: {middle:6.1f} degrees, nine in ten within {wide:.1f}")

# %% [markdown]
# The spread is largest in the middle, where the wire is partly transformed and the arm near its unstable angle. A voltage alone does not hold it there.

# %%
figure, axes = plt.subplots(figsize=(5, 3.4), layout="constrained")
axes.boxplot([angles.sel(voltage=volts).dropna("sample").values for volts in voltages], tick_labels=voltages)
axes.set(xlabel="voltage (V)", ylabel="angle after 20 s (degrees)")

# %% [markdown]
# With `out` the results are streamed to a store, one chunk at a time, and the same call resumes where it stopped. `smajax.simulation.batch.run_batch.opened` opens the store again, with its coordinates.

# %%
store = Path(tempfile.mkdtemp()) / "stored"
stored = run_batch(
    arm,
    {},
    sampled(runs, voltage=(6.0, 8.0)),
    seconds=10.0,
    dt=0.05,
    tolerance=1e-4,
    keep=(),
    measures=(Last("position"),),
    out=store,
)
print(
    stored["last_position"].attrs,
    "in",
    sum(file.stat().st_size for file in store.rglob("*") if file.is_file()),
    "bytes",
)
