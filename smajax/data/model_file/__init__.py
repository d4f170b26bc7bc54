"""A model of an actuator as a file: wire x load x drive x effects, every value with its unit and error, and what it was fitted to."""
