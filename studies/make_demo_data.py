"""Make the demo's virtual dead-weight bench: two sets of six runs, from the reference integration with noise.

    python -m studies.make_demo_data

Set `latent` hides an effect the base model lacks (a latent heat); set `complete` hides nothing. The bench updates its
amplifier every sample and holds it in between, so a voltage read at one sample acts until the next. `truth.toml` is for
judging only; the loop never reads it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studies.reference.wire_reference import DeadWeightParameters, simulate_dead_weight

FOLDER = Path(__file__).parents[1] / "smajax" / "data" / "demo"
STEP = 0.1  # s, sampling and amplifier update
LENGTH = 60.0  # s
NOISE = 1e-4  # m
LARGEST_OFFSET = 3e-4  # m
TIMES = np.arange(round(LENGTH / STEP) + 1) * STEP
Vector = NDArray[np.float64]

# The bench carries a thicker wire than the source's (0.31 mm for 0.15 mm): one that a 10 Hz log can follow.
DIAMETER = 0.31e-3  # m
AREA = np.pi * DIAMETER**2 / 4
DAMPING = 100.0  # N s/m, about critical for this wire and mass

BENCH = DeadWeightParameters(
    diameter=DIAMETER,
    damping=DAMPING,
    resistance_martensite=76e-8 / AREA,
    resistance_austenite=84e-8 / AREA,
)
LATENT = replace(
    BENCH,
    convection_coefficient=90.0,
    specific_heat=560.0,
    recoverable_strain=0.0435,
    austenite_start=71.0,
    austenite_finish=85.0,
    martensite_start=55.5,
    martensite_finish=42.5,
    latent_heat=24.2e3,  # table 3.2 prints it, eq. 3.1 leaves it out
)
COMPLETE = replace(
    BENCH,
    convection_coefficient=104.0,
    specific_heat=640.0,
    recoverable_strain=0.0405,
    austenite_start=65.5,
    austenite_finish=78.0,
    martensite_start=50.0,
    martensite_finish=38.0,
    ambient_temperature=21.5,
)
TRUTH_UNITS = {
    "convection_coefficient": "W/(m^2 K)",
    "specific_heat": "J/(kg K)",
    "recoverable_strain": "-",
    "austenite_start": "degC",
    "austenite_finish": "degC",
    "martensite_start": "degC",
    "martensite_finish": "degC",
    "ambient_temperature": "degC",
    "latent_heat": "J/kg, the hidden effect; 0 where there is none",
}


@dataclass(frozen=True)
class Run:
    """One run's program on TIMES: volts and kilograms, each held until the next sample."""

    name: str
    role: str
    voltage: Vector
    mass: Vector


def levels(*pairs: tuple[float, float]) -> Vector:
    """(seconds, value) in turn, the last one kept to the end."""
    ends = np.cumsum([seconds for seconds, _ in pairs])
    at = np.searchsorted(ends - STEP / 2, TIMES, side="right")
    return np.array([value for _, value in pairs])[np.minimum(at, len(pairs) - 1)]


def ramps(*points: tuple[float, float]) -> Vector:
    """Straight lines through (time, value), rounded to the amplifier's millivolt."""
    return np.round(np.interp(TIMES, [t for t, _ in points], [v for _, v in points]), 3)


def decaying_sine(mean: float, amplitude: float, period: float, decay: float) -> Vector:
    """A sine of shrinking amplitude: minor loops nested in one another."""
    return np.round(mean + amplitude * np.exp(-TIMES / decay) * np.sin(2 * np.pi * TIMES / period), 3)


def programs(full: float, pulse: float) -> list[Run]:
    """Six runs; `full`: volts that complete the transformation under 640 g; `pulse`: seconds that half do."""
    light, heavy = np.full(TIMES.size, 0.64), np.full(TIMES.size, 1.07)
    steps = levels((2, 0), (12, full), (10, 0), (10, 0.93 * full), (10, 0.45 * full), (6, 1.1 * full), (10, 0))
    pulses = levels(
        *[(1, 0.0)],
        *[
            pair
            for on in np.array([0.8, 1.05, 1.3, 1.6]) * pulse
            for pair in ((on, 1.15 * full), (6.0 - on / 2, 0.3 * full))
        ],
        *[pair for off in (2.0, 3.0, 4.0) for pair in ((0.8 * pulse, 1.1 * full), (off, 0.5 * full))],
        *[pair for on in np.array([1.0, 1.3]) * pulse for pair in ((on, full), (3.0, 0.0))],
        (60, 0.0),
    )
    triangle = ramps((0, 0.4 * full), (20, 1.08 * full), (40, 0.4 * full), (45, 1.05 * full), (50, 0.3 * full))
    heavier = levels(
        (2, 0), (10, 1.05 * full), (8, 0.75 * full), (8, 1.12 * full), (12, 0.6 * full), (8, full), (12, 0)
    )
    swapped = levels((22, 1.07), (12, 0.56), (14, 1.07), (12, 0.56))
    return [
        Run("steps", "fit", steps, light),
        Run("triangle", "fit", triangle, light),
        Run("pulses", "fit", pulses, light),
        Run("heavier", "fit", heavier, heavy),
        Run("mass_change", "held-out", levels((2, 0), (32, 0.95 * full), (26, 0.69 * full)), swapped),
        Run("decaying_sine", "held-out", decaying_sine(0.8 * full, 0.36 * full, 12.0, 45.0), light),
    ]


def measure(truth: DeadWeightParameters, run: Run, random: np.random.Generator) -> Vector:
    """Measured position, m, on TIMES: the reference's, a constant offset for the run, and white noise."""
    turns = [k for k in range(1, TIMES.size) if np.any(np.diff([run.voltage[k - 1 : k + 1], run.mass[k - 1 : k + 1]]))]
    starts = [0, *[k for k in turns if k < TIMES.size - 1]]
    ends = [float(TIMES[k]) for k in [*starts[1:], TIMES.size - 1]]
    segments = [(end, float(run.voltage[k]), float(run.mass[k])) for end, k in zip(ends, starts, strict=True)]
    position = simulate_dead_weight(truth, segments, TIMES)["position"]
    return position + random.uniform(-LARGEST_OFFSET, LARGEST_OFFSET) + random.normal(0, NOISE, TIMES.size)


def write_runs(folder: Path, truth: DeadWeightParameters, runs: list[Run], random: np.random.Generator) -> None:
    """One CSV per run, in seconds, volts, grams and millimetres."""
    for run in runs:
        rows = zip(TIMES, run.voltage, 1e3 * run.mass, 1e3 * measure(truth, run, random), strict=True)
        lines = [f"{t:.2f},{v:.6g},{m:.6g},{x:.4f}" for t, v, m, x in rows]
        (folder / f"{run.name}.csv").write_text("\n".join(["time_s,voltage_V,mass_g,position_mm", *lines]) + "\n")


def write_truth(folder: Path, truth: DeadWeightParameters, seed: int) -> None:
    """The values behind the runs, for judging a recovered fit."""
    lines = ["# The values behind these runs, SI. For judging only: the loop never reads this file."]
    lines += [f"# All else: wire flexinol_table_3_2 of 0.31 mm. Noise {NOISE} m, seed {seed}.", "[parameters]"]
    lines += [f"{name} = {getattr(truth, name)}  # {unit}" for name, unit in TRUTH_UNITS.items()]
    (folder / "truth.toml").write_text("\n".join(lines) + "\n")


def write_experiment(folder: Path, truth: DeadWeightParameters, runs: list[Run]) -> None:
    """What the experimenter knows and asks."""
    head = EXPERIMENT.format(
        damping=DAMPING, ambient=truth.ambient_temperature, step=round(1e3 * STEP), noise=1e3 * NOISE
    )
    tables = [f'[[runs]]\nname = "{r.name}"\nrole = "{r.role}"\nfile = "{r.name}.csv"\n' for r in runs]
    (folder / "experiment.toml").write_text("\n".join([head, *tables]))


EXPERIMENT = """title = "Virtual dead-weight bench"

[model]
wire = "flexinol_table_3_2"
load = "dead_weight"
drive = "voltage"

[model.parameters]  # known values
ambient_temperature = "{ambient:g} degC"
wire_diameter = "0.31 mm"
damping = "{damping:g} N s/m"
# Data sheet of the wire; resistivities from the ohms of its length. Without these lines they are fitted as well.
young_modulus_austenite = "75 GPa"
young_modulus_martensite = "28 GPa"
stress_slope_austenite = "6.89 MPa/K"
stress_slope_martensite = "6.89 MPa/K"
thermal_modulus = "0.55 MPa/K"
resistivity_austenite = "84 uohm cm"
resistivity_martensite = "76 uohm cm"

[unknown]  # fitted: bounds and start
convection_coefficient = {{ low = "30 W/m^2/K", high = "300 W/m^2/K", start = "120 W/m^2/K" }}
specific_heat = {{ low = "200 J/kg/K", high = "1500 J/kg/K", start = "322 J/kg/K" }}
recoverable_strain = {{ low = "0.02", high = "0.07", start = "0.0461" }}
austenite_start = {{ low = "50 degC", high = "90 degC", start = "68 degC" }}
austenite_finish = {{ low = "60 degC", high = "110 degC", start = "78 degC" }}
martensite_start = {{ low = "35 degC", high = "75 degC", start = "52 degC" }}
martensite_finish = {{ low = "25 degC", high = "65 degC", start = "42 degC" }}

[nuisance]
offset = true  # one position offset per run

[sampling]
step = "{step} ms"

[channels.voltage]
role = "input"
column = "voltage_V"
unit = "V"

[channels.mass]
role = "input"
column = "mass_g"
unit = "g"

[channels.position]
role = "output"
column = "position_mm"
unit = "mm"
noise = "{noise:g} mm"

[time]
column = "time_s"
unit = "s"
"""


def main() -> None:
    """Write both sets into the package."""
    sets = (("latent", LATENT, 4.75, 3.3, 20040001), ("complete", COMPLETE, 4.68, 3.0, 20040002))
    for name, truth, full, pulse, seed in sets:
        folder = FOLDER / name
        folder.mkdir(parents=True, exist_ok=True)
        runs = [replace(run, voltage=np.round(run.voltage, 3)) for run in programs(full, pulse)]
        write_runs(folder, truth, runs, np.random.default_rng(seed))
        write_truth(folder, truth, seed)
        write_experiment(folder, truth, runs)


if __name__ == "__main__":
    main()
