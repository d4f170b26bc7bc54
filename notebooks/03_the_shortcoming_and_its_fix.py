# %% [markdown]
# # The source's shortcoming, and its fix
#
# Under Liang's and Brinson's conditions an arm on its way to 85 degrees stalls half way, with a wire that is hotter than necessary. Under the
# enhanced conditions it reaches 85 degrees. Both are in the gallery as M5 and M6; here they are simulated step by step.

# %% tags=["skip-execution"]
# %pip install -q smajax

# %%
import dataclasses

import matplotlib.pyplot as plt
import numpy as np

import smajax as sma

sma.prepare()  # float64, and compiled programs are kept for the next time

dt = 0.01
wanted = sma.reference.constant(sma.reference.clock(20.0, dt), np.radians(85.0))
arm = sma.compose("niti_table_3_1", "arm", "amplified_voltage")
loops = {}
for law in ("liang", "enhanced"):
    plant = dataclasses.replace(arm, wire=sma.under_law(arm.wire, law))
    loops[law] = sma.simulate_closed_loop(plant, sma.control_presets.stress_sliding(plant), wanted, dt)
ends = {law: float(np.degrees(loop.run.position[-1])) for law, loop in loops.items()}
for law, loop in loops.items():
    print(f"{law}: ends at {ends[law]:.1f} degrees with xi = {loop.run.martensite_fraction[-1]:.3f}")

# %% [markdown]
# The reason: beyond 17 degrees the stress falls as the arm rises, and the transformation range falls with it. At times the wire cools
# but moves up in its range: T falls while T - sigma/C_A rises. Under Liang's condition, dT/dt > 0, nothing transforms at these times. The enhanced
# condition requires T - sigma/C_A to rise, so the transformation continues.

# %%
run, law = loops["liang"].run, arm.wire.kinetics
driving = run.temperature - run.stress / law.stress_slope_austenite
missed = (np.diff(run.temperature) < 0.0) & (np.diff(driving) > 0.0) & (np.asarray(driving[1:]) > law.austenite_start)
risen = float(np.diff(driving)[missed].sum())
left = float(run.temperature[-1] - law.austenite_finish - run.stress[-1] / law.stress_slope_austenite)
print(f"{missed.sum()} such moments, in which T - sigma/C_A rises by {risen:.1f} C and nothing transforms")
print(f"at the end the wire is {left:.0f} C above A_f', and the arm hangs at {ends['liang']:.0f} degrees")

# %%
figure, (angle, plane) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
for name, loop in loops.items():
    angle.plot(loop.run.time, np.degrees(loop.run.position), label=name)
    plane.plot(loop.run.temperature, 1e-6 * loop.run.stress)
angle.axhline(85.0, color="grey", linewidth=0.8)
angle.set(xlabel="time (s)", ylabel="angle (degrees)")
angle.legend()
plane.set(xlabel="temperature (°C)", ylabel="stress (MPa)")
plt.show()
