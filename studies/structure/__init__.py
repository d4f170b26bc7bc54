"""The counts of a package in a checkout, from its files alone."""
