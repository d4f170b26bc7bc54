"""Loads beyond a usual study: `python -m studies.benchmarks.load WHAT --count N`; prints time and peak memory as JSON.

`text`: a log of N MB as text with ten columns, of which three are read. `samples`: a run of N samples through `identify`,
from its text log to its numbers. `day`: N hours of an arm that is simulated at 5 ms and kept every second. `runs`: N runs
of 300 samples in one experiment through `close_loop`, with a few candidates.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from smajax.core.operating_system import peak_memory
from smajax.core.runtime import prepare

COLUMNS = 10  # of the text log
BLOCK = 50_000  # lines written at once
DAY_STEP = 0.005  # s
DAY_KEPT = 200  # steps
STRESSES = 60.0, 180.0  # MPa
TRUTH = {"recoverable_strain": 0.04, "austenite_finish": 95.0}
NOISE = 2e-4  # of strain
RUN_SAMPLES = 300
CYCLE = 1_000_000  # samples of a run that are simulated
CANDIDATES = ("thermal_expansion", "stress_dependent_strain", "stress_dependent_width", "sensor_gain")
COUPON = """\
[model]
wire = "flexinol_isobaric"
load = "coupon"
drive = "none"
[unknown.recoverable_strain]
low = "1 %"
high = "8 %"
start = "3 %"
[unknown.austenite_finish]
low = "85 degC"
high = "120 degC"
start = "105 degC"
[nuisance]
offset = true
[channels.temperature]
role = "input"
column = "T"
unit = "degC"
[channels.strain]
role = "output"
column = "strain"
unit = "1"
noise = "{noise}"
[effects]
only = [{only}]
"""
RUN = '[[runs]]\nname = "{name}"\nrole = "{role}"\nfile = "{name}.csv"\n[runs.inputs]\nstress = "{stress:.3f} MPa"\n'


Told = dict[str, float | str]
Work = Callable[[], Told]


def _text(megabytes: int, place: Path) -> Work:
    from smajax.data.readers.read import read_table

    draw = np.random.default_rng(0).normal(size=(BLOCK, COLUMNS))
    names = [f"c{number}" for number in range(COLUMNS)]
    block = "\n".join(",".join(f"{value:.6f}" for value in row) for row in draw) + "\n"
    file = place / "log.csv"
    with file.open("w", encoding="utf-8") as log:
        log.write(",".join(names) + "\n")
        for _ in range(-(-megabytes * 10**6 // len(block))):
            log.write(block)
    return lambda: {
        "MB": file.stat().st_size / 1e6,
        "rows": read_table(file, set(names[:3])).column("c2").size,
    }


def _cycles(samples: int, number: int) -> np.ndarray:
    """Temperature of a coupon, C: heated and cooled, each run to another end."""
    top = 140.0 - 3.0 * (number % 7)
    whole = np.linspace(0.0, 4.0 if samples > RUN_SAMPLES else 2.0, samples)
    return np.asarray(20.0 + (top - 20.0) * np.abs(whole - 2.0 * np.round(whole / 2.0)))


def _experiment(place: Path, runs: int, samples: int) -> Path:
    """`_written`, by a process of its own: the memory that takes is not what is measured here."""
    writer = get_context("spawn").Process(target=_written, args=(place, runs, samples))
    writer.start()
    writer.join()
    if writer.exitcode:
        raise RuntimeError(f"the experiment could not be written (exit code {writer.exitcode})")
    return place / "experiment.toml"


def _written(place: Path, runs: int, samples: int) -> None:
    """An experiment of coupons at several stresses, every tenth run held out."""
    prepare()
    import jax.numpy as jnp

    from smajax.core.parameters import set_parameters
    from smajax.data.experiment.signals import MOST_SAMPLES
    from smajax.model.presets import build
    from smajax.simulation.compiled import simulate_compiled

    coupon = set_parameters(build("flexinol_isobaric", "coupon", "none"), TRUTH)
    random = np.random.default_rng(1)
    only = ", ".join(f'"{name}"' for name in CANDIDATES)
    lines = [COUPON.format(noise=NOISE, only=only)]
    if samples > MOST_SAMPLES:  # a step of several samples
        step = -(-samples // MOST_SAMPLES)
        lines.append(f'[time]\ncolumn = "t"\nunit = "s"\n[sampling]\nstep = "{step} s"')
    else:
        lines.append('[time]\nkind = "sample"')
    for number in range(runs):
        stress = float(np.interp(number / max(runs - 1, 1), (0.0, 1.0), STRESSES))
        # A cycle ends where it began, but for a strain that the law keeps of each: a longer run is the same again on top of it.
        each = min(samples, CYCLE)
        temperature = _cycles(each, number)
        inputs = {"temperature": jnp.asarray(temperature), "stress": jnp.full(each, stress * 1e6)}
        strain = np.asarray(simulate_compiled(coupon, inputs, 1.0).reading)
        name = f"run{number:04d}"
        with (place / f"{name}.csv").open("w", encoding="utf-8") as log:
            log.write("t,T,strain\n")
            for cycle in range(samples // each):
                shown = strain + cycle * strain[-1] + random.normal(0.0, NOISE, each)
                clock = cycle * each + np.arange(each)
                for part in np.array_split(np.column_stack((clock, temperature, shown)), -(-each // BLOCK)):
                    log.write("\n".join(f"{t:.0f},{a:.4f},{b:.6f}" for t, a, b in part) + "\n")
        role = "held-out" if number % 10 == 9 else "fit"
        lines.append(RUN.format(name=name, role=role, stress=stress))
    (place / "experiment.toml").write_text("\n".join(lines), encoding="utf-8")


def _samples(count: int, place: Path) -> Work:
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE
    from smajax.fit.identify import identify

    file = _experiment(place, 1, count)

    def work() -> Told:
        result = {one.name: one.value for one in identify(load_experiment(file, CATALOGUE), starts=0).estimates}
        return {"samples": count, "off": abs(result["austenite_finish"] - TRUTH["austenite_finish"])}

    return work


def _runs(count: int, place: Path) -> Work:
    from smajax.attribution.close_loop import close_loop
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE

    file = _experiment(place, count, RUN_SAMPLES)
    return lambda: {"runs": count, "verdict": close_loop(load_experiment(file, CATALOGUE)).verdict}


def _day(hours: int, place: Path) -> Work:
    import jax.numpy as jnp

    from smajax.model.rigs import arm
    from smajax.simulation.batch.axes import grid
    from smajax.simulation.batch.run_batch import run_batch

    steps = round(3600.0 * hours / DAY_STEP)
    # A step of the supply every minute, as a series of the whole day.
    voltage = np.where((np.arange(steps + 1) // round(60.0 / DAY_STEP)) % 2 == 0, 8.0, 2.0)
    inputs, axes, out = {"voltage": jnp.asarray(voltage)}, grid(payload_mass=[0.1]), place / "day"

    def work() -> Told:
        result = run_batch(arm(), inputs, axes, dt=DAY_STEP, every=DAY_KEPT, out=out, tolerance=None)
        finite = int(np.isfinite(np.asarray(result["position"])).sum())
        return {"hours": hours, "steps": steps, "kept_samples": finite}

    return work


WHAT: dict[str, Callable[[int, Path], Work]] = {
    "text": _text,
    "samples": _samples,
    "day": _day,
    "runs": _runs,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=WHAT)
    parser.add_argument("--count", type=int, required=True)
    options = parser.parse_args()
    prepare()
    with tempfile.TemporaryDirectory() as place:
        work = WHAT[options.what](options.count, Path(place))
        before, begin = peak_memory(), time.perf_counter()
        result = work()
        took, grown = time.perf_counter() - begin, peak_memory() - before
    lines = {"peer": "load", "what": options.what, "count": options.count, **result, "s": took, "grown_MB": grown / 1e6}
    print(json.dumps({**lines, "peak_memory_MB": peak_memory() / 1e6}))


if __name__ == "__main__":
    main()
