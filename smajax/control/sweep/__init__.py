"""Robustness of controllers: a grid of perturbed plants, set points and gains, one closed loop each.

In: a system (`model`), controllers by name with their gains (`control.presets`, `control.gains_file`), `SweepSettings`.
Out: `SweepResults`, figures of merit of every closed loop, which `report.sweep_folder` writes as pages and tables.

    grid             `Grid`, `sweep_ratios`, `loop_rows`: which closed loops there are
    spread_plants    `spread_plants`: a batch of plants in the place of mismatches, where more of them differ at once than a map has axes
    batched_loops    `LoopSetup`, `closed_loops`, `positions`: those loops in batches, without or with their trajectories
    run_sweep        `SweepSettings`, `sweep_controllers`: controller by controller, resumed from a cache
"""
