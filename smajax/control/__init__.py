"""Controllers, state estimators, closed loops around any load that moves, tuning of gains and sweeps over perturbed plants.

In: a `System` (model), its time step (simulation), set points as text or columns of a file (data), batches (simulation.batch).
Out: `ClosedLoop` and `Merit`, labelled data sets of a run, `TuningResult`, `SweepResults`, which `report` draws and writes.

Public: `compose.compose`, `loop_around.loop_around`, `loop_dataset.Loop` and `simulate_loop_dataset`, `closed_loop.simulate_closed_loop`,
`figures_of_merit.merit`, `measured_state.Sensor`, `reference` (set points), `presets.CONTROLLERS` and `FILTERS`,
`controllers.base.AbstractController`, `estimators.base.AbstractEstimator`, `run_request.run_open` and `run_closed`,
`gain_search.search_gains`, `gains_file.read_gains` and `write_gains`, `tune.tuning.tune`, `sweep.run_sweep.sweep_controllers`.
"""
