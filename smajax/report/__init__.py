"""Results in words, pictures, pages and records; nothing in here simulates, fits or decides.

In: results of the rooms above it: `Findings` of the attribution, what `identify`, `sweep`, `tune` and `simulate` give.
Out: a folder with one self-contained page (report.html, ...), the same numbers for a program (report.json, ...), and tables as CSV.
Numbers first, words last: `narrative` turns findings into sentences, `pictures` draws them, `html` and `json_file` lay both out,
`write` puts the files into their folder, each whole or not at all. The modules `identify_*`, `sweep_*`, `tune_*` and
`simulate_page` do the same for the other commands.

Public: `Findings`, `Narrative`, `narrate`, `write_report`.
"""

from smajax.attribution.findings import Findings as Findings
from smajax.report.narrative import Narrative as Narrative
from smajax.report.narrative import narrate as narrate
from smajax.report.write import write_report as write_report
