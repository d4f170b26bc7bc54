"""The shape of an experiment file: its sections, keys and their types. Meaning is checked in `load`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import ConfigDict, Field, model_validator

from smajax.data.experiment.toml_file import Places, Quantity, Section, read_toml, validated


class ModelSection(Section):
    """Which base model, and the parameters that are known: presets by name, or a model file."""

    wire: str = Field(default="", description="the name of a wire, as text")
    load: str = Field(default="", description="the name of a load, as text")
    drive: str = Field(default="", description="the name of a drive, as text ('none' when nothing drives the wire)")
    law: str = Field(
        default="",
        description="the name of a law (`smajax presets`), as text; `integrated`: cycles close; left out, the wire's own",
    )
    file: str | None = Field(default=None, description="the path of a model file, relative to this file, as text")
    parameters: dict[str, Quantity] = Field(default={}, description="a table of name = 'number unit'")

    @model_validator(mode="after")
    def _one_way(self) -> ModelSection:
        named = [key for key in ("wire", "load", "drive", "law") if getattr(self, key)]
        if self.file is not None and named:
            raise ValueError(f"got file and {named[0]}; the file says its {named[0]}: remove one of the two")
        return self


class PriorSection(Section):
    """What is known of a value before the runs: a normal distribution of it, or of its logarithm."""

    mean: Quantity = Field(description="text like '80 W/m^2/K'")
    sigma: Quantity | None = Field(default=None, description="text like '10 W/m^2/K'")
    log_sigma: float | None = Field(default=None, gt=0.0, description="a number above 0; 0.2 is about 20 %")

    @model_validator(mode="after")
    def _one_spread(self) -> PriorSection:
        if (self.sigma is None) == (self.log_sigma is None):
            got = "both sigma and log_sigma" if self.sigma is not None else "neither sigma nor log_sigma"
            raise ValueError(f"got {got}; give sigma = 'number unit', or log_sigma = 0.2 for one of the logarithm")
        return self


class BoxSection(Section):
    """A value to be found: its box, where the search starts, and what is known of it."""

    low: Quantity = Field(description="text like '20 W/m^2/K'")
    high: Quantity = Field(description="text like '400 W/m^2/K'")
    start: Quantity = Field(description="text like '80 W/m^2/K'")
    prior: PriorSection | None = Field(default=None, description="a table with mean, and sigma or log_sigma")


class UnknownSection(BoxSection):
    """A parameter to be found."""

    per_run: bool = Field(default=False, description="true (a value of each run's own) or false (one for all runs)")
    fixed: bool = Field(default=False, description="true (held at start) or false")

    @model_validator(mode="after")
    def _free(self) -> UnknownSection:
        if self.fixed and (self.per_run or self.prior is not None):
            raise ValueError("is fixed, so per_run and prior mean nothing; remove them, or fixed")
        return self


class NuisanceSection(Section):
    """What is fitted per run and means nothing."""

    offset: bool = Field(default=False, description="true or false: whether the sensor's zero moves from run to run")
    initial_temperature: BoxSection | None = Field(default=None, description="a table with low, high, start")
    initial_martensite_fraction: BoxSection | None = Field(default=None, description="a table with low, high, start")


class SamplingSection(Section):
    """The uniform clock that all signals are brought to; of samples that are counted, how far apart they are."""

    step: Quantity = Field(description="text like '50 ms'")


class TimeSection(Section):
    """Where the time is, for files whose signals carry none of their own."""

    kind: Literal["column", "sample"] = Field(
        default="column", description="'column' or 'sample' (samples are counted)"
    )
    column: str | int | None = Field(default=None, description="the name of the time column, or its number from 1")
    unit: str = Field(default="s", description="text like 's' or 'ms'")
    repeated: Literal["refuse", "mean", "last"] = Field(
        default="refuse", description="'refuse', 'mean' or 'last': what becomes of samples at the same time that differ"
    )

    @model_validator(mode="after")
    def _one_way(self) -> TimeSection:
        if self.kind == "sample" and self.column is not None:
            raise ValueError("got kind = 'sample' and a column; with 'sample' the clock counts samples: remove one")
        if self.kind == "column" and self.column is None:
            raise ValueError("names no column; give column = '...', or kind = 'sample' when there is no time")
        return self


def is_counted(time: TimeSection | None) -> bool:
    """Whether no column is a time, and samples are counted."""
    return time is not None and time.kind == "sample"


def noise_example(unit: str) -> str:
    """A noise as a file may give it, of a sensor whose readings are in `unit`: 0.01 mm."""
    number = "0.1" if unit in ("deg", "rad", "Pa", "MPa", "degC", "K") else "0.01"
    return f"{number} {({'m': 'mm', 'rad': 'deg', 'Pa': 'MPa', '1': '%', '-': '%', '': '%'}).get(unit, unit)}"


class ChannelSection(Section):
    """One signal: what it is in the model, and where it is in the files."""

    role: Literal["input", "output"] = Field(description="'input' or 'output'")
    column: str | int | None = Field(default=None, description="the name of a column, or its number from 1")
    variable: str | None = Field(default=None, description="the name of a MATLAB variable, as text")
    unit: str = Field(description="text like 'MPa', or '1' for a plain number")
    noise: Quantity | None = Field(default=None, description="'estimate', or text like '0.01 mm'")
    offset: bool | None = Field(
        default=None, description="true or false: goes before [nuisance] offset for this output"
    )
    missing: Literal["refuse", "skip"] = Field(default="refuse", description="'refuse' or 'skip'")
    reversed: bool = Field(default=False, description="true (the sensor counts the other way round) or false")

    @model_validator(mode="after")
    def _one_place(self) -> ChannelSection:
        if self.column is not None and self.variable is not None:
            raise ValueError("got both column and variable; give column for a text file, variable for a .mat file")
        if self.role == "input" and self.noise is not None:
            raise ValueError("got a noise for an input; noise belongs to the output channel, remove it")
        if self.role == "input" and self.offset is not None:
            raise ValueError("got an offset for an input; offsets are those of outputs, remove it")
        if self.role == "input" and self.reversed:
            raise ValueError("got reversed for an input; only an output's sensor can be mounted the other way round")
        if self.role == "input" and self.missing == "skip":
            raise ValueError("got missing = 'skip' for an input; the model needs every sample of it: fill the gaps")
        if self.role == "output" and self.column is None and self.variable is None:
            raise ValueError("does not say where the output is; give column (text file) or variable (.mat file)")
        return self


class LogFormat(Section):
    """How logs are read: their channels, their time, and the clock that they are brought to."""

    channels: dict[str, ChannelSection] = Field(description="sections [channels.NAME] with role, unit and a place")
    time: TimeSection | None = Field(default=None, description="a section [time] with column and unit, or kind")
    sampling: SamplingSection | None = Field(default=None, description="a section [sampling] with step")
    decimal: Literal[",", "."] | None = Field(default=None, description="',' or '.': the decimal mark of text files")


class DataSection(Section):
    """Where the measured files are."""

    folder: str = Field(default=".", description="a folder, relative to this file; it may begin with ${SMAJAX_DATA}")
    decimal: Literal[",", "."] | None = Field(
        default=None, description="',' or '.': what stands before the decimals of a number in a text file"
    )


class RunSection(Section):
    """One measured run."""

    name: str = Field(min_length=1, description="text that names the run")
    role: Literal["fit", "held-out"] = Field(description="'fit' or 'held-out'")
    file: str | None = Field(default=None, description="the name of one file with all channels")
    files: dict[str, str] | None = Field(default=None, description="a table of channel = 'file'")
    columns: dict[str, str | int] = Field(
        default={}, description="a table of channel (or time) = 'column', where this run's log calls it otherwise"
    )
    units: dict[str, str] = Field(
        default={}, description="a table of channel (or time) = 'unit', where this run's log has another"
    )
    reversed: list[str] = Field(
        default=[], description="a list of outputs whose sensor was mounted the other way round in this run alone"
    )
    start: Quantity | None = Field(
        default=None, description="a time in the log, 'number unit', before which it is left out"
    )
    end: Quantity | None = Field(
        default=None, description="a time in the log, 'number unit', after which it is left out"
    )
    parameters: dict[str, Quantity] = Field(default={}, description="a table of name = 'number unit'")
    inputs: dict[str, Quantity] = Field(
        default={}, description="a table of input = 'number unit', constant in this run"
    )

    @model_validator(mode="after")
    def _one_way(self) -> RunSection:
        if (self.file is None) == (self.files is None):
            got = "both file and files" if self.file is not None else "neither file nor files"
            raise ValueError(f"got {got}; give file = '...' for one file, or files = {{channel = '...'}} for several")
        return self


class EffectsSection(Section):
    """Which candidate effects the search may try."""

    only: list[str] | None = Field(default=None, description="a list of effect names")
    exclude: list[str] = Field(default=[], description="a list of effect names")


class SpreadSection(Section):
    """How far a value may lie from the middle of its prior: a normal distribution of it, or of its logarithm."""

    width: Quantity | None = Field(default=None, description="a standard deviation above zero, text like '10 J/g'")
    relative: float | None = Field(default=None, gt=0.0, description="a number above 0; 0.2 is about 20 %")

    @model_validator(mode="after")
    def _one_spread(self) -> SpreadSection:
        if self.width is not None and self.relative is not None:
            raise ValueError("got both width and relative; give width = 'number unit', or relative = 0.2 for a share")
        return self


class CoefficientPriorSection(SpreadSection):
    """The prior of a coefficient of a candidate effect, in the place of the library's."""

    base: Quantity | None = Field(default=None, description="the middle of the prior, text like '5 s'")

    @model_validator(mode="after")
    def _something(self) -> CoefficientPriorSection:
        if self.base is None and self.width is None and self.relative is None:
            raise ValueError("says nothing; give base, width or relative")
        return self


class PresetPriorSection(SpreadSection):
    """How uncertain a value is that the file does not list, and about what."""

    base: Quantity | None = Field(
        default=None, description="the middle of the prior, where it is not the preset's value; text like '0.9 uohm m'"
    )

    @model_validator(mode="after")
    def _something(self) -> PresetPriorSection:
        if self.width is None and self.relative is None:
            raise ValueError(
                "does not say how uncertain the value is; give width = 'number unit', or relative = 0.2 for a share of it (what is "
                "known goes into [model.parameters])"
            )
        return self


class EffectPriorSection(Section):
    """What is known of a candidate effect before the runs: its odds, and the priors of its coefficients by their names."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)
    __pydantic_extra__: dict[str, CoefficientPriorSection]

    odds: str | float | None = Field(default=None, description="a class of odds, or a number above 0 and at most 1")


class PriorsSection(Section):
    """Priors in the place of the library's: a section for each effect by its name, and one for the values of presets."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)
    __pydantic_extra__: dict[str, EffectPriorSection]

    presets: dict[str, PresetPriorSection] = Field(
        default={}, description="a table of parameter = { relative = 0.1 } or { width = 'number unit' }"
    )

    @property
    def bases(self) -> dict[str, str]:
        """Likely values, with their units, that are not those of the presets."""
        return {name: str(one.base) for name, one in self.presets.items() if one.base is not None}


class ExperimentFile(Section):
    """The whole file."""

    title: str = Field(default="", description="one line of text")
    model: ModelSection = Field(description="a section [model] with wire, load and drive")
    unknown: dict[str, UnknownSection] = Field(default={}, description="sections [unknown.NAME] with low, high, start")
    nuisance: NuisanceSection = Field(default=NuisanceSection(), description="a section [nuisance]")
    sampling: SamplingSection | None = Field(default=None, description="a section [sampling] with step")
    time: TimeSection | None = Field(default=None, description="a section [time] with column and unit, or kind")
    channels: dict[str, ChannelSection] = Field(description="sections [channels.NAME] with role, unit and a place")
    data: DataSection = Field(default=DataSection(), description="a section [data] with folder")
    runs: list[RunSection] = Field(min_length=1, description="one section [[runs]] a run, with name, role and file")
    effects: EffectsSection = Field(default=EffectsSection(), description="a section [effects]")
    priors: PriorsSection = Field(
        default=PriorsSection.model_validate({}), description="sections [priors.EFFECT], and [priors.presets]"
    )

    @property
    def log_format(self) -> LogFormat:
        """How the logs of its runs are read."""
        return LogFormat(channels=self.channels, time=self.time, sampling=self.sampling, decimal=self.data.decimal)


# Sections by place in the file; "*" stands for any name or number.
_PLACES: Places = {
    (): ExperimentFile,
    ("model",): ModelSection,
    ("unknown", "*"): UnknownSection,
    ("unknown", "*", "prior"): PriorSection,
    ("nuisance",): NuisanceSection,
    ("nuisance", "initial_temperature"): BoxSection,
    ("nuisance", "initial_temperature", "prior"): PriorSection,
    ("nuisance", "initial_martensite_fraction"): BoxSection,
    ("nuisance", "initial_martensite_fraction", "prior"): PriorSection,
    ("sampling",): SamplingSection,
    ("time",): TimeSection,
    ("channels", "*"): ChannelSection,
    ("data",): DataSection,
    ("runs", "*"): RunSection,
    ("effects",): EffectsSection,
    ("priors",): PriorsSection,
    ("priors", "presets", "*"): PresetPriorSection,
    ("priors", "*", "odds"): None,
    ("priors", "*", "*"): CoefficientPriorSection,
    ("priors", "*"): EffectPriorSection,
}


def _begin(path: Path) -> str:
    """What to do with a log that was given in the place of an experiment file."""
    if path.suffix.lower() == ".toml":
        return ""
    return f"; an experiment file is a .toml: if this is a log, `smajax new-experiment {path.name}` begins one from it"


def read_schema(path: Path) -> ExperimentFile:
    """Reads and checks the shape of an experiment file. Raises ExperimentError naming the file and the key."""
    content = read_toml(path, "an experiment file", ", or the folder of an experiment.toml", _begin(path))
    return validated(path, content, ExperimentFile, _PLACES)
