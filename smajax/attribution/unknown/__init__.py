"""Unknown terms: a smooth function of one state in one equation, for what no effect of the library explains.

In: a base fit that leaves more than noise. Out: effects (`terms`) whose coefficients are values of a spline (`spline`) over the range of
their state in the runs (`ranges`), to be fitted as any other effect; `search` finds the equation that one belongs in.
"""
