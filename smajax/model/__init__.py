"""The physics: a wire, what it pulls on, what drives it, what a sensor shows, and the effects that a model may lack.

In: parameters (SI, degrees Celsius), the values of the input channels, and the state before a step. Out: a `System` with
its state at rest (`system`), and the equations of one instant, pure functions on pytrees; `smajax.simulation` marches
them in time.

Within: types < wire < load, drive, sensor_reading < effects < system < extended, presets < rigs. An equation knows of effects
by the contract beside it alone.

Public: `System`, `build`, `WIRES`, `LOADS`, `DRIVES`, `extended`, `EFFECTS` (`effects.library`), `under_law` (`wire.laws`),
`AbstractEffect` and `Candidate` (`effects`), `AbstractMovingLoad` (`load.base`), `AbstractDrive` (`drive.base`).
"""
