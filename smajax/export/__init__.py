"""A model or a controller that leaves Python: as C99, and as a functional mock-up unit (FMU)."""
