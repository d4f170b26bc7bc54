"""Whether the found model is worth more in control than the base model: `python -m studies.model_in_control.run --out OUT`.

Simulated benches with one hidden effect each: wire, effect and noise drawn by a seed. The loop is closed on their runs, a controller is
tuned on the base model and on the extended one, and both are judged on the true plant. Every bench is a file, so that an interrupted
study resumes; `--benches 4` is the fast setting.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time as clock
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

import jax.numpy as jnp
import numpy as np

import smajax as sma
from smajax.attribution.close_loop import close_loop
from smajax.control.tuned_on_models import QUICK, ControlComparison, tuned_on_models
from smajax.core.files import json_text, replace
from smajax.core.runtime import prepare
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.record import ModelParameter
from smajax.data.open_experiment import open_experiment

DT, NOISE = 0.1, 1e-4  # s, m
# Hidden effect -> smallest and largest of each coefficient, SI: what a bench may well have.
EFFECTS: dict[str, dict[str, tuple[float, float]]] = {
    "latent_heat": {"enthalpy": (1.0e4, 2.5e4)},
    "rising_convection": {"slope": (0.002, 0.008)},
    "radiation": {"emissivity": (0.4, 0.9)},
    "lead_resistance": {"resistance": (0.3, 1.5)},
    "coulomb_friction": {"limit": (0.1, 0.5)},
}
# Value of the wire -> share by which it may differ from the nominal one.
VARIED = {"convection_coefficient": 0.25, "specific_heat": 0.2, "recoverable_strain": 0.15}
KELVINS = {"austenite_start": 4.0, "austenite_finish": 4.0, "martensite_start": 4.0, "martensite_finish": 4.0}
NOMINAL = {
    "wire_diameter": 0.31e-3,
    "damping": 100.0,
    "load_mass": 0.8,
    "convection_coefficient": 90.0,
    "specific_heat": 500.0,
}
CONTROLLERS = ("pid", "sld")
MEASURES: dict[str, Callable[[list[float]], Any]] = {"longest": max, "mean": fmean}  # of the set points' settling times
COST = {"settling_time": 1.0}  # what is tuned is what is judged
NEAR = 0.98  # of a gain: a settling time that is 2 % longer is not told apart
EXPERIMENT = """\
title = "{name}"
[model]
wire = "flexinol_table_3_2"
load = "dead_weight"
drive = "voltage"
[model.parameters]
{known}
[unknown]
convection_coefficient = {{ low = "30 W/m^2/K", high = "300 W/m^2/K", start = "100 W/m^2/K" }}
specific_heat = {{ low = "200 J/kg/K", high = "1500 J/kg/K", start = "400 J/kg/K" }}
recoverable_strain = {{ low = 0.02, high = 0.07, start = 0.045 }}
austenite_start = {{ low = "50 degC", high = "90 degC", start = "68 degC" }}
austenite_finish = {{ low = "60 degC", high = "110 degC", start = "78 degC" }}
martensite_start = {{ low = "35 degC", high = "75 degC", start = "52 degC" }}
martensite_finish = {{ low = "25 degC", high = "65 degC", start = "42 degC" }}
[sampling]
step = "100 ms"
[time]
column = "t"
[channels.voltage]
role = "input"
column = "U"
unit = "V"
[channels.position]
role = "output"
column = "x"
unit = "mm"
noise = "0.1 mm"
"""
HELD = [
    "wire_length",
    "wire_diameter",
    "density",
    "ambient_temperature",
    "load_mass",
    "damping",
    "young_modulus_austenite",
    "young_modulus_martensite",
    "stress_slope_austenite",
    "stress_slope_martensite",
    "thermal_modulus",
    "resistivity_austenite",
    "resistivity_martensite",
]


def bench_truth(number: int) -> tuple[ActuatorModel, str]:
    """(the true model of a bench, its hidden effect)."""
    random = np.random.default_rng([2004, number])
    effect = list(EFFECTS)[number % len(EFFECTS)]
    preset = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage")
    values = dict(preset.parameters)

    def put(name: str, value: float) -> None:
        known = values.get(name)
        low, high = (known.low, known.high) if known else (0.0, math.inf)
        values[name] = ModelParameter(float(value), "given", low, high)

    for name, value in NOMINAL.items():
        put(name, value)
    for name, share in VARIED.items():
        put(name, values[name].value * (1.0 + random.uniform(-share, share)))
    shift = random.uniform(-1.0, 1.0)
    for name, kelvins in KELVINS.items():
        put(name, values[name].value + kelvins * shift)
    for coefficient, (low, high) in EFFECTS[effect].items():
        put(f"{effect}.{coefficient}", random.uniform(low, high))
    return ActuatorModel(
        title=f"bench {number}, {effect}",
        wire=preset.wire,
        load=preset.load,
        drive=preset.drive,
        law="",
        effects=(effect,),
        parameters=values,
    ), effect


def excitations() -> dict[str, np.ndarray]:
    """Voltage of each run over time, V, (n,): steps, a triangle, pulses, and levels that no fit sees."""
    t = np.arange(0.0, 60.0, DT)
    return {
        "steps": np.select([t < 15, t < 30, t < 45], [4.4, 0.0, 5.2], 2.5),
        "triangle": 5.2 * np.abs((t / 30.0) % 2.0 - 1.0) * (t < 60),
        "pulses": np.where((t % 15.0) < 6.0, 5.0, 1.0),
        "levels": np.select([t < 10, t < 25, t < 40], [5.2, 3.6, 4.6], 0.0),
    }


def write_bench(number: int, folder: Path) -> tuple[Path, ActuatorModel, str]:
    """(experiment file, truth, hidden effect) of a bench in `folder`."""
    truth, effect = bench_truth(number)
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng([2005, number])
    text = EXPERIMENT.format(
        name=truth.title,
        known="\n".join(f'{name} = "{truth.values[name]!r} {truth.table[name].unit}"' for name in HELD),
    )
    for name, volts in excitations().items():
        run = sma.simulate_dataset(truth.system, {"voltage": jnp.asarray(volts)}, dt=DT, tolerance=1e-6)
        position = 1e3 * (run["reading"].to_numpy() + random.normal(0.0, NOISE, volts.size))
        rows = np.stack([DT * np.arange(volts.size), volts, position], axis=1)
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header="t,U,x", comments="", fmt="%.6g")
        role = "held-out" if name == "levels" else "fit"
        text += f'[[runs]]\nname = "{name}"\nrole = "{role}"\nfile = "{name}.csv"\n'
    path = folder / "experiment.toml"
    path.write_text(text, encoding="utf-8")
    return path, truth, effect


def bench(number: int, out: Path, controllers: Sequence[str] = CONTROLLERS) -> dict[str, Any]:
    """One bench: what was found, and settling times by the gains of each model on the true plant."""
    began = clock.monotonic()
    path, truth, effect = write_bench(number, out / f"bench_{number:02d}")
    findings = close_loop(open_experiment(path), memory=path.parent / "fits")
    assert findings.base_model is not None
    assert findings.extended_model is not None
    models = {"base model": findings.base_model, "extended model": findings.extended_model}
    result: dict[str, Any] = {
        "bench": number,
        "hidden": effect,
        "verdict": str(findings.verdict),
        "found": list(findings.extended_model.effects),
    }
    if findings.added:
        for controller in controllers:
            result[controller] = _figures(
                tuned_on_models(models, ("true model", truth), controller, seed=number, effort=QUICK, weights=COST)
            )
    result["seconds"] = clock.monotonic() - began
    return result


def _figures(compared: ControlComparison) -> dict[str, Any]:
    by_model: dict[str, Any] = {
        one.model: {
            "settling_time": [loop.settling_time for loop in one.loops],
            "overshoot": [loop.overshoot for loop in one.loops],
            "steady_error": [loop.steady_error for loop in one.loops],
            "gains": dict(one.gains.values),
        }
        for one in compared.tuned
    }
    return {"seconds": compared.seconds, **by_model}


def gain(figures: dict[str, Any], over: Callable[[list[float]], Any] = max) -> float:
    """Longest settling time (what is tuned is the worst loop) by the base model's gains over that by the extended one's.

    A loop that never settles counts as its length. `over`: what is made of the set points' times, `statistics.fmean` for their mean.
    """
    length = figures["seconds"]
    base, extended = (
        over([min(one if one is not None else math.inf, length) for one in figures[model]["settling_time"]])
        for model in ("base model", "extended model")
    )
    return float(base / extended)


def settles(figures: dict[str, Any]) -> bool:
    """Whether any loop does, by the gains of either model."""
    return any(one is not None for model in ("base model", "extended model") for one in figures[model]["settling_time"])


def same_gains(figures: dict[str, Any]) -> bool:
    """Whether both models chose the same of the gains that were found."""
    return bool(figures["base model"]["gains"] == figures["extended model"]["gains"])


def summary(results: list[dict[str, Any]]) -> str:
    """Markdown: a row a controller and measure, and a row a bench. Benches where nothing settles say nothing and are counted apart."""
    lines = [
        "| controller | settling time | compared | nothing settles | same gains | no longer | at most 2 % longer | over 2 % shorter "
        "| median gain | smallest | largest |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for controller in CONTROLLERS:
        every = [one[controller] for one in results if controller in one]
        told = [one for one in every if settles(one)]
        for what, over in MEASURES.items():
            gains = np.asarray([gain(one, over) for one in told])
            if gains.size:
                counts = (
                    sum(map(same_gains, told)),
                    *(int(np.sum(each)) for each in (gains >= 1.0, gains >= NEAR, gains > 1.0 / NEAR)),
                )
                lines.append(
                    f"| {controller} | {what} | {gains.size} | {len(every) - gains.size} | {' | '.join(map(str, counts))} "
                    f"| {np.median(gains):.3f} | {gains.min():.3f} | {gains.max():.3f} |"
                )
    without = sum(not any(name in one for name in CONTROLLERS) for one in results)
    lines += ["", f"{len(results)} benches, of which on {without} nothing was found and nothing tuned."]
    lines += ["", "| bench | hidden | found | verdict | gain, pid | gain, sld |", "|---|---|---|---|---|---|"]
    for one in results:
        cells = [f"{gain(one[name]):.3f}" if name in one else "–" for name in CONTROLLERS]
        lines.append(
            f"| {one['bench']} | {one['hidden']} | {' + '.join(one['found']) or 'nothing'} | {one['verdict']} | {' | '.join(cells)} |"
        )
    return "\n".join(lines) + "\n"


def main(words: list[str] | None = None) -> None:
    """The study: a file a bench, and results.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--benches", type=int, default=50)
    parser.add_argument("--controllers", default=",".join(CONTROLLERS))
    parser.add_argument("--part", default="1/1", help="k/n: every n-th bench from the k-th on, for several processes")
    options = parser.parse_args(words)
    prepare()
    part, parts = (int(one) for one in options.part.split("/"))
    options.out.mkdir(parents=True, exist_ok=True)
    for number in range(part - 1, options.benches, parts):
        file = options.out / f"bench_{number:02d}.json"
        if not file.is_file():
            replace(file, json_text(bench(number, options.out, options.controllers.split(","))))
        print(f"bench {number + 1} of {options.benches}: {file.read_text(encoding='utf-8')[:200]!r}", file=sys.stderr)
    files = sorted(options.out.glob("bench_*.json"))
    results = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    replace(options.out / "results.md", summary(results))
    print(summary(results))


if __name__ == "__main__":
    main()
