"""Many runs that differ in parameters or inputs, over all cores or devices, in chunks that resume where they stopped.

In: a system, inputs that all runs share, and `Axes` of what varies. Out: an `xarray.Dataset` with the dimensions of the axes, in memory or
streamed to a Zarr group.

`axes`: `grid`, `zipped`, `sampled`. `run_batch`: `run_batch`, `opened`, `good`, `status_summary`. `hosts`: `join`, `run_batch_here`, for a
cluster. Inside: `recipe` checks what goes in (`BatchSettings`, `recipe_of`), `single_run` is one run as a pure function, `chunks`
compiles and runs it, `store` is the folder.
"""
