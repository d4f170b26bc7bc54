"""The shape of a model file: its sections, keys and their types. Meaning is checked in `read`."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from smajax.data.experiment.schema import ChannelSection, LogFormat, SamplingSection, TimeSection
from smajax.data.experiment.toml_file import Places, Quantity, Section

FORMAT = 1  # of the file; one with a higher number is from a later version
# How a file that the program wrote begins, and its last section: one that begins so and lacks that section was cut off. A file written by
# hand need not have either.
FIRST_LINE = "# A model of an SMA wire actuator, for "
LAST_SECTION = "made_with"


class PartsSection(Section):
    """Which wire, load, drive, kinetics law and effects."""

    wire: str = Field(description="the name of a wire, as text")
    load: str = Field(description="the name of a load, as text")
    drive: str = Field(description="the name of a drive, as text ('none' when nothing drives the wire)")
    law: str = Field(
        default="",
        description="the name of a law (`smajax presets`), as text; `integrated`: cycles close; left out, the wire's own",
    )
    effects: list[str] = Field(default=[], description="a list of effect names")


class ParameterSection(Section):
    """One value, with what is known of it."""

    value: Quantity = Field(description="text like '80 W/m^2/K'")
    standard_error: Quantity | None = Field(default=None, description="text like '2 W/m^2/K'")
    low: Quantity | None = Field(default=None, description="text like '20 W/m^2/K'")
    high: Quantity | None = Field(default=None, description="text like '400 W/m^2/K'")
    origin: Literal["fitted", "given", "preset"] = Field(
        default="given", description="'fitted', 'given' or 'preset': where the value is from"
    )

    @model_validator(mode="before")
    @classmethod
    def _alone(cls, content: Any) -> Any:
        """A value by itself is a given one."""
        return {"value": content} if isinstance(content, str | float | int) else content


class OutputSection(Section):
    """A sensor that the model was fitted to."""

    noise: Quantity = Field(description="text like '0.01 mm'")
    offset: bool = Field(default=False, description="true or false: whether each run has its own zero")
    prediction_error: Quantity | None = Field(default=None, description="text like '0.02 mm'")
    reading_noise: Quantity | None = Field(default=None, description="text like '0.03 mm'")


class AlternativeSection(Section):
    """Another likely model; its values are in the NetCDF file."""

    effects: list[str] = Field(description="a list of effect names")
    probability: float = Field(ge=0.0, le=1.0, description="a number from 0 to 1")


class FittedToSection(Section):
    """A run that the model was fitted to or held against."""

    run: str = Field(description="the name of a run, as text")
    role: str = Field(description="'fit' or 'held-out'")
    sha256: str = Field(default="", description="the digest of its files, as text")


class ModelFile(Section):
    """The whole file."""

    format: int = Field(description=f"a whole number, {FORMAT} of this version")
    title: str = Field(default="", description="one line of text")
    uncertainty: str | None = Field(default=None, description="the name of a NetCDF file beside this one")
    uncertainty_sha256: str | None = Field(default=None, description="the digest of that file, as text")
    probability: float = Field(default=1.0, ge=0.0, le=1.0, description="a number from 0 to 1")
    unfinished: str = Field(default="", description="what was still to come when it was written, as text")
    model: PartsSection = Field(description="a section [model] with wire, load and drive")
    parameters: dict[str, ParameterSection] = Field(
        default={}, description="a table of name = 'number unit', or name = { value = 'number unit', origin = 'given' }"
    )
    outputs: dict[str, OutputSection] = Field(default={}, description="sections [outputs.NAME] with noise")
    alternatives: list[AlternativeSection] = Field(default=[], description="sections [[alternatives]] with effects")
    fitted_range: dict[str, list[Quantity]] = Field(
        default={}, description="a table of name = ['number unit', 'number unit']"
    )
    fitted_to: list[FittedToSection] = Field(default=[], description="sections [[fitted_to]] with run and role")
    channels: dict[str, ChannelSection] = Field(default={}, description="sections [channels.NAME]")
    time: TimeSection | None = Field(default=None, description="a section [time] with column and unit, or kind")
    sampling: SamplingSection | None = Field(default=None, description="a section [sampling] with step")
    decimal: Literal[",", "."] | None = Field(default=None, description="',' or '.': the decimal mark of text files")
    made_with: dict[str, str] = Field(default={}, description="a table of name = 'text'")

    @property
    def log_format(self) -> LogFormat | None:
        """How logs are read; None where the file says nothing of them."""
        if not self.channels:
            return None
        return LogFormat(channels=self.channels, time=self.time, sampling=self.sampling, decimal=self.decimal)


PLACES: Places = {
    (): ModelFile,
    ("model",): PartsSection,
    ("parameters", "*"): ParameterSection,
    ("outputs", "*"): OutputSection,
    ("alternatives", "*"): AlternativeSection,
    ("fitted_to", "*"): FittedToSection,
    ("channels", "*"): ChannelSection,
    ("time",): TimeSection,
    ("sampling",): SamplingSection,
}
