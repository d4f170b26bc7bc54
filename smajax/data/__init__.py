"""Measured data: files to runs on one clock, with what is known and unknown of the bench.

In: measured files (CSV, text, MATLAB, Parquet, NetCDF), `experiment.toml`, input text such as `6V:5s,0V:10s`; names of
presets, effects and parameters (model).
Out: `Experiment` with its runs, in SI, degC and rad, which `fit` and `attribution` read; `Table` and `InputSeries` for a single run.

    readers            files -> tables of columns -> signals on a uniform clock
    experiment         `experiment.toml` and its runs -> one validated record; drafts of such files from logs
    demo               two virtual benches
    model_catalogue    which presets, effects and parameters an experiment may name
    open_experiment    `open_experiment`, the reader with that catalogue (`smajax.load_experiment`)
    text_input         inputs and set points as text
"""
