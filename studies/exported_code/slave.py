"""A unit under FMPy, by the names of its variables: whichever version of the interface it has."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any


@cache
def described(path: Path) -> Any:
    """The description of a unit, read and checked once."""
    import fmpy

    return fmpy.read_model_description(str(path))


class Slave:
    """One instance. Needs FMPy (`pip install fmpy`)."""

    def __init__(self, path: Path, folder: Path) -> None:
        """folder: where the unit is unpacked, once for all of its instances."""
        import fmpy
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        description = described(path)
        self.three = description.fmiVersion == "3.0"
        self.reference = {one.name: one.valueReference for one in description.modelVariables}
        given = {"modelIdentifier": description.coSimulation.modelIdentifier, "instanceName": "one"}
        unzipped = folder / path.stem
        if not unzipped.exists():  # not again: a library that is in use would be written over
            fmpy.extract(str(path), str(unzipped))
        make: Any = FMU3Slave if self.three else FMU2Slave
        token = description.instantiationToken if self.three else description.guid
        self.unit = make(guid=token, unzipDirectory=str(unzipped), **given)
        self.unit.instantiate()

    def begin(self, **values: float) -> Slave:
        if not self.three:
            self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()
        self.set(**values)
        self.unit.exitInitializationMode()
        return self

    def set(self, **values: float) -> None:
        put = self.unit.setFloat64 if self.three else self.unit.setReal
        put([self.reference[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        read = self.unit.getFloat64 if self.three else self.unit.getReal
        return list(read([self.reference[name] for name in names]))

    def step(self, time: float, seconds: float) -> None:
        self.unit.doStep(currentCommunicationPoint=time, communicationStepSize=seconds)

    def state(self) -> Any:
        return self.unit.getFMUState() if self.three else self.unit.getFMUstate()

    def back_to(self, state: Any) -> None:
        (self.unit.setFMUState if self.three else self.unit.setFMUstate)(state)

    def free(self, state: Any) -> None:
        (self.unit.freeFMUState if self.three else self.unit.freeFMUstate)(state)

    def close(self) -> None:
        self.unit.terminate()
        self.unit.freeInstance()
