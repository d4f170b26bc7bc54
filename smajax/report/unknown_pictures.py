"""Pictures of unknown terms: the function that was learnt, its band, its formulas, and where the runs went."""

from __future__ import annotations

import numpy as np

from smajax.attribution.findings import UnknownTerm
from smajax.core.display_units import axis_label, display
from smajax.report.pictures import AFTER, NARROW, NOISE, QUIET, as_png, new_figure, tidy


def function_learnt(term: UnknownTerm) -> bytes:
    """f over its state with the 95 % band, the formulas, and below them the share of samples in each cell."""
    figure = new_figure(3.9, NARROW)
    rows = figure.subplots(2, 1, sharex=True, height_ratios=[3.0, 0.9])
    state, unit = display(term.state_unit, term.state), display(term.unit)
    at, values = state.of(term.at), unit.of(term.values)
    band, held = 2.0 * unit.of(term.error), 2.0 * unit.of(term.error_held)
    middle = float(np.max(np.abs(values))) or 1.0
    rows[0].fill_between(at, values - band, values + band, color=NOISE, label="± 2 standard errors")
    rows[0].fill_between(
        at, values - held, values + held, color=AFTER, alpha=0.25, linewidth=0.0, label="the same, parameters held"
    )
    rows[0].plot(at, values, color=AFTER, linewidth=1.8, label="learnt")
    for formula, style in zip(term.formulas, ("--", ":", "-."), strict=False):
        rows[0].plot(
            state.of(np.linspace(term.at[0], term.at[-1], len(formula.curve))),
            unit.of(formula.curve),
            style,
            color="#1d1d1f",
            linewidth=1.0,
            label=formula.text,
        )
    rows[0].axhline(0.0, color=QUIET, linewidth=0.6)
    # A band that the runs leave open must not flatten the curve.
    reach = 1.15 * max(middle, min(float(np.max(np.abs(values) + band)), 3.0 * middle))
    rows[0].set_ylim(-reach, reach)
    rows[0].set_ylabel(axis_label("f", unit), fontsize=9)
    whole = max(float(np.sum(term.samples)), 1.0)
    edges = state.of(term.cells)
    rows[1].bar(edges[:-1], 100.0 * term.samples / whole, np.diff(edges), align="edge", color=QUIET)
    rows[1].set_ylabel("samples\n(%)", fontsize=8)
    rows[1].set_xlabel(axis_label(term.state, state), fontsize=9)
    figure.legend(loc="outside upper center", ncols=1, frameon=False, fontsize=8)
    for axes in rows:
        tidy(axes)
    return as_png(figure)
