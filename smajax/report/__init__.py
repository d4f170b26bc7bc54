"""The answer of one closed loop as a page for an engineer and as a record for a program."""

from smajax.attribution.findings import Findings as Findings
from smajax.report.write import write_report as write_report
