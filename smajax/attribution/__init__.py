"""What the base model of an experiment lacks: fitted, searched for, validated.

In: an `Experiment` (`smajax.data`), the library of effects (`smajax.model.effects`), least squares and sensitivities
(`smajax.fit`). Out: `Findings`, a record of numbers and enums, which `smajax.report` puts into words and pictures.
The way of data is `close_loop`: base fit -> joint search (sets of effects by their evidence) -> evidence for and against what
was found (an unknown term, an outlier run) -> held-out validation -> findings (parameters, effects, confounders, residual
diagnostics, step-size check). What a user may change, the thresholds of a verdict, of the checks and of the report, are fields
of `AttributionConfig`. A constant of one method stands at the top of the module that uses it, with its reason.

Public: `close_loop.close_loop`, `findings.Findings` and the records in it, `config.AttributionConfig`.
"""
