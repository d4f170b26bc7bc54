"""The presets' values that matter on the runs of a draft, in words."""

from __future__ import annotations

from smajax.attribution.preset_ranking import MOVES, PresetInfluence, PresetRanking
from smajax.core.display_units import digits, display
from smajax.data.experiment.draft_parameters import amount

WORTH = 0.1  # noises: below, a value hardly matters
FIRST = 5  # in the message
NOT_LOADED = "What was left to the preset is not listed by its importance: that takes a file that can be loaded."
NO_NUMBER = (
    "What was left to the preset is not listed by its importance: the model has no number at the start of the draft."
)


def _change(one: PresetInfluence) -> str:
    return f"{digits(100.0 * one.change, 3)} %" if one.relative else f"{digits(one.change, 3)} K"


def _noises(one: PresetInfluence) -> str:
    return f"{one.noises:.0f}" if one.noises >= 10.0 else digits(one.noises, 2)


def _effect(one: PresetInfluence) -> str:
    return f"{_change(one)} changes the output by {_noises(one)} times its noise"


def remarks(ranking: PresetRanking) -> dict[str, str]:
    """Name -> what to write beside the value, most important first; those that hardly matter have none."""
    return {one.name: _effect(one) for one in ranking.influences if one.noises >= WORTH}


def starts_of(ranking: PresetRanking) -> dict[str, str]:
    """Name -> start at which the wire transforms, as a draft has it, of unknowns at whose own start it hardly does; none where it does nowhere."""
    if ranking.moves < MOVES:
        return {}
    return {name: amount(value, unit, 3) for name, (value, unit) in ranking.changed.items()}


def sentence(ranking: PresetRanking, begun: bool = False) -> str:
    """What matters most, and where the runs were simulated if that is not the start of the file. begun: whether the file begins where they were."""
    worth = [one for one in ranking.influences if one.noises >= WORTH]
    which = "as the start in place of the preset's" if begun else "in place of the start"
    where = "".join(
        f" (with {name} = {shown.with_unit(value, 3)} {which}, at which the wire transforms too little)"
        for name, (value, unit) in ranking.changed.items()
        for shown in [display(unit, name)]
    )
    doubt = (
        f" The model moves by {digits(100.0 * ranking.moves, 2)} % of what was measured there, so this may change: give what you know "
        "(--known NAME=VALUE) and draft again."
        if ranking.moves < MOVES
        else ""
    )
    if not worth:
        return f"Of what was left to the preset, nothing changes the output by a tenth of the noise{where}.{doubt}"
    named = [f"{one.name} ({_effect(one) if number == 0 else _short(one)})" for number, one in enumerate(worth[:FIRST])]
    more = f"; {len(worth) - FIRST} more are in the file" if len(worth) > FIRST else ""
    return f"Of what was left to the preset, these matter most on your runs{where}: {', '.join(named)}{more}.{doubt}"


def _short(one: PresetInfluence) -> str:
    return f"{_change(one)}: {_noises(one)}"
