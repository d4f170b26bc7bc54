"""Gains of a controller by gradient: set points x plants -> terms and slopes -> objective -> descent -> gains, and a page."""
