"""How the arm's unprinted geometry was chosen: `python -m studies.arm_geometry [--fast]`.

The source prints neither the link's length, nor the spring's lever, nor the amplifier's gain. The length follows from
sigma_0 = 75 MPa at -45 degrees, the gain from the power that makes 7.2 and 7.3 V differ (errata). What is left is the
lever of the spring and, because the printed eps_L = 0.04 ends at 81 degrees, eps_L. The study ends a step of 7.0, 7.2,
7.3 and 8.0 V at every pair of the two, in one batch, and shows where M1 to M4 hold together.
"""

from __future__ import annotations

import sys
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.core.parameters import set_parameters
from smajax.core.runtime import prepare
from smajax.model.presets import build
from smajax.report.drawing import BLUE, GREY, keyed, named, panels
from smajax.simulation.simulate import simulate

PICTURE = Path(__file__).parent / "arm_geometry.png"
VOLTS = (7.0, 7.2, 7.3, 8.0)
SECONDS = 30.0


def sweep(levers: np.ndarray, strains: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """(angle at the end, degrees; smallest stress, Pa), each of shape (levers, strains, volts)."""
    arm = build("niti_table_3_1", "arm", "amplified_voltage")

    @eqx.filter_jit
    def batch(lever: jax.Array, strain: jax.Array, volts: jax.Array) -> tuple[jax.Array, jax.Array]:
        def one(lever: jax.Array, strain: jax.Array, volts: jax.Array) -> tuple[jax.Array, jax.Array]:
            system = set_parameters(arm, {"spring_lever": lever, "recoverable_strain": strain})
            run = simulate(system, {"voltage": jnp.full(round(SECONDS / dt) + 1, volts)}, dt)
            return jnp.degrees(run.position[-1]), run.stress.min()

        return jax.vmap(one)(lever, strain, volts)

    grid = np.meshgrid(levers, strains, np.array(VOLTS), indexing="ij")
    end, stress = batch(*(jnp.asarray(axis.ravel()) for axis in grid))
    return np.asarray(end).reshape(grid[0].shape), np.asarray(stress).reshape(grid[0].shape)


def holding(end: np.ndarray) -> np.ndarray:
    """Where M1 to M4 hold: 7.2 V stops inside the range, 7.3 V goes through to 85 to 95 degrees, the order is right."""
    low, middle, high, _ = np.moveaxis(end, -1, 0)
    return (middle < 60.0) & (high > 85.0) & (high < 95.0) & (low + 5.0 < middle)


def main(fast: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Print the table, draw the picture; (levers, strains, where M1 to M4 hold)."""
    levers = np.linspace(0.03, 0.06, 7 if fast else 31)
    strains = np.array([0.04, 0.0415, 0.043, 0.0445])
    end, stress = sweep(levers, strains, 0.05 if fast else 0.01)
    holds = holding(end)
    for j, strain in enumerate(strains):
        inside = levers[holds[:, j]]
        where = f"{1e3 * inside.min():.0f} to {1e3 * inside.max():.0f} mm" if inside.size else "no lever"
        slack = 1e-6 * stress[holds[:, j], j, 2].min() if inside.size else float("nan")
        print(f"eps_L = {strain:.4f}: M1 to M4 hold for {where}; least stress at 7.3 V there {slack:.0f} MPa")
    if not fast:
        figure = Figure(figsize=(9.0, 4.2))
        for axes, j in zip(panels(figure, 1, 2), (0, 2), strict=True):
            for k, volts in enumerate(VOLTS):
                axes.plot(1e3 * levers, end[:, j, k], color=BLUE, alpha=0.3 + 0.2 * k, label=f"{volts} V")
            inside = 1e3 * levers[holds[:, j]]
            if inside.size:
                axes.axvspan(inside.min(), inside.max(), color=GREY, alpha=0.25, linewidth=0, label="M1 to M4 hold")
            axes.axvline(48.0, linestyle=":", color=GREY)
            keyed(axes)
            named(axes, "lever of the spring (mm)", "angle after 30 s (°)", f"eps_L = {strains[j]}")
        figure.savefig(PICTURE, dpi=90)
    return levers, strains, holds


if __name__ == "__main__":
    prepare()
    main("--fast" in sys.argv)
