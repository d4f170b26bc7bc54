"""How large the package is and how its imports run, counted the same way of any version of it."""
