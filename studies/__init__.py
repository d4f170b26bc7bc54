"""Studies: the independent reference integration and the scripts that make data."""
