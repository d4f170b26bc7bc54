"""State estimators: position readings and commands to an estimated state.

In: a reading (rad or m) and the last command (V), once a control period. Out: `MeasuredState` for a controller.
`control.presets.FILTERS` has them by name. Public: `base.AbstractEstimator`, `printed_filter.PrintedFilter`,
`model_filter.ModelFilter`, `adaptive_filter.AdaptiveFilter` (parameters too), `kalman` (the extended filter), `unscented`, `run` (an estimator over a whole series).
"""
