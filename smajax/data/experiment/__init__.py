"""`experiment.toml` and the measured files that it names, as one validated record.

In: the file (`schema`), a `Catalogue` of presets and parameters (`catalogue`), tables of measured files (`readers`).
Out: `record.Experiment` with `Run`, `Output`, `Unknown`, `Prior` and `DeclaredPriors`; warnings where data are implausible
(`plausibility`, `magnitude`, `headings`); `ExperimentError` with file, key, value and remedy.

Public: `load.load_experiment`, `record.Experiment`, `errors.ExperimentError`, `fingerprint.fingerprint` (which experiment a
result belongs to), `draft.draft` (a new file from logs, by `column_guess`, `logs` and `grouping`).
"""
