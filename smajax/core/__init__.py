"""What knows no physics: types and helpers that every other room uses. Imports from no other room.

In: arrays, pytrees of modules, text. Out: the services below.

    parameters, units                    `parameter` (unit, bounds and meaning of a field); conversion of quantities
    runtime, compiling                   `prepare` (float64, compilation cache); notice of a compilation
    plugins, moved_modules, old_words    entry points of other packages; old module paths; sentences that are the report's now
    progress, result_cache, files        typed events; cached results; files written in one step
    provenance, machine                  versions, code and parameters of a result; the machine
    operating_system                     what differs between Linux, macOS and Windows
    checkpointed_scan, limited           a scan with a reverse derivative in little memory; clipping with derivatives at the ends
    whiteness, wording, display_units, names    tests of a series; words for numbers; close matches of names
"""
