"""What a model may lack: one effect a file, in the equations whose contracts it inherits from.

In: coefficients. Out: effects for `System.effects`, which `grouping` sorts by contract; `library` has them all by name, those
of other packages too.

Public: `AbstractEffect` (`base`, with the table of contracts), `Candidate` and `Extent` (`candidate`: what the search for
missing effects knows of an effect), `LIBRARY` and `at_base` (`library`).
"""
