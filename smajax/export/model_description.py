"""The XML of a functional mock-up unit: what it is, its variables and its units, by FMI 2.0 or 3.0."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from xml.sax.saxutils import quoteattr

from smajax.export.block import Quantity
from smajax.export.source import CSource

FMI2, FMI3 = "2.0", "3.0"
# Exponents of kg, m, s, A, K, rad.
BASE = ("kg", "m", "s", "A", "K", "rad")
UNITS: dict[str, tuple[int, ...]] = {
    "kg": (1, 0, 0, 0, 0, 0),
    "m": (0, 1, 0, 0, 0, 0),
    "s": (0, 0, 1, 0, 0, 0),
    "A": (0, 0, 0, 1, 0, 0),
    "K": (0, 0, 0, 0, 1, 0),
    "rad": (0, 0, 0, 0, 0, 1),
    "N": (1, 1, -2, 0, 0, 0),
    "Pa": (1, -1, -2, 0, 0, 0),
    "J": (1, 2, -2, 0, 0, 0),
    "W": (1, 2, -3, 0, 0, 0),
    "V": (1, 2, -3, -1, 0, 0),
    "ohm": (1, 2, -3, -2, 0, 0),
    "Hz": (0, 0, -1, 0, 0, 0),
    "1": (0, 0, 0, 0, 0, 0),
}


def exponents(unit: str) -> tuple[int, ...] | None:
    """Of kg, m, s, A, K and rad in a unit such as `W/(m^2 K)`; None of one that is not written that way."""
    upper, _, lower = unit.partition("/")
    total = [0] * len(BASE)
    for text, sign in ((upper, 1), (lower.strip("()"), -1)):
        for part in text.split():
            found = re.fullmatch(r"([A-Za-z]+|1)(?:\^(-?[0-9]+))?", part)
            if found is None or found[1] not in UNITS:
                return None
            power = sign * int(found[2] or 1)
            total = [one + power * other for one, other in zip(total, UNITS[found[1]], strict=True)]
    return tuple(total)


def _attributes(**values: object) -> str:
    return "".join(f" {name}={quoteattr(str(value))}" for name, value in values.items() if value is not None)


def _number(value: float) -> str | None:
    return repr(float(value)) if math.isfinite(value) else None


def _unit_name(unit: str) -> str | None:
    return None if unit in ("-", "1", "") else unit


def _units(quantities: Iterable[Quantity]) -> Iterator[str]:
    names = sorted({name for one in quantities if (name := _unit_name(one.unit))} | {"s"})
    yield "  <UnitDefinitions>"
    for name in names:
        powers = (0, 0, 0, 0, 1, 0) if name == "degC" else exponents(name)
        if powers is None:
            yield f"    <Unit{_attributes(name=name)}/>"
            continue
        base = {key: power for key, power in zip(BASE, powers, strict=True) if power}
        offset = {"offset": 273.15} if name == "degC" else {}
        yield f"    <Unit{_attributes(name=name)}><BaseUnit{_attributes(**base, **offset)}/></Unit>"
    yield "  </UnitDefinitions>"


class Variables:
    """The variables of a unit in the order of their value references; the time has 0."""

    def __init__(self, source: CSource) -> None:
        self.sampled = source.block.period is not None
        self.time = Quantity("time", "s", "time of the simulation")
        self.rows: list[tuple[Quantity, str]] = [
            *((one, "parameter") for one in source.parameters),
            *((one, "input") for one in source.inputs),
            *((one, "output") for one in source.outputs),
        ]

    @property
    def quantities(self) -> list[Quantity]:
        return [one for one, _ in self.rows]

    def variability(self, causality: str) -> str:
        """A gain may be turned while it runs; a parameter of a model may not, for the state at rest depends on it."""
        if causality == "parameter":
            return "tunable" if self.sampled else "fixed"
        return "discrete" if self.sampled else "continuous"


def _settings(one: Quantity, causality: str) -> dict[str, object]:
    """start, min and max."""
    result: dict[str, object] = {"unit": _unit_name(one.unit), "min": _number(one.low), "max": _number(one.high)}
    return result if causality == "output" else result | {"start": repr(float(one.start))}


def _heads(variables: Variables) -> Iterator[tuple[str, str]]:
    """Of each variable what both versions say of it: its attributes, and those of its value."""
    for number, (one, causality) in enumerate(variables.rows, start=1):
        head = _attributes(
            name=one.name,
            valueReference=number,
            description=one.about or None,
            causality=causality,
            variability=variables.variability(causality),
            initial={"parameter": "exact", "output": "calculated"}.get(causality),
        )
        yield head, _attributes(**_settings(one, causality))


def _variables_2(variables: Variables) -> Iterator[str]:
    shared = {"name": "time", "valueReference": 0, "causality": "independent", "variability": "continuous"}
    yield f'    <ScalarVariable{_attributes(**shared)}><Real unit="s"/></ScalarVariable>'
    for head, settings in _heads(variables):
        yield f"    <ScalarVariable{head}><Real{settings}/></ScalarVariable>"


def _variables_3(variables: Variables) -> Iterator[str]:
    yield '    <Float64 name="time" valueReference="0" causality="independent" variability="continuous" unit="s"/>'
    for head, settings in _heads(variables):
        yield f"    <Float64{head}{settings}/>"


def _structure(variables: Variables, version: str) -> Iterator[str]:
    numbers = [k for k, (_, causality) in enumerate(variables.rows, start=1) if causality == "output"]
    yield "  <ModelStructure>"
    if version == FMI3:
        yield from (f'    <Output valueReference="{k}"/>' for k in numbers)
        yield from (f'    <InitialUnknown valueReference="{k}"/>' for k in numbers)
    else:  # by their place among the variables, which counts from 1, and the time is the first
        for name in ("Outputs", "InitialUnknowns"):
            yield f"    <{name}>"
            yield from (f'      <Unknown index="{k + 1}"/>' for k in numbers)
            yield f"    </{name}>"
    yield "  </ModelStructure>"


def model_description(source: CSource, version: str, token: str, tool: str, files: Sequence[str]) -> str:
    """modelDescription.xml. files: the sources, for FMI 2.0; FMI 3.0 lists them in a file of its own (`build_description`)."""
    variables = Variables(source)
    of_three = version == FMI3
    state = "FMUState" if of_three else "FMUstate"
    capabilities = {
        "modelIdentifier": source.name,
        "canHandleVariableCommunicationStepSize": "true",
        f"canGetAndSet{state}": "true",
        f"canSerialize{state}": "true",
    }
    step = source.block.period or 0.005
    head = {
        "fmiVersion": version,
        "modelName": source.name,
        ("instantiationToken" if of_three else "guid"): token,
        "description": source.block.title,
        "generationTool": tool,
        "variableNamingConvention": "flat",
    }
    listed = "".join(f"<File{_attributes(name=name)}/>" for name in files)
    sources = "/>" if of_three or not files else f"><SourceFiles>{listed}</SourceFiles></CoSimulation>"
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<fmiModelDescription{_attributes(**head)}>",
        f"  <CoSimulation{_attributes(**capabilities)}{sources}",
        *_units(variables.quantities),
        '  <LogCategories><Category name="logStatusError"/></LogCategories>',
        f"  <DefaultExperiment{_attributes(startTime=0.0, stopTime=10.0, stepSize=step)}/>",
        "  <ModelVariables>",
        *(_variables_3(variables) if of_three else _variables_2(variables)),
        "  </ModelVariables>",
        *_structure(variables, version),
        "</fmiModelDescription>",
        "",
    ]
    return "\n".join(lines)


def build_description(name: str, files: Sequence[str]) -> str:
    """sources/buildDescription.xml of FMI 3.0."""
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<fmiBuildDescription fmiVersion="3.0">',
        f"  <BuildConfiguration{_attributes(modelIdentifier=name)}>",
        '    <SourceFileSet language="C99">',
        *(f"      <SourceFile{_attributes(name=one)}/>" for one in files),
        "    </SourceFileSet>",
        "  </BuildConfiguration>",
        "</fmiBuildDescription>",
        "",
    ]
    return "\n".join(lines)
