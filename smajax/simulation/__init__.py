"""From a system and its inputs over time to states over time.

In: a `System` (room `model`), input series by channel (SI) and a step; for a batch, the axes that vary. Out: trajectories, labelled
data sets, or figures of a run alone. Every run, of a batch and of a closed loop (room `control`) too, is one call of `integrate`.

`simulate`: `simulate`, pure, for `jit`, `vmap` and `grad`. `compiled`: `simulate_compiled`, as machine code. `dataset`: `simulate_dataset`,
labelled. `batch`: many runs. `measures`: `Last`, `Largest`, `Smallest`, `Mean`, `MeanSquare`, `TimeAbove`. `sensors`: `sensor_output`.
`integrate`: the march in time and `AbstractObserver`; `steppers` are its steps (`step`: fixed; `adaptive_steps`: error-controlled), and
`observers` what it records. `stage_equations` and `stage_solver`: the equations of an implicit stage, and their solution.
"""
