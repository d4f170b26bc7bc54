"""Experiments: a TOML file and the measured files it names, as one validated record."""
