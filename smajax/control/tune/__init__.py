"""Gains of a controller by gradient, then by CMA-ES.

In: `TuneSettings` (controller, set points, variation of the plant, objective, limits) and a `System`.
Out: `TuningResult`: gains before and after, validated on held-out plants and set points; `report.tune_folder` writes it.

    settings, scenarios      what is tuned; the closed loops of one candidate, and the held-out ones
    terms, evaluate          smooth terms of a loop; their values and gradients for many candidates in one batch
    objective                cost, limits and the augmented Lagrangian
    multistart               rounds from many starts by `trust` (linear programs in a trust region) or `adam`
    cma_es                   the derivative-free search that follows
    tuning, tuning_folder    `tune`; `tune_in_folder`, which resumes
    folder_names             of the files in such a folder
    moves                    moves between set points, for validation
"""
