"""The command line `smajax`: options and text in, the rooms' results as pages, files, text or JSON out.

In: the words that a user types; every other room, imported by a command when it runs, so that `smajax --help` is quick.
Out: results in folders, text on stdout, progress and errors on stderr, exit codes.

    main                                 `main`: which commands there are, errors, exit codes
    commands                             one file a command: its options and what it prints
    options, terminal, positional        option types and parsing; console, Ctrl-C; hints for arguments
    renamed, completion                  old names of options; words for the Tab key
    result_folder, progress_display      one result a folder; progress on a terminal
    installation, benchmark              what `doctor` and `bench` compute
    draft_file                           what `new-experiment` writes
"""
