"""C22: where the stability conditions of section 4.8.3 hold, and where the simulated loop really converges."""

from __future__ import annotations

import itertools

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.core.parameters import set_parameters
from smajax.model.types import Scalar
from smajax.report.drawing import BLUE, GREY, RED, is_upright, keyed, named, panels, styled

from .backstepping_runs import ON_ITS_PLANT, on_heating_curve, plant, runs, stacked
from .row import Result, Row
from .unprinted import backstepping

TARGET = 20.0  # degrees
SECONDS = 60.0  # the slowest decay that has to be seen, at K = 18 1/s, has a time constant of 18 s
FROM = 1.0  # s: what the start has of kinetic energy has died by then, also in an arm that goes nowhere
LAST = 2.0  # s, over which a run is evaluated
NEAR = np.radians(1.0)
# Within eq. 4.82 and 4.84 as printed, and V grows there.
BEYOND = (-0.2, -0.9)  # (K in 1/s, epsilon)


def converging(time: np.ndarray, off: np.ndarray, gain: float) -> bool:
    """Whether a run comes within a degree, or below a decay by the slower root of x_1'' + K x_1' + x_1 = 0, to a degree.

    The decay starts at the largest |x_1| after `FROM`. At K = 0 it does not fall, and only the degree counts.
    """
    last, judged = time >= time[-1] - LAST, time >= FROM
    left = np.abs(off[last])
    if left.max() < NEAR:
        return True
    slow = -np.roots([1.0, gain, 1.0]).real.max()
    if slow <= 1e-9:
        return False
    peak = int(np.abs(off[judged]).argmax())
    decay = np.abs(off[judged][peak]) * np.exp(-slow * (time[last] - time[judged][peak]))
    return bool((left < decay + NEAR).all())


def smallest_decay(gain: Scalar, epsilon: Scalar) -> Scalar:
    """Least eigenvalue of the matrix of -dV/dt, V of eq. 4.81 along x_1'' + K x_1' + x_1 = 0; by derivatives alone."""

    def decay(x: jax.Array) -> Scalar:
        lyapunov = lambda x: 0.5 * (x[0] ** 2 + x[1] ** 2) + epsilon * x[0] * x[1]  # noqa: E731
        moving = jnp.stack([x[1], -x[0] - gain * x[1]])
        return -jnp.vdot(jax.grad(lyapunov)(x), moving)

    return jnp.linalg.eigvalsh(jax.hessian(decay)(jnp.zeros(2)))[0]


def printed(gain: np.ndarray, epsilon: np.ndarray) -> np.ndarray:
    """Eq. 4.82 and 4.84."""
    return (
        (np.abs(epsilon) < 1.0)
        & (gain * epsilon > 0.0)
        & (gain * epsilon * (gain - epsilon) > (gain * epsilon) ** 2 / 4)
    )


def work(fast: bool) -> Result:
    """The two conditions over (K, epsilon); runs from a grid of angles and velocities for each K."""
    gains, epsilons = np.meshgrid(np.linspace(-1.0, 12.0, 261), np.linspace(-0.9925, 0.9925, 398))
    decays = np.asarray(jax.vmap(smallest_decay)(jnp.asarray(gains.ravel()), jnp.asarray(epsilons.ravel())))
    falls = (decays > 0.0).reshape(gains.shape)
    said = printed(gains, epsilons)
    beyond = float(smallest_decay(*(jnp.asarray(value) for value in BEYOND)))
    allowed = bool(printed(*(np.asarray(value) for value in BEYOND)))

    system = plant()
    tuned = backstepping(system)
    angles = (-60.0, -30.0, 0.0, 30.0, 60.0) if fast else (-60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0)
    rates = (-2.0, 0.0, 2.0) if fast else (-2.0, -1.0, 0.0, 1.0, 2.0)
    tried = (0.0, 0.5, 1.7, 10.0, 30.0) if fast else (0.0, 0.2, 1.7, 10.0, 18.0, 30.0)
    grid = list(itertools.product(tried, angles, rates))
    starts = [
        on_heating_curve(system, jnp.radians(jnp.asarray(TARGET + angle)), jnp.asarray(rate)) for _, angle, rate in grid
    ]
    swept = [set_parameters(tuned, {"damping_gain": gain}) for gain, _, _ in grid]
    loops, _ = runs([system] * len(grid), swept, [TARGET] * len(grid), fast, SECONDS, stacked(starts))
    off = loops.run.position - np.radians(TARGET)
    there = [converging(loops.run.time[0], one, gain) for one, (gain, _, _) in zip(off, grid, strict=True)]
    share = {
        gain: float(np.mean([ok for ok, one in zip(there, grid, strict=True) if one[0] == gain])) for gain in tried
    }
    inside = [gain for gain in tried if 0.0 < gain < 20.0]
    damping_rate = float(system.load.damping) / float(system.load.inertia({}))

    def draw(figure: Figure) -> None:
        if is_upright(figure):
            top, *below = panels(figure, 1 + len(tried))
        else:
            figure.set_layout_engine("constrained")
            grid_of = figure.add_gridspec(2, len(tried))
            places = [grid_of[0, :], *(grid_of[1, k] for k in range(len(tried)))]
            top, *below = styled(*(figure.add_subplot(place) for place in places))
        top.contourf(gains, epsilons, falls, levels=[0.5, 1.5], colors=[BLUE], alpha=0.25)
        top.contour(gains, epsilons, said, levels=[0.5], colors=[RED], linestyles="--")
        top.plot([], [], color=BLUE, linewidth=6, alpha=0.25, label="dV/dt < 0 (by derivatives)")
        top.plot([], [], color=RED, linestyle="--", label="within: eq. 4.82, 4.84 as printed")
        top.axvline(0.0, color=GREY, linewidth=0.8)
        keyed(top)
        named(top, "K (1/s)", "epsilon")
        for k, (axes, gain) in enumerate(zip(below, tried, strict=True)):
            for ok, one in zip(there, grid, strict=True):
                if one[0] == gain:
                    axes.plot(one[1], one[2], "o" if ok else "x", color=BLUE if ok else RED, markersize=4)
            named(axes, "x_1 (°)", "x_2 (rad/s)" if k == 0 or is_upright(figure) else " ", f"K = {gain:g} 1/s")

    return Result(
        holds=bool(min(share[gain] for gain in inside) == 1.0 and share[0.0] < 0.5 and share[30.0] < 0.5),
        found=f"the equation of motion is stable for every K > 0 (dV/dt < 0 for eps < 4 K/(4 + K^2), 0 < eps < 1), the loop with the wire at the K tried between 0 and c/I = {damping_rate:.0f} 1/s: from {len(angles) * len(rates)} starts it converges (o, and x where not) in "
        f"{', '.join(f'{100.0 * value:.0f} % (K = {gain:g})' for gain, value in share.items())} of cases",
        numbers={
            "least_decay_beyond": beyond,
            "printed_allows_beyond": float(allowed),
            **{f"converging_share_K_{gain:g}": value for gain, value in share.items()},
            "damping_over_inertia_1/s": damping_rate,
        },
        draw=draw,
        caveat=f"{ON_ITS_PLANT}. The matrix of eq. 4.83 has -K eps where -eps belongs, and a factor 1/2 too many. The determinant of "
        "eq. 4.84 is worked out rightly from that matrix; as it stands the condition allows even K < 0, such as K = "
        f"{BEYOND[0]:g}, eps = {BEYOND[1]:g}, where V grows (least eigenvalue of -dV/dt {beyond:.2f}). A run converges when it ends within a degree, or below the decay by the "
        "slower root of the equation of motion plus a degree, evaluated from 1 s on; at K = 0 that decay does not fall. The loop adds what the analysis leaves out: "
        f"eq. 4.76 uses the wanted acceleration instead of the true one, so that above K = c/I = {damping_rate:.0f} 1/s an arm at rest asks "
        "for the wrong curve, and stays.",
    )


ROW = Row(
    "C22",
    "sec. 4.8.3",
    "stability conditions (4.82), (4.84) and the simulated loop",
    "checked numerically over the region, with the stable range of K shown",
    work,
)
