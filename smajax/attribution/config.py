"""Thresholds of the verdict, of the checks and of the report, which a user may change, each with its reason.

A constant of one method (how many sets of effects a round fits, after how many steps a fit that is far behind ends) stands at
the top of the module that uses it, with its reason.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AttributionConfig:
    """What `close_loop(..., config=...)` changes. Shares are 0..1; nothing here has a unit but seconds."""

    # Is the residual noise?
    noise_excess: float = (
        0.02  # of its mean square; a noise is rarely known better, and no effect worth a name hides in 2 %
    )
    noise_excess_errors: float = (
        2.0  # standard errors of that mean square: autocorrelated noise misses its own level by more
    )
    most_noise_excess: float = 0.1  # but never more than this: a third of the noise may hide in it
    white_noise_ratio: float = (
        3.0  # a white residual this large is noise declared too small; a larger one, unrelated data
    )
    # A noise estimated from neighbouring samples is its fast part. A first-order autoregressive residual is that noise with its slow part.
    most_filter_coefficient: float = 0.95  # beyond it a slow trace of physics looks the same
    most_filter_noise: float = 2.0  # innovation over the estimate; 1.6 where the coefficient is near one
    least_independent: int = 50  # samples; with fewer the test cannot reject a first-order noise

    least_log_odds: float = 3.0  # of effects over a model that leaves noise without them, from which they are named: twenty times as likely, as a wrong record has to be

    # Pages
    first_page: float = 60.0  # s of a search before what it knows is shown: most are over by then

    # Fits
    least_explained_variance: float = (
        0.5  # of the motion in left-out runs; below it effects mean nothing but where they leave noise
    )
    nudge: float = (
        1e-3  # share of an effect's start value at which its score is taken: at exactly zero some have no slope
    )
    bound_distance: float = 0.03  # of the box: how far from a bound a refit starts to which a poorer model was driven
    convergence: float = 1e-5  # relative decrease of the cost at which a refit ends
    final_convergence: float = 1e-8  # of the final model: standard errors need the optimum

    # Step-size check
    gain_kept_at_half_step: float = 0.5  # of an effect with which the load may jump; less is the integration's gain

    # Outlier run
    outlier_least_runs: int = 3  # of two runs that disagree either may be the wrong one
    influential_least_runs: int = (
        4  # where the others are not noise without it: a model fits any two runs far better than three
    )
    influential_ratio: float = 2.0  # by which the error on the other runs then falls
    outlier_reach: float = 2.0  # by which the error of a fit without a run falls at most in other local minima
    outlier_most_runs: int = 12  # looked at, those of the largest residual first: each costs a refit

    # Held-out runs
    held_out_tolerance: float = 0.02  # by which two models' errors there differ without a meaning
    held_out_errors: float = 2.0  # standard errors, which chance may make: two models as good as each other are told apart in 1 to 7 of 100 cases
    held_out_worse: float = 1.3  # times the base model's error there, from which effects that leave more than noise of the fit runs are not named

    # Confounders
    overlap_listed: float = 0.7  # of an effect's trace: a candidate that overlaps less hardly takes its place
    # Log-likelihood ratio down to which fit runs hardly tell two models: twenty to one, as for everything else that is named.
    told_by_runs: float = 3.0
    separating_weight: float = 0.01  # from which a run that separates the two is looked for

    # Unknown terms
    many_effects: int = (
        2  # from which one unknown function is asked for in their place, even where they leave only noise
    )
    terms_refitted: int = 6  # about one an equation
    term_start_share: float = 0.5  # of the score test's estimate: where a refit starts
    term_start_limit: float = 0.8  # coefficients, in widths of their prior: a fit does not start farther off
    term_prior_sigma: float = (
        1.0  # of every coefficient about zero, a wave of half the largest function: the fit is then well posed
    )
    term_points: int = 61  # at which the function is tabulated
    term_bins: int = 20  # of its range, in which samples are counted

    # When the report warns
    wrong_noise: float = 1.2  # residual over noise, or the other way round: the noise was declared wrongly
    noise_may_be_wrong: float = 2.0  # residual over noise up to which the noise itself may be what is wrong
    held_out_ratio: float = 1.3  # error of a held-out run over that of the fit runs, and more where it has few samples:
    held_out_chance: float = 5.0  # by this over the root of twice their number
    faint_p_value: float = 0.01  # corrected for the candidates: a trace below the noise is reported
    integration_error_of_error: float = (
        0.5  # of the model's error on the fit runs: what was fitted may be the integration's
    )
    large_load_share: float = 0.2  # of the load, wrong or shifting: a size of the bench is as likely to be wrong
    far_from_prior: float = 2.0  # widths of the prior of a preset's value: by chance one in twenty is farther
    expansion_cancelled: float = 0.3  # share of the preset's expansion to within which one found is its negative
    confounder_mentioned: float = 0.05  # weight from which a confounder is named
