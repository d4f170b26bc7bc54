"""Independent, event-aware reference integration of the wire models (scipy only)."""
