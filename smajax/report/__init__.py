"""Results in words, pictures, pages and records; nothing in here simulates, fits or decides.

In: results of the rooms above it: `Findings` of the attribution, what `identify`, `sweep`, `tune` and `simulate` give.
Out: a folder with one self-contained page (report.html, ...), the same numbers for a program (report.json, ...), and tables as CSV.
Numbers first, words last: `narrative` turns findings into sentences, `pictures` draws them, `html` and `json_file` lay both out,
`write` puts the files into their folder, each whole or not at all. The modules `identify_*`, `sweep_*`, `tune_*` and
`simulate_page` do the same for the other commands.

Public: `Findings`, `IdentificationNarrative`, `Narrative`, `TuningNarrative`, `narrate`, `write_report`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from smajax.attribution.findings import Findings as Findings
    from smajax.report.narrative import IdentificationNarrative as IdentificationNarrative
    from smajax.report.narrative import Narrative as Narrative
    from smajax.report.narrative import narrate as narrate
    from smajax.report.narrative.tuning import TuningNarrative as TuningNarrative
    from smajax.report.write import write_report as write_report

# Imported when they are asked for: a command that writes no report needs no plotting library for a table.
_WHERE = {
    "Findings": "smajax.attribution.findings",
    "IdentificationNarrative": "smajax.report.narrative",
    "Narrative": "smajax.report.narrative",
    "TuningNarrative": "smajax.report.narrative.tuning",
    "narrate": "smajax.report.narrative",
    "write_report": "smajax.report.write",
}


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_WHERE[name]), name)
