"""What knows nothing of wires: files written whole, and whether a program is being compiled."""
