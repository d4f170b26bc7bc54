"""The source's own discovery, made again by the loop."""
