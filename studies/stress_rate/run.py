"""The source's own discovery, made again by the loop (Elahinia 2004, sec. 3.5, eq. 3.16 to 3.18).

    python -m studies.stress_rate.run --out OUT

A mass hangs on a wire that a constant voltage keeps warm; it is taken off and put back. Measured is a net shortening that
Liang's conditions, which ask for the sign of dT/dt, do not have; the source adds the stress rate to them. Here the runs
come from the generator of `studies/attribution_benchmark`, which shares no code with the package, under the enhanced
conditions. The loop is given Liang's and has to find what is missing; given the enhanced ones it has to be content.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from smajax.attribution.close_loop import close_loop
from smajax.attribution.findings import Findings
from smajax.core.runtime import prepare
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.report.write import write_report
from studies.attribution_benchmark.rigs import DEAD_WEIGHT, show
from studies.attribution_benchmark.runs import Clock, Marks, Run, command
from studies.attribution_benchmark.write import experiment_text, table_text

CLOCK = Clock(0.1, 10, 601)
HEAVY, LIGHT = 0.80, 0.64  # kg
STRESS = 104e6  # Pa, of the heavy one
WIRE = dataclasses.replace(DEAD_WEIGHT.wire, convection_coefficient=138.0, recoverable_strain=0.044)
RIG = dataclasses.replace(DEAD_WEIGHT, clock=CLOCK)
SEED = 316
GIVEN = {  # what a data sheet gives: the source's wire is known
    "young_modulus_austenite": "Pa",
    "young_modulus_martensite": "Pa",
    "stress_slope_austenite": "Pa/K",
    "stress_slope_martensite": "Pa/K",
    "thermal_modulus": "Pa/K",
    "resistivity_austenite": "ohm m",
    "resistivity_martensite": "ohm m",
}
NET = (0.32e-3, 0.27e-3, 0.28e-3)  # m, eq. 3.16: measured for 96 g taken off and put back


def runs() -> tuple[Run, ...]:
    """Held at a warmth inside the range while the mass comes off and goes back; and heated and cooled under one mass."""
    m = Marks.of(WIRE, STRESS)

    def held(name: str, role: str, share: float, *masses: tuple[float, float]) -> Run:
        warm = CLOCK.levels((0.05, m.off), (1.0, m.hot(share)))
        return Run(name, role, command(WIRE, warm), CLOCK.levels(*masses))

    once = (0.45, HEAVY), (0.25, LIGHT), (1.0, HEAVY)
    twice = (0.4, HEAVY), (0.15, LIGHT), (0.15, HEAVY), (0.15, 0.9 * LIGHT), (1.0, HEAVY)
    ramp = CLOCK.ramps((0, m.off), (0.45, m.full + 10), (0.9, m.cold - 10), (1, m.cold - 10))
    constant = np.full(CLOCK.count, HEAVY)
    return (
        held("off and back", "fit", 0.35, *once),
        held("off twice", "fit", 0.5, *twice),
        held("warmer", "fit", 0.6, *once),
        Run("ramp", "fit", command(WIRE, ramp), constant),
        held("held-out twice", "held-out", 0.42, *twice),
    )


def write(out: Path, law: str) -> Path:
    """The experiment's folder, for a loop that believes in `law`."""
    random = np.random.default_rng(SEED)
    out.mkdir(parents=True, exist_ok=True)
    made = runs()
    for run in made:
        read = show(RIG, WIRE, run, {})
        noisy = read + random.normal(0.0, RIG.noise, read.size)
        (out / f"{run.name}.csv").write_text(table_text(RIG, run, noisy), encoding="utf-8")
    given = "\n".join(f'{name} = "{getattr(WIRE, name):.6g} {unit}"' for name, unit in GIVEN.items())
    text = experiment_text(RIG, made, GIVEN)
    text = text.replace("[model.parameters]", f'law = "{law}"\n\n[model.parameters]\n{given}')
    (out / "experiment.toml").write_text(text, encoding="utf-8")
    return out / "experiment.toml"


def closed(out: Path, law: str) -> Findings:
    """The loop on it, its report written beside."""
    findings = close_loop(load_experiment(write(out / law, law), CATALOGUE), memory=out / law / "fits")
    write_report(findings, out / law / "report")
    return findings


def told(findings: Findings) -> dict[str, Any]:
    """What is asserted of it; the enhanced conditions are no candidate where the model begins with them."""
    share = next((effect for effect in findings.effects if effect.name == "enhanced_conditions"), None)
    result = share.coefficients.get("share") if share else None
    return {
        "verdict": findings.verdict,
        "added": [effect.name for effect in findings.effects if effect.added],
        "share": result.value if result else None,
        "standard_error": result.standard_error if result else None,
        "rmse": {run.name: (run.rmse_before, run.rmse_after) for run in findings.runs},
        "noise": findings.noise_sigma,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    prepare()
    result = {law: told(closed(options.out, law)) for law in ("liang", "enhanced")}
    (options.out / "results.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
