"""From a plant to a closed loop around it: any composed system, a controller by name, and what lies between."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from smajax.control.controller_call import check_is_controller
from smajax.control.controllers.base import AbstractController
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.gains_file import Gains, read_gains
from smajax.control.load_equation import moving_load
from smajax.control.loop_dataset import Loop
from smajax.control.measured_state import Sensor
from smajax.control.presets import CONTROLLERS, check_controller, filter_of
from smajax.core.names import close_matches
from smajax.core.units import UnitError, parse_quantity
from smajax.model.system import System


def loop_around(
    system: System,
    controller: str | AbstractController,
    gains: Mapping[str, float | str] | Gains | Path | str | None = None,
    *,
    estimator: str | AbstractEstimator | None = None,
    noise: float | str = 0.0,
    quantum: float | str = 0.0,
    delay: int = 0,
    assumed: System | None = None,
) -> Loop:
    """A closed loop on any load that moves, wire law and effects, for `simulate_loop_dataset`.

    controller: the name of one in `CONTROLLERS`, or one of one's own. gains: by name, SI or text with a unit (`"900 V/m"`), a
    file of `smajax tune`, or none: those of the arm, scaled to this plant (`control.scales`); gains that are not named keep
    that value. estimator: the name of a filter, or one of one's own; none: the true state. noise: standard deviation of the
    reading, rad or m, or text (`"20 um"`). A filter by name (`model`, `adaptive`) has the same noise for the standard deviation of a reading
    (`reading_noise`), 0 leaves it its preset's (`presets.filter_of`); one of one's own keeps what it has, and `printed` the R of its preset. quantum: step between two readings, likewise; 0: none. delay: control periods until a command arrives. assumed: the plant that
    controller and filter know; by default the system itself.

    Raises KeyError for a controller or filter there is not, TypeError for what is neither a controller nor a name, GainsFileError for a file that cannot be used, UnitError for a
    unit of another kind, ValueError for a gain there is not, and where the load or the drive does not give what the
    controller needs: which controller, which load, what is missing, which controllers can.
    """
    believed = system if assumed is None else assumed
    own = moving_load(system).reading[1]
    sigma, steps = (parse_quantity(one, own, bare=own) for one in (noise, quantum))
    sensor = Sensor(noise_sigma=sigma, quantum=steps) if sigma or steps else None
    filtered = filter_of(estimator, believed, sigma) if isinstance(estimator, str) else estimator
    if isinstance(controller, AbstractController):
        if gains is not None:
            raise ValueError("gains go with the name of a controller: a controller of one's own has its gains already.")
        return Loop(system, controller, filtered, sensor, delay, assumed)
    if not isinstance(controller, str):
        check_is_controller(controller)
    if controller not in CONTROLLERS:
        raise KeyError(f"no controller {controller!r}{close_matches(controller, CONTROLLERS, 'there are')}")
    check_controller(controller, believed)
    preset = CONTROLLERS[controller]
    known = preset.plant(believed)
    its = None if assumed is None else known
    return Loop(preset.plant(system), _gains(controller, gains, known).put(known), filtered, sensor, delay, its)


def _gains(controller: str, gains: Mapping[str, float | str] | Gains | Path | str | None, system: System) -> Gains:
    """Numbers in SI. Raises ValueError for gains of another controller."""
    if isinstance(gains, Path | str):
        gains = read_gains(Path(gains), system)
    if isinstance(gains, Gains):
        if gains.controller != controller:
            raise ValueError(f"these gains are of {gains.controller}, expected those of {controller}.")
        return gains
    if not gains:
        return Gains(controller, {})
    units = Gains(controller, {}).units(system)
    unknown = [name for name in gains if name not in units]
    if unknown:
        box = CONTROLLERS[controller].box
        raise ValueError(f"{controller} has no gain {unknown[0]!r}{close_matches(unknown[0], box, 'tuned are')}.")
    return Gains(
        controller,
        {name: _gain(name, value, "1" if units[name] == "-" else units[name]) for name, value in gains.items()},
    )


def _gain(name: str, value: float | str, unit: str) -> float:
    try:
        return parse_quantity(value, unit, bare=unit)
    except UnitError as error:
        raise UnitError(f"{name}: {error}") from None
