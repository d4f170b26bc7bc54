# %% [markdown]
# # The source's own discovery, reproduced by the loop
#
# A mass hangs on a warm wire. Part of it is removed and put back: temperature and load return to their values, but the wire stays shorter than before. Elahinia
# (2004, sec. 3.5) measured 0.32, 0.27 and 0.28 mm for 96 g (eq. 3.16). Earlier models, whose branches depend on the sign of dT/dt, predict none of it. He
# found that the stress rate is missing (eq. 3.17, 3.18): a branch is followed where $\dot T - \dot\sigma/C$ points into its range.
#
# Here the loop reproduces that discovery. The runs are simulated under the conditions with the stress rate, and noise is added. The loop gets the older conditions, and
# chooses among the most similar effects. The whole study, with the whole library and with runs from a generator that shares no code with the package, is
# `python -m studies.stress_rate.run`.

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
# ## The runs
#
# A constant voltage keeps the wire warm while mass comes off and goes back; one run heats and cools under one mass. The last one is held out.


# %%
def levels(*parts):
    """A series of levels, each with its number of samples."""
    return np.concatenate([np.full(count, level) for count, level in parts])


once = levels((270, 0.80), (151, 0.64), (180, 0.80))  # kg
twice = levels((240, 0.80), (91, 0.64), (90, 0.80), (90, 0.576), (90, 0.80))
ramp = np.interp(np.arange(601), (0, 270, 540, 600), (2.94, 6.2, 2.6, 2.6))  # V
inputs = {
    "off and back": (levels((30, 2.94), (571, 4.98)), once),
    "off twice": (levels((30, 2.94), (571, 5.04)), twice),
    "warmer": (levels((30, 2.94), (571, 5.08)), once),
    "ramp": (ramp, np.full(601, 0.80)),
    "held-out twice": (levels((30, 2.94), (571, 5.01)), twice),
}
true = {
    "wire_diameter": 3.1e-4,  # m
    "convection_coefficient": 138.0,  # W/(m^2 K)
    "recoverable_strain": 0.044,
    "damping": 100.0,  # N s/m
    "ambient_temperature": 23.0,  # degC
}
wire = sma.set_parameters(sma.build("flexinol_table_3_2", "dead_weight", "voltage", "enhanced"), true)
random, noise = np.random.default_rng(316), 8e-5  # m
logs = {}
for name, (voltage, mass) in inputs.items():
    fine = {"voltage": np.repeat(voltage, 10), "mass": np.repeat(mass, 10)}  # ten steps of the model a sample
    position = np.asarray(sma.simulate_compiled(wire, fine, 0.01).position)[::10]
    logs[name] = np.column_stack(
        [0.1 * np.arange(601), voltage, 1e3 * mass, 1e3 * (position + random.normal(0.0, noise, 601))]
    )

# %%
time, _, mass, position = logs["off and back"].T
net = float(position[441:481].mean() - position[230:270].mean())
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 4), layout="constrained")
axes[0].plot(time, mass)
axes[0].set_ylabel("mass (g)")
axes[1].plot(time, position)
axes[1].set(xlabel="time (s)", ylabel="position (mm)")
plt.show()
print(f"after the mass is back the load hangs {abs(net):.2f} mm from its earlier position")

# %% [markdown]
# The experiment file: what is known, what is not, and the columns of the logs.

# %%
EXPERIMENT = """
title = "A mass is taken off and put back"

[model]
wire = "flexinol_table_3_2"
load = "dead_weight"
drive = "voltage"
law = "{law}"

[model.parameters]
wire_diameter = "0.31 mm"
damping = "100 N s/m"
ambient_temperature = "23 degC"
{known}

[unknown]
convection_coefficient = {{ low = "60 W/m^2/K", high = "375 W/m^2/K", start = "150 W/m^2/K" }}
specific_heat = {{ low = "128 J/kg/K", high = "805 J/kg/K", start = "322 J/kg/K" }}
recoverable_strain = {{ low = "0.023 1", high = "0.083 1", start = "0.046 1" }}
austenite_start = {{ low = "48 degC", high = "88 degC", start = "68 degC" }}
austenite_finish = {{ low = "58 degC", high = "98 degC", start = "78 degC" }}
martensite_start = {{ low = "32 degC", high = "72 degC", start = "52 degC" }}
martensite_finish = {{ low = "22 degC", high = "62 degC", start = "42 degC" }}

[nuisance]
offset = true

[sampling]
step = "100 ms"

[time]
column = "time_s"
unit = "s"

[channels]
voltage = {{ role = "input", column = "voltage_V", unit = "V" }}
mass = {{ role = "input", column = "mass_g", unit = "g" }}
position = {{ role = "output", column = "position_mm", unit = "mm", noise = "0.08 mm" }}

[effects]
only = {candidates}
"""
RUN = """
[[runs]]
name = "{name}"
role = "{role}"
file = "{name}.csv"
"""
DATA_SHEET = (
    *("young_modulus_austenite", "young_modulus_martensite", "thermal_modulus"),
    *("stress_slope_austenite", "stress_slope_martensite", "resistivity_austenite", "resistivity_martensite"),
)
folder = Path(tempfile.mkdtemp())
for name, table in logs.items():
    np.savetxt(
        folder / f"{name}.csv",
        table,
        fmt="%.8g",
        delimiter=",",
        header="time_s,voltage_V,mass_g,position_mm",
        comments="",
    )


def experiment(law, candidates):
    table = sma.parameters(wire)
    values = sma.parameter_values(wire)
    known = "\n".join(f'{name} = "{values[name]:.8g} {table[name].unit}"' for name in DATA_SHEET)
    roles = {name: "held-out" if name.startswith("held-out") else "fit" for name in logs}
    text = EXPERIMENT.format(law=law, known=known, candidates=candidates)
    text += "".join(RUN.format(name=name, role=role) for name, role in roles.items())
    (folder / f"{law}.toml").write_text(text, encoding="utf-8")
    return sma.load_experiment(folder / f"{law}.toml")


# %% [markdown]
# ## The loop with the older conditions

# %%
findings = sma.close_loop(experiment("liang", ["enhanced_conditions", "minor_loops", "latent_heat"]))
print(findings.verdict)
narrative = sma.narrate(findings)
print(*narrative.summary, sep="\n")
for done, why in zip(findings.rounds, narrative.rounds, strict=True):
    print(done.number, done.chosen or "nothing added", "-", why)

# %%
added = [effect for effect in findings.effects if effect.added]
share = added[0].coefficients["share"].value
held_out = next(one for one in findings.runs if one.role == "held-out")
print(f"share of the wire that follows the stress rate too: {share:.3f}")
figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
axis.plot(held_out.time, 1e3 * held_out.measured, ".", ms=2, label="measured, held out")
axis.plot(held_out.time, 1e3 * held_out.before, label=f"without: {1e3 * held_out.rmse_before:.2f} mm")
axis.plot(held_out.time, 1e3 * held_out.after, label=f"with the stress rate: {1e3 * held_out.rmse_after:.3f} mm")
axis.set(xlabel="time (s)", ylabel="position (mm)")
axis.legend()
plt.show()

# %% [markdown]
# ## The loop with the enhanced conditions
#
# With the conditions that include the stress rate the loop adds nothing, and says so.

# %%
content = sma.close_loop(experiment("enhanced", ["minor_loops", "latent_heat"]))
print(content.verdict)
print(sma.narrate(content).summary[0])
