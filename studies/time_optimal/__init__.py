"""The least time to settle at a set point, by two methods that share nothing but the simulator."""
