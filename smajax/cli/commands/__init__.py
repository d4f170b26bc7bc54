"""The commands, one a file: options, what is printed, exit codes. Computation is in the other rooms, imported when needed."""
