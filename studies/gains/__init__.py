"""Searches for the gains that the source does not print; what was found lies beside each script and in the presets."""
