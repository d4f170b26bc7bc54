"""The wire, one equation a file, each with the contract of the effects that may change it.

In: temperature, stress, fraction and the state before a step. Out: heat rate (`heat`), ohms (`resistance`), martensite
fraction (`kinetics`; `two_populations` for two kinds of wire in one), stress and strain (`constitutive`).

Constants: `Wire`, `Kinetics` and the others in `wire`; the choices that make an author's law in `shape`, `conditions`,
`branch_amplitude`, `variants`, `stiffness` and `form`, by name in `laws`.
Contracts: `HeatTerm`, `ResistanceTerm`, `ShapeTerm`, `PlaceTerm`, `RangeTerm`, `PopulationTerm`, `ConstitutiveTerm`, `HistoryTerm`.
"""
