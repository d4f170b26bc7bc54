"""Set points up and down, disturbances and payload changes: every controller on the filter, with noise, steps of the reading and delay."""
