"""What heats the wire: electrical power from the drive's input channels.

In: the channels' values, the wire's resistance in ohm per metre. Out: power in W per metre of wire (`supply`).

Drives: `AbstractDrive` (`base`), `Voltage`, `Current`, `Power`, `Duty`, `NoDrive`.
Contracts of effects: `CommandTerm` and `InputLagTerm` (`inputs`), `SeriesTerm` and `SupplyTerm` (`supply`).
"""
