"""The sweep of every controller on perturbed plants, and the table of it."""
