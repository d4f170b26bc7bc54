"""What the base model of an experiment lacks: fitted, searched for, validated.

In: an `Experiment` (`smajax.data`), the library of effects (`smajax.model.effects`), least squares and sensitivities
(`smajax.fit`). Out: `Findings`, a record of numbers and enums, which `smajax.report` puts into words and pictures.
The way of data is `close_loop`: base fit -> joint search (sets of effects by their evidence) -> evidence for and against what
was found (an unknown term, an outlier run) -> held-out validation -> findings (parameters, effects, confounders, residual
diagnostics, step-size check). Every threshold is a field of `AttributionConfig`.

Public: `close_loop.close_loop`, `findings.Findings` and the records in it, `config.AttributionConfig`.
"""
