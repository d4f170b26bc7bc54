"""A case handed to a peer in an environment of its own, and its answer taken back."""

from __future__ import annotations

import os
import time as clock
from pathlib import Path
from tempfile import TemporaryDirectory

import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import parameter_values
from smajax.fit.packed_runs import pack, simulate_batch
from studies.attribution_benchmark.peers.answer import Answer
from studies.attribution_benchmark.peers.bench import Bench
from studies.attribution_benchmark.peers.given import Given, Series, save
from studies.attribution_benchmark.peers.plain import fit_of
from studies.benchmarks.peers import run_peer

PACKAGE = "studies.attribution_benchmark.peers"
# Module, variable that names an interpreter that can import what it needs, options.
PYTHONS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "pysindy": ("sindy_peer", "SMAJAX_PYSINDY_PYTHON", ()),
    "pysindy_sparse": ("sindy_peer", "SMAJAX_PYSINDY_PYTHON", ("--sparse",)),
    "jax_sysid": ("sysid_peer", "SMAJAX_JAX_SYSID_PYTHON", ()),
}
STATES = ("temperature", "stress", "martensite_fraction")


def given_of(bench: Bench, base: Answer) -> Given:
    """The runs with the refitted base model's states beside them."""
    experiment = bench.experiment
    problem, index = bench.fits.restricted(())
    batch = pack(experiment.runs, experiment.step, parameter_values(problem.system))
    simulated = simulate_batch(problem.system_at(jnp.asarray(fit_of(bench, base).values[index])), batch)
    noise, runs = experiment.noise_sigma, []
    for number, run in enumerate(experiment.runs):
        n = len(run.time)
        shown = np.asarray(simulated.reading)[number, :n]
        zero = float(np.mean(run.output - shown)) if experiment.offset else 0.0
        states = {name: np.asarray(getattr(simulated, name))[number, :n] for name in STATES}
        runs.append(
            Series(run.name, run.role == "fit", dict(run.inputs), run.output / noise, (shown + zero) / noise, states)
        )
    return Given(experiment.load, experiment.step, tuple(runs))


def told_by(peer: str, bench: Bench, base: Answer) -> Answer:
    """What the peer makes of the case, run by the interpreter that the environment names."""
    module, variable, options = PYTHONS[peer]
    python = os.environ.get(variable)
    if not python:
        return Answer(
            peer, base.case, reason=f"no interpreter: set {variable} to one that can import what {peer} needs"
        )
    began = clock.monotonic()
    with TemporaryDirectory() as place:
        file = Path(place) / "given.npz"
        save(file, given_of(bench, base))
        told = run_peer(module, python, str(file), *options, package=PACKAGE)
    if "reason" in told:
        return Answer(peer, base.case, reason=told["reason"])
    seconds = base.seconds + clock.monotonic() - began
    return Answer(
        peer,
        base.case,
        where=tuple(told.get("where", ())),
        adequate=told.get("adequate"),
        fit_error=float(told["fit_error"]),
        held_out_error=float(told["held_out_error"]),
        seconds=seconds,
        said=told["said"],
    )
