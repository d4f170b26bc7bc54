"""Inputs of single runs that were recorded wrongly, and what they should have been, in sentences."""

from __future__ import annotations

from collections.abc import Iterator

from smajax.attribution.findings import Findings
from smajax.attribution.record_error import FoundRecordErrors, NotConfirmed, RecordError
from smajax.core.display_units import with_error
from smajax.core.wording import and_listed


def of_wrong_records(findings: Findings) -> Iterator[str]:
    """What was recorded wrongly, that the run was corrected by it, and what it takes the place of."""
    for one in findings.record_errors:
        instead = f" Without that the search names {and_listed(one.instead_of)} in its place." if one.instead_of else ""
        if one.on_trial:
            yield (
                f"An input of one run may not be right: {what_was_wrong(one)}. It is corrected by that on trial here, for more than noise is left."
            )
            continue
        yield (
            f"An input of one run cannot be right: {what_was_wrong(one)}. It is corrected by that here and everything else is said of the corrected "
            f"run; look at its log, and correct it or leave the run out.{instead}"
        )


def what_is_searched(one: FoundRecordErrors | NotConfirmed) -> str:
    """Why the search begins again: with a record corrected, or with those that were corrected on trial as they were logged."""
    if isinstance(one, NotConfirmed):
        names = and_listed([f"the {wrong.channel} of {wrong.run}" for wrong in one.errors])
        logged = "it is taken as it was logged" if len(one.errors) == 1 else "they are taken as they were logged"
        return f"no model that leaves little more than noise needs {names} corrected; {logged}"
    wrong = and_listed([what_was_wrong(error) for error in one.errors])
    again = f"{wrong}; the search begins again with {'that run' if len(one.errors) == 1 else 'these runs'} corrected"
    return f"{again}, on trial: more than noise is left" if one.errors[0].on_trial else again


def what_was_wrong(one: RecordError) -> str:
    """As "the recorded voltage of steps is 0.8000 ± 0.0010 s early: what it shows acted so much later"."""
    channel = f"recorded {one.channel} of {one.run}"
    if one.coefficient == "input_delay.delay":
        when, then = ("early", "later") if one.value > 0.0 else ("late", "earlier")
        return f"the {channel} is {with_error(abs(one.value), one.standard_error)} s {when}: what it shows acted so much {then}"
    if one.coefficient == "input_clock.rate":
        when = "early" if one.value > 0.0 else "late"
        off, error = (abs(value) * one.seconds for value in (one.value, one.standard_error))
        return (
            f"the {channel} is on another clock: right at its start, and {with_error(off, error)} s {when} at its end"
        )
    return f"the {channel} should have been {with_error(1.0 + one.value, one.standard_error)} times what it is"
