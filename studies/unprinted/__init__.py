"""What the source does not print, found jointly from what it says: one set of values for all figures of a rig or a controller."""
