"""The requirement on the filter, with noise and delay: which controllers meet it, in which share of loops that nothing was tuned on."""
