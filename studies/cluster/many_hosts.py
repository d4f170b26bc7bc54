"""A million arm runs on however many hosts there are: `python studies/cluster/many_hosts.py --help`."""

from __future__ import annotations

import argparse
import os
from pathlib import Path


def main() -> None:
    """Join the others, and fill this process's chunks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder that all processes see")
    parser.add_argument("--members", type=int, default=1 << 20)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--coordinator", help="host:port of process 0; not needed under SLURM or MPI")
    parser.add_argument("--processes", type=int)
    parser.add_argument("--process", type=int)
    options = parser.parse_args()

    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.model.presets import build
    from smajax.simulation.batch.axes import sampled
    from smajax.simulation.batch.hosts import join, run_batch_here
    from smajax.simulation.measures import Largest, Last, Smallest

    alone = options.coordinator is None and not {"SLURM_JOB_ID", "OMPI_COMM_WORLD_SIZE"} & set(os.environ)
    process, processes = (0, 1) if alone else join(options.coordinator, options.processes, options.process)
    axes = sampled(
        options.members, voltage=(5.5, 8.5), payload_mass=(0.045, 0.068), convection_coefficient=(60.0, 80.0)
    )
    run_batch_here(
        build("niti_table_3_1", "arm", "amplified_voltage"),
        {},
        axes,
        options.out,
        process,
        processes,
        seconds=options.seconds,
        keep=(),
        measures=(Last("position"), Largest("stress"), Smallest("martensite_fraction")),
        progress=lambda event: print(f"process {process}: {event}", flush=True),
    )


if __name__ == "__main__":
    main()
