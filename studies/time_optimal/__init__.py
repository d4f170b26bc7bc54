"""The least time to a set point, and the least found to settle there."""
