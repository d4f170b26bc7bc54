"""What else could be asked on the same cases: the base model refitted, a greedy refit, PySINDy, jax-sysid."""
