# %% [markdown]
# # Your own effect and your own load
#
# An effect is a class that inherits from the contract of the equation it changes and overrides one of its methods. A load is one equation of motion. Neither needs registering to be used.

# %% tags=["skip-execution"]
# %pip install -q smajax

# %%
import dataclasses

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import smajax as sma

sma.prepare()  # float64, and compiled programs are kept for the next time

# %% [markdown]
# The effect: a fan that comes on slowly and cools the air around the wire over time.


# %%
class FanComingOn(sma.AbstractEffect, sma.contracts.HeatTerm):
    """The air cools by `drop` with the time constant `delay`."""

    drop: sma.Scalar = sma.parameter("K", 0.0, 50.0, "by how much the air gets colder in the end", default=0.0)
    delay: sma.Scalar = sma.parameter("s", 0.1, 1e3, "time constant of the fan", default=10.0)

    effect_name = "fan_coming_on"
    candidate = sma.Candidate(
        title="a fan that comes on",
        equation="heat",
        formula="T_inf -> T_inf - drop (1 - exp(-t/delay))",
        sentence="The same voltage lifts less and less.",
        switches=("drop",),
        initial_guess={"drop": 5.0, "delay": 10.0},
    )

    def ambient_shift(self, time):
        return -self.drop * (1.0 - jnp.exp(-time / self.delay))


# %% [markdown]
# The load: a lever with a weight, whose share of the weight falls as it rises.


# %%
class TiltingWeight(sma.AbstractMovingLoad):
    r"""$m \ddot x + b \dot x + m g \cos(x/a) = A_w \sigma$."""

    load_mass: sma.Scalar = sma.parameter("kg", 1e-4, 1e3, "weight")
    damping: sma.Scalar = sma.parameter("N s/m", 0.0, 1e4, "friction of the pivot")
    lever_length: sma.Scalar = sma.parameter("m", 1e-3, 1e2, "a: length of the lever that the wire pulls on")
    reading = ("position", "m")

    def start(self):
        return jnp.zeros_like(self.load_mass)

    def limits(self):
        return -jnp.inf, jnp.inf

    def inertia(self, inputs):
        return self.load_mass

    def resistance(self, position, velocity, inputs):
        return self.load_mass * 9.81 * jnp.cos(position / self.lever_length) + self.damping * velocity

    def lever(self):
        return 1.0

    def contraction(self, wire):
        return 1.0 / wire.wire_length


# %% [markdown]
# Both at once, with the names of their parameters: those of an effect begin with its name. Under the integrated form of the constitutive law every
# cycle closes; under the rate form, the default, four pulses would creep (M11).

# %%
load = TiltingWeight(load_mass=0.15, damping=20.0, lever_length=0.03)
wire = sma.WIRES["flexinol_table_3_2"]()
wire = dataclasses.replace(wire, constitutive=dataclasses.replace(wire.constitutive, form=sma.IntegratedForm()))
still = sma.System(wire, load, sma.DRIVES["flexinol_voltage"]())
fan = dataclasses.replace(still, effects=(FanComingOn(drop=4.0, delay=20.0),))
print([name for name in sma.parameters(fan) if name.startswith("fan_coming_on") or name in sma.parameters(load)])

dt = 0.02
time = np.arange(4001) * dt  # s
inputs = {"voltage": np.where(time % 20.0 < 10.0, 4.8, 0.0)}  # four pulses
runs = {"still air": sma.simulate_compiled(still, inputs, dt), "a fan comes on": sma.simulate_compiled(fan, inputs, dt)}
strokes = {name: [run.position[(time // 20.0) == pulse].max() for pulse in range(4)] for name, run in runs.items()}
for name, each in strokes.items():
    print(f"{name}: " + ", ".join(f"{1e3 * stroke:.1f}" for stroke in each) + " mm")

# %% [markdown]
# At its base value an effect changes nothing, to the last bit: the extended model contains the base model.

# %%
nothing = dataclasses.replace(still, effects=(FanComingOn.base(),))
same = np.array_equal(sma.simulate_compiled(nothing, inputs, dt).position, runs["still air"].position)
print("the base value changes nothing:", same)

# %% [markdown]
# By how much does the last stroke change for one kelvin of the fan?

# %%
step = 1e-3
ends = [
    sma.simulate_compiled(sma.set_parameters(fan, {"fan_coming_on.drop": 4.0 + sign * step}), inputs, dt)
    .position[3000:]
    .max()
    for sign in (1.0, -1.0)
]
slope = float(ends[0] - ends[1]) / (2.0 * step)
print(
    f"{1e3 * slope:.3f} mm a kelvin by differences, at {float(sma.get_parameters(fan, ['fan_coming_on.drop'])[0]):g} K"
)

# %%
figure, axes = plt.subplots(figsize=(5, 3.4), layout="constrained")
for name, run in runs.items():
    axes.plot(run.time, 1e3 * run.position, label=name)
axes.set(xlabel="time (s)", ylabel="position (mm)")
axes.legend()
plt.show()

# %% [markdown]
# To let `smajax close-loop` look for it in measured runs: a file in `smajax/model/effects/`, one line in `smajax/model/effects/library.py`.
