"""Warnings about numbers that no wire of the declared model gives or stands: mostly a wrong unit or a wrong column."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.data.experiment.catalogue import Scale
from smajax.data.experiment.column_guess import in_levels
from smajax.data.experiment.declared_quantities import lagging, quantity_warnings
from smajax.data.experiment.signals import ReadRun
from smajax.data.readers.table import Array

# Channel -> (more than a wire takes, the program's own unit, the unit that such numbers usually are in).
LARGEST: Mapping[str, tuple[float, str, str]] = MappingProxyType(
    {
        "voltage": (500.0, "V", "mV"),
        "current": (100.0, "A", "mA"),
        "power": (2e3, "W", "mW"),
        "stress": (5e9, "Pa", "Pa"),
        "strain": (0.5, "", "percent"),
        "angle": (4.0 * np.pi, "rad", "deg"),
        "force": (1e4, "N", "mN"),
        "mass": (50.0, "kg", "g"),
    }
)
MELTS = 1310.0  # degC, nickel-titanium
ANNEALS = 300.0  # degC, of a drawn and trained nickel-titanium wire (Dynalloy, technical characteristics of Flexinol)
# Pa: no wire carries more. Ultimate tensile strength of nickel-titanium in typical data sheets: about 1000 MPa (annealed) to 1900 MPa (cold drawn).
STRENGTH = 1.9e9
WARMS = 5.0  # K above the air: less transforms nothing
# Shares of the wire's length: more than any alloy recovers and any bias spring bends, and less than expansion by heat.
LARGEST_STROKE, SMALLEST_STROKE = 0.3, 1e-4
COLDEST_IN_K = 200.0  # degC: where a record never falls below, it is of a furnace, or in kelvin
WARMEST_AIR = 60.0  # degC
LIGHTEST = 2e-3  # kg: 40 MPa in a wire of 25 um, the finest that is sold, and less than 1 MPa in one of 0.15 mm
COLDEST = -100.0  # degC: no bench is colder, but for one whose degC are declared to be K
IN_COMMON = 0.9
FOLLOWS, LEAST = 0.2, 20  # rank correlation of heat and output; samples
AGAINST = 0.5  # rank correlation of heat and output from which on a wrong sign is a sign turned round
LAGS = (1, 2, 4, 8)  # time constants through which an output may follow: latent heat and hysteresis hold it back
ENOUGH = 20  # such times in a run, from which on two slow signals do not follow each other by chance
# Whether heat makes an output rise or fall, on every moving load; the load's own sensor rises. Stress, resistance and a force that is not
# that sensor's do one or the other by the load and the alloy.
BY_HEAT: Mapping[str, int] = MappingProxyType({"position": 1, "angle": 1, "temperature": 1, "strain": -1})
MOVES = 0.5  # share of its samples from which on a signal that never repeats a value moves all the time


def _values(read: ReadRun, name: str) -> Array | None:
    """A channel of the run as measured, or as held constant."""
    if name in read.signals:
        return read.signals[name].measured
    return read.run.inputs.get(name)


def _extremes(runs: Sequence[ReadRun], name: str) -> tuple[float, float] | None:
    result = [values for read in runs if (values := _values(read, name)) is not None and values.size]
    return (min(float(one.min()) for one in result), max(float(one.max()) for one in result)) if result else None


def _size_warnings(runs: Sequence[ReadRun]) -> list[str]:
    """Channels whose values no wire stands; one sentence a channel."""
    result: list[str] = []
    for name, (most, own, other) in LARGEST.items():
        ends = _extremes(runs, name)
        if ends is not None and max(map(abs, ends)) > most:
            size = f"{max(map(abs, ends)):.5g} {own}".strip()
            result.append(f"the {name} reaches {size}; is it in {other}?")
    mass = _extremes(runs, "mass")
    if mass is not None and 0.0 < mass[1] < LIGHTEST:
        result.append(f"the mass is no more than {mass[1]:.5g} kg; is it in kg, and not in g?")
    stress = _extremes(runs, "stress")
    if stress is not None and 0.0 < max(map(abs, stress)) < 1e4:
        result.append(f"the stress reaches no more than {max(map(abs, stress)):.5g} Pa; is it in MPa?")
    for name, warmest in (("temperature", COLDEST_IN_K), ("ambient_temperature", WARMEST_AIR)):
        ends = _extremes(runs, name)
        if ends is not None and ends[0] > warmest:
            result.append(f"the {name} never falls below {ends[0]:.5g} degC; is it in K, or in degF?")
        elif ends is not None and ends[0] < COLDEST:
            result.append(f"the {name} falls to {ends[0]:.5g} degC; is it in degC, and not in K?")
    return result


def _mass_warnings(masses: Mapping[str, float]) -> list[str]:
    """Masses of the load that no wire moves; the run's own are a channel."""
    most, own, other = LARGEST["mass"]
    return [f"{name} is {mass:.5g} {own}; is it in {other}?" for name, mass in masses.items() if mass > most]


def _heating_warnings(runs: Sequence[ReadRun], scale: Scale, heats: Sequence[str]) -> list[str]:
    """What the inputs would do to a wire of the declared model with the values where the search starts."""
    warm: list[tuple[float, float, str]] = []
    for read in runs:
        given = {name: read.run.inputs[name] for name in heats if name in read.run.inputs}
        if len(given) == len(heats):
            rise = scale.warming(given)
            warm.append((float(np.mean(rise)), float(np.max(rise)), read.run.name))
    if not warm or not heats:
        return []
    what = " and ".join(f"{name!r}" for name in heats)
    mean, _, run = max(warm)
    if scale.ambient + mean > MELTS:
        return [
            f"run {run!r}: the mean power of the input {what} would heat the wire to {scale.ambient + mean:.4g} degC, and it "
            f"melts at {MELTS:g} degC; is the unit right, or is it another quantity, such as a duty in percent?"
        ]
    most = max(peak for _, peak, _ in warm)
    if most < WARMS:
        return [
            f"the input {what} at its highest, held for ever, would warm the wire by {most:.2g} K, which transforms nothing; "
            "is it the right column, and its unit?"
        ]
    return []


def _stroke_warnings(runs: Sequence[ReadRun], scale: Scale, offset: Collection[str]) -> list[str]:
    """A movement that no wire of this length makes: over all runs, or over each where a sensor has another zero in each."""
    apart = [[read] for read in runs] if "position" in offset else [runs]
    ends = [found for some in apart if (found := _extremes(some, "position")) is not None]
    if not ends:
        return []
    moved = max(high - low for low, high in ends)
    share = moved / scale.wire_length
    message = f"the output 'position' moves by {moved:.3g} m, {share:.3g} times the wire's length of {scale.wire_length:.3g} m"
    if share > LARGEST_STROKE:
        return [f"{message}; is it in mm, or is `wire_length` another?"]
    if 0.0 < share < SMALLEST_STROKE:
        return [f"{message}; is it in mm or m, and was the wire heated at all?"]
    return []


def _dynamics_warnings(runs: Sequence[ReadRun], scale: Scale, step: float) -> list[str]:
    """Runs and steps against the time that the wire takes to cool."""
    slow = f"the wire's time constant rho c_p d / (4 h) of {scale.time_constant:.3g} s where the search starts"
    result = [
        f"run {read.run.name!r} lasts {read.run.time[-1] - read.run.time[0]:.3g} s, less than {slow}: it tells little of "
        "heat and nothing of rest; take a longer run"
        for read in runs
        if read.run.time[-1] - read.run.time[0] < scale.time_constant
    ]
    if step > 0.5 * scale.time_constant:
        result.append(f"the step of {step:.3g} s is more than half of {slow}; take a shorter one")
    return result


def _exchange_warnings(runs: Sequence[ReadRun], heats: Sequence[str]) -> list[str]:
    """A command rests at levels and a sensor moves; the other way round the two columns are exchanged."""
    first = runs[0]
    commands = [name for name in heats if name in first.signals]
    for name in commands:
        moving = first.signals[name].measured
        for output in first.run.outputs:
            resting = first.signals[output].measured
            if resting.size < 20 or moving.size < 20 or np.ptp(resting) == 0.0:
                continue
            if in_levels(resting) and np.unique(moving).size > MOVES * moving.size:
                return [
                    f"run {first.run.name!r}: the output {output!r} rests at a few levels and the input {name!r} moves all the "
                    "time; are the two columns exchanged?"
                ]
    return []


@dataclass(frozen=True)
class _Following:
    """How the output of a run follows the heat: rank correlations by `LAGS`."""

    run: str
    by_lag: Array
    many: Array  # whether the run has `ENOUGH` times that lag; of the shortest always

    @property
    def sign(self) -> float:
        """The largest of the correlations."""
        return float(max(self.by_lag, key=abs))

    @property
    def told(self) -> float:
        """The size of the largest by a lag that the run has many of."""
        return float(np.abs(self.by_lag[self.many]).max())


def _following(
    runs: Sequence[ReadRun], scale: Scale, heats: Sequence[str], step: float
) -> Mapping[str, Sequence[_Following]]:
    """Output -> how it follows the heat in each run that tells it.

    Heat is the power through some time constants of the wire; what follows it rises and falls with it, by whatever curve.
    """
    following: dict[str, Sequence[_Following]] = {}
    for name in runs[0].run.outputs:
        result = []
        for read in runs:
            given = {channel: read.run.inputs[channel] for channel in heats if channel in read.run.inputs}
            output = read.run.outputs[name]
            there = np.isfinite(output)
            if len(given) < len(heats) or there.sum() < LEAST or np.ptp(output[there]) == 0.0:
                continue
            power = scale.warming(given)
            warm = [lagging(power, step, lag * scale.time_constant)[there] for lag in LAGS]
            if np.ptp(warm[0]) > 0.0:
                by_lag = np.asarray([scipy.stats.spearmanr(one, output[there]).statistic for one in warm])
                lasts = there.sum() * step / (scale.time_constant * np.asarray(LAGS))
                result.append(_Following(read.run.name, by_lag, (lasts >= ENOUGH) | (np.arange(len(LAGS)) == 0)))
        if result:
            following[name] = result
    return following


def _unrelated_warnings(following: Mapping[str, Sequence[_Following]]) -> list[str]:
    """Outputs that do not follow the heat by any lag: files that do not belong together, or samples out of order.

    By any, because the wire's time constant may be a preset's that is ten times thinner.
    """
    for name, result in following.items():
        median = float(np.median([one.told for one in result]))
        if median < FOLLOWS:
            return [
                f"the output {name!r} hardly follows the heat (rank correlation {median:.2f} in the median run): do "
                "inputs and outputs belong together, and are the samples in order? What is fitted or found would mean nothing"
            ]
    return []


def _reversed_warnings(following: Mapping[str, Sequence[_Following]], own: str) -> list[str]:
    """Outputs that move against the heat where the model's move with it, or the other way round, in all runs or in some. own: that of the load's sensor."""
    message, signs = [], {**BY_HEAT, own: 1}
    for name, result in following.items():
        if name not in signs:
            continue
        median = float(np.median([one.sign for one in result]))
        way = "rises" if signs[name] > 0 else "falls"
        if signs[name] * median < -AGAINST:
            message.append(
                f"the output {name!r} moves against the model (rank correlation with the heat {median:.2f} in the median run; "
                f"the model's {way} with it): is the sensor's sign reversed? Set "
                f"reversed = true under [channels.{name}], or take it out where it is set"
            )
            continue
        # One of the other sign hardly shows in the median, and no fit makes up for it.
        message += [
            f"run {one.run!r}: the output {name!r} moves against the model (rank correlation with the heat {one.sign:.2f}; the model's {way} with it, as "
            f"in the median run): was the sensor mounted the other way round? Set reversed = [{name!r}] in that run, or take it out where it is set"
            for one in result
            if signs[name] * median > FOLLOWS and signs[name] * one.sign < -AGAINST
        ]
    return message


def common_warnings(runs: Sequence[ReadRun], counted: bool) -> list[str]:
    """Signals of one run that begin or end at different times: only what all have in common is used. counted: whether they have no times of their own."""
    rate = (
        "; samples are counted, one step of [sampling] apart in every log: have these logs the same rate?"
        if counted
        else ""
    )
    result = []
    for read in runs:
        used = float(read.run.time[-1] - read.run.time[0])
        name, longest = max(
            ((name, float(one.time[-1] - one.time[0])) for name, one in read.signals.items()), key=lambda one: one[1]
        )
        if used < IN_COMMON * longest - (read.run.time[1] - read.run.time[0]):
            result.append(
                f"run {read.run.name!r}: {name!r} lasts {longest:.4g} s, and only {used:.4g} s are common to all signals; the "
                f"rest is not used{rate}"
            )
    return result


def magnitude_warnings(
    runs: Sequence[ReadRun], scale: Scale | None, heats: Sequence[str], step: float, offset: Collection[str] = ()
) -> list[str]:
    """All of them. scale: of the model at its known values and starts; heats: the inputs that heat the wire; offset: outputs with a zero of their own in each run."""
    result = [*_exchange_warnings(runs, heats), *_size_warnings(runs)]
    if scale is not None:
        result += _mass_warnings(scale.masses)
        result += [*_heating_warnings(runs, scale, heats), *_stroke_warnings(runs, scale, offset)]
        result += quantity_warnings(runs, scale, heats, step, offset)
        if heats:
            following = _following(runs, scale, heats, step)
            result += [
                *_dynamics_warnings(runs, scale, step),
                *_unrelated_warnings(following),
                *_reversed_warnings(following, scale.own),
            ]
    return result
