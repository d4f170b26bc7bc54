"""Least squares: an experiment's runs and a model in; parameters, their uncertainty and the next run's design out.

In: `Experiment` and `Run` (data), a `System` (model), sensor outputs of simulated runs (simulation).
`experiment_problem` packs them into a `Problem`; `starts.multistart` and `levenberg_marquardt` fit many tasks of it at
once, `noise` and `robust` weight its samples; `sensitivity` is the Jacobian at a fit, from which `uncertainty`,
`identifiability`, `directions`, `profile`, `posterior` and `design` follow.
Out: `Fit` (levenberg_marquardt), `Sensitivity`, `Uncertainty`, and, of a whole identification, `Identified`
(identify_result), which attribution and report read.

Public: `identify.identify`, `identify_result.Identified`, `problem.Problem`, `problem.FitTask`,
`levenberg_marquardt.levenberg_marquardt`, `FitSettings` and `Fit`, `starts.multistart`, `sensitivity.sensitivity`,
`uncertainty.uncertainty`, `design.suggestions`, `base_model.base_model`.
"""
