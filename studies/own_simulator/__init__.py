"""A user's own simulator of a bias-spring bench, which the base model lacks four things of, and the loop on its runs."""
