"""The commands, one a file: options, words and exit codes. What a command computes lies elsewhere and is imported late."""
