"""Simulated measurements with known causes, to score attribution by; shares no code with the package."""
