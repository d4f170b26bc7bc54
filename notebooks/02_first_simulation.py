# %% [markdown]
# # First simulation
#
# An arm on a wire, a step of voltage, and the states of the wire: wire x load x drive, by name. `sma.WIRES`, `sma.LOADS` and `sma.DRIVES` have the
# presets, and `smajax presets` lists them.

# %% tags=["skip-execution"]
# %pip install -q smajax

# %%
import matplotlib.pyplot as plt
import numpy as np

import smajax as sma

sma.prepare()  # float64, and compiled programs are kept for the next time

for preset in (sma.WIRES["niti_table_3_1"], sma.LOADS["arm"], sma.DRIVES["amplified_voltage"]):
    print(f"{preset.__name__}: {preset.__doc__.splitlines()[0]}")

# %% [markdown]
# The source's rotary arm. Every parameter has a unit, bounds and a meaning, and may be changed by name.

# %%
arm = sma.compose("niti_table_3_1", "arm", "amplified_voltage")
for name in ("convection_coefficient", "austenite_finish", "payload_mass"):
    entry = sma.parameters(arm)[name]
    print(f"{name:24s} {entry.low:g} to {entry.high:g} {entry.unit}: {entry.about}")

# %% [markdown]
# Inputs are series, SI, `dt` apart. 7.2 V stop inside the transformation range. 7.3 V carry the arm past the angle of greatest stress, where the
# transformation temperatures fall and the arm runs to the end by itself.

# %%
dt = 0.005
time = np.arange(4001) * dt  # s
runs = {volts: sma.simulate_compiled(arm, {"voltage": np.full(time.size, volts)}, dt) for volts in (7.2, 7.3)}
ends = {volts: float(np.degrees(run.position[-1])) for volts, run in runs.items()}
for volts, run in runs.items():
    print(
        f"{volts} V: ends at {ends[volts]:.1f} degrees, xi = {run.martensite_fraction[-1]:.2f}, {run.temperature[-1]:.1f} C"
    )

# %%
figure, (angle, plane) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
for volts, run in runs.items():
    angle.plot(time, np.degrees(run.position), label=f"{volts} V")
    plane.plot(run.temperature, 1e-6 * run.stress)
angle.set(xlabel="time (s)", ylabel="angle (degrees)")
angle.legend()
plane.set(xlabel="temperature (°C)", ylabel="stress (MPa)")
plt.show()

# %% [markdown]
# A heavier payload at the same voltage. The program is compiled once, because values are not part of it.

# %%
heavier = sma.set_parameters(arm, {"payload_mass": 0.065})  # kg
run = sma.simulate_compiled(heavier, {"voltage": np.full(time.size, 7.3)}, dt)
print(f"with 65 g instead of 57 g it ends at {np.degrees(run.position[-1]):.1f} degrees")
