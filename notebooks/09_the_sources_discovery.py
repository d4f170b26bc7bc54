# %% [markdown]
# # The source's own discovery, reproduced by the loop
#
# A mass hangs on a warm wire. Part of it is removed and put back: temperature and load return to their values, but the wire stays shorter than before. Elahinia
# (2004, sec. 3.5) measured 0.32, 0.27 and 0.28 mm (eq. 3.16). Earlier models, whose branches depend on the sign of dT/dt, predict none of it. He
# found that the stress rate is missing (eq. 3.17, 3.18): a branch is followed where $\dot T - \dot\sigma/C$ points into its range.
#
# Here the loop reproduces that discovery. The runs come from a generator that shares no code with the package, under the conditions with the stress rate. The loop
# gets the older conditions and the whole library. With `SMAJAX_FAST=1` it chooses only among the most similar effects.

# %%
import os
import tempfile
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from smajax.attribution.close_loop import close_loop  # noqa: E402
from smajax.data.experiment.load import load_experiment  # noqa: E402
from smajax.data.model_catalogue import CATALOGUE  # noqa: E402
from smajax.report.narrative import narrate  # noqa: E402
from studies.stress_rate.run import NET, write  # noqa: E402

folder = Path(tempfile.mkdtemp())
path = write(folder, "liang")
if os.environ.get("SMAJAX_FAST"):
    few = '"enhanced_conditions", "minor_loops", "latent_heat"'
    path.write_text(f"{path.read_text()}\n[effects]\nonly = [{few}]\n", encoding="utf-8")
experiment = load_experiment(path, CATALOGUE)

# %%
run = experiment.runs[0]
mass, position = 1e3 * run.inputs["mass"], 1e3 * run.output
off = np.flatnonzero(mass < mass.max() - 10.0)
net = float(np.mean(position[off[-1] + 40 : off[-1] + 80]) - np.mean(position[off[0] - 40 : off[0]]))
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 4))
axes[0].plot(run.time, mass)
axes[0].set_ylabel("mass, g")
axes[1].plot(run.time, position)
axes[1].set_ylabel("position, mm")
axes[1].set_xlabel("time, s")
print(
    f"after the mass is back the load hangs {abs(net):.2f} mm from its earlier position; measured for 96 g: {[1e3 * one for one in NET]} mm"
)

# %% [markdown]
# ## The loop with the older conditions

# %%
findings = close_loop(experiment)
print(findings.verdict)
narrative = narrate(findings)
print(*narrative.summary, sep="\n")
for done, why in zip(findings.rounds, narrative.rounds, strict=True):
    print(done.number, done.chosen or "nothing added", "-", why)

# %%
added = [effect for effect in findings.effects if effect.added]
share = added[0].coefficients["share"].value
held_out = next(one for one in findings.runs if one.role == "held-out")
print(f"share of the wire that follows the stress rate too: {share:.4f}")
figure, axis = plt.subplots(figsize=(7, 3))
axis.plot(held_out.time, 1e3 * held_out.measured, ".", ms=2, label="measured, held out")
axis.plot(held_out.time, 1e3 * held_out.before, label=f"without: {1e3 * held_out.rmse_before:.2f} mm")
axis.plot(held_out.time, 1e3 * held_out.after, label=f"with the stress rate: {1e3 * held_out.rmse_after:.3f} mm")
axis.set_xlabel("time, s")
axis.set_ylabel("position, mm")
axis.legend()

# %% [markdown]
# ## The loop with the enhanced conditions
#
# With the conditions that include the stress rate the loop adds nothing, and says so. The whole study, with both laws and all candidates, is `python -m studies.stress_rate.run`.

# %%
path = write(folder / "enhanced", "enhanced")
if os.environ.get("SMAJAX_FAST"):
    path.write_text(f'{path.read_text()}\n[effects]\nonly = ["minor_loops", "latent_heat"]\n', encoding="utf-8")
content = close_loop(load_experiment(path, CATALOGUE))
print(content.verdict, narrate(content).summary[0])
