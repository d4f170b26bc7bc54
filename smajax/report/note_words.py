"""What may be wrong with a run, in sentences."""

from __future__ import annotations

from collections.abc import Iterable

from smajax.control.run_notes import (
    MOST_SET_POINTS,
    AboveAnnealing,
    AboveMelting,
    AboveStrength,
    CycleLeavesStrain,
    EndsEarly,
    InputLeftOut,
    Note,
    NotFinite,
    NotResolved,
    StraightLines,
    TooManySetPoints,
)
from smajax.core.display_units import digits
from smajax.data.experiment.magnitude import ANNEALS, MELTS, STRENGTH
from smajax.data.text_input import HELD


def note_sentences(notes: Iterable[Note]) -> list[str]:
    """A sentence a note."""
    return [_sentence(one) for one in notes]


def _sentence(note: Note) -> str:
    match note:
        case InputLeftOut(channel, unit, (low, high), parameter, value):
            return (
                f"The model was fitted to runs with their own {channel}, {digits(low, 4)} to {digits(high, 4)} {unit}; here it is "
                f"{parameter}, {digits(value, 4)}. Give --input {channel}=... for another."
            )
        case NotFinite(variables):
            return f"Values that are not finite in {', '.join(variables)}: is the heat or the step too large?"
        case AboveMelting(hottest):
            return f"The wire reaches {hottest:.4g} degC, and it melts at {MELTS:g} degC: is the input's unit right?"
        case AboveAnnealing(hottest):
            return (
                f"The wire reaches {hottest:.4g} degC: a trained nickel-titanium wire is annealed from about {ANNEALS:g} degC on and loses stroke, which this model "
                "does not. Of an alloy for high temperatures its maker tells the limit."
            )
        case AboveStrength(largest):
            return (
                f"The stress reaches {digits(largest / 1e6, 4)} MPa, and no wire carries more than {STRENGTH / 1e6:g} MPa: is the load's unit "
                "right (of a mass kg), and the wire's diameter?"
            )
        case NotResolved(share, limit, how, loop):
            sensitive = (
                " A loop whose controller switches or reaches its limits is sensitive by nature: one switch that comes a sample earlier puts two runs out of step, and then "
                "no integration settles single samples. Take figures of merit from several runs (--seed, other set points), not from this one alone."
            )
            return (
                f"Not resolved: the run ({how}) differs from finer integrations by {digits(100.0 * share, 3)} % of a whole transformation (root mean "
                f"square), more than the {digits(100.0 * limit, 3)} % that is aimed for. Try a smaller --tolerance, 1e-8, or a smaller --dt."
            ) + sensitive * loop
        case CycleLeavesStrain(strain):
            return (
                f"The wire is martensite again at the temperature it began with, and {digits(100.0 * abs(strain), 2)} % of its length {'longer' if strain > 0.0 else 'shorter'}: "
                "in rate form, the default, cycles do not close (docs/limits.md). They do under the law `integrated` (--law integrated)."
            )
        case EndsEarly(asked, end, step):
            return (
                f"The run ends at {digits(end, 4)} s of {digits(asked, 4)} s: it has whole steps of {digits(step, 4)} s (of a loop, control periods). "
                "A shorter --dt or --period takes it further."
            )
        case StraightLines(column):
            return (
                f"Between the rows of the file the set point goes on straight lines, and figures of merit are for set points that are held: {column}{HELD} "
                "holds each row until the next one."
            )
        case TooManySetPoints(count):
            return (
                f"Figures of merit are for constant set points, {MOST_SET_POINTS} at most: this reference has {count}."
            )
    return note
