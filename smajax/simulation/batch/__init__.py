"""Many simulations as one: named axes -> chunks -> devices and hosts -> a labelled data set, in memory or on disk."""
