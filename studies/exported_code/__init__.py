"""Exported models and controllers against the package, on this machine and for a Cortex-M4: `python -m studies.exported_code.run`."""
