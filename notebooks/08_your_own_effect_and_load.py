# %% [markdown]
# # Your own effect and your own load
#
# An effect is a class that inherits from the contract of the equation it changes and overrides one of its methods. A load is one equation of motion. Neither needs registering to be used.

# %%
import dataclasses

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from smajax.core.parameters import get_parameters, parameter, parameters, set_parameters  # noqa: E402
from smajax.model.effects.base import AbstractEffect  # noqa: E402
from smajax.model.effects.candidate import Candidate  # noqa: E402
from smajax.model.load.base import AbstractMovingLoad  # noqa: E402
from smajax.model.presets import flexinol_table_3_2, flexinol_voltage  # noqa: E402
from smajax.model.system import System  # noqa: E402
from smajax.model.types import Scalar  # noqa: E402
from smajax.model.wire.form import IntegratedForm  # noqa: E402
from smajax.model.wire.heat import HeatTerm  # noqa: E402
from smajax.simulation.compiled import simulate_compiled  # noqa: E402

# %% [markdown]
# The effect: a fan that comes on slowly and cools the air around the wire over time.


# %%
class FanComingOn(AbstractEffect, HeatTerm):
    """The air cools by `drop` with the time constant `delay`."""

    drop: Scalar = parameter("K", 0.0, 50.0, "by how much the air gets colder in the end", default=0.0)
    delay: Scalar = parameter("s", 0.1, 1e3, "time constant of the fan", default=10.0)

    effect_name = "fan_coming_on"
    candidate = Candidate(
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
class TiltingWeight(AbstractMovingLoad):
    r"""$m \ddot x + b \dot x + m g \cos(x/a) = A_w \sigma$."""

    load_mass: Scalar = parameter("kg", 1e-4, 1e3, "weight")
    damping: Scalar = parameter("N s/m", 0.0, 1e4, "friction of the pivot")
    lever_length: Scalar = parameter("m", 1e-3, 1e2, "a: length of the lever that the wire pulls on")
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
wire = flexinol_table_3_2()
wire = dataclasses.replace(wire, constitutive=dataclasses.replace(wire.constitutive, form=IntegratedForm()))
still = System(wire, load, flexinol_voltage())
fan = dataclasses.replace(still, effects=(FanComingOn(drop=4.0, delay=20.0),))
print([name for name in parameters(fan) if name.startswith("fan_coming_on") or name in parameters(load)])

dt = 0.02
time = np.arange(4001) * dt  # s
inputs = {"voltage": np.where(time % 20.0 < 10.0, 4.8, 0.0)}  # four pulses
runs = {"still air": simulate_compiled(still, inputs, dt), "a fan comes on": simulate_compiled(fan, inputs, dt)}
strokes = {name: [run.position[(time // 20.0) == pulse].max() for pulse in range(4)] for name, run in runs.items()}
for name, each in strokes.items():
    print(f"{name}: " + ", ".join(f"{1e3 * stroke:.1f}" for stroke in each) + " mm")

# %% [markdown]
# At its base value an effect changes nothing, to the last bit: the extended model contains the base model.

# %%
nothing = dataclasses.replace(still, effects=(FanComingOn.base(),))
same = np.array_equal(simulate_compiled(nothing, inputs, dt).position, runs["still air"].position)
print("the base value changes nothing:", same)

# %% [markdown]
# By how much does the last stroke change for one kelvin of the fan?

# %%
step = 1e-3
ends = [
    simulate_compiled(set_parameters(fan, {"fan_coming_on.drop": 4.0 + sign * step}), inputs, dt).position[3000:].max()
    for sign in (1.0, -1.0)
]
slope = float(ends[0] - ends[1]) / (2.0 * step)
print(f"{1e3 * slope:.3f} mm a kelvin by differences, at {float(get_parameters(fan, ['fan_coming_on.drop'])[0]):g} K")

# %%
figure, axes = plt.subplots(figsize=(5, 3.4), layout="constrained")
for name, run in runs.items():
    axes.plot(run.time, 1e3 * run.position, label=name)
axes.set(xlabel="time (s)", ylabel="position (mm)")
axes.legend()

# %% [markdown]
# To let `smajax close-loop` look for it in measured runs: a file in `smajax/model/effects/`, one line in `smajax/model/effects/library.py`.
