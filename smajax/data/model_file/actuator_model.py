"""A model of an actuator that can be kept as a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from smajax.data.model_file.record import ModelRecord
from smajax.data.model_file.write import write_model


@dataclass(frozen=True)
class ActuatorModel(ModelRecord):
    """A model of an actuator: what `smajax close-loop` and `smajax identify` write as `model.toml`, or a user by hand.

    `system`: ready to be simulated. `values`, `parameters`: every value, SI. `draws`, `plants`: models from its posterior.
    """

    def save(self, path: str | Path) -> Path:
        """Write `path` (TOML), and what is known of fitted values beside it (NetCDF, of the same name); the path.

        Raises ExperimentError for a name without `.toml`.
        """
        return write_model(self, Path(path))
