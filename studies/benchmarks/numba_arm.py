"""The scheme of `arm.cpp` in numba's Python, for the rotary arm under a held voltage; imports numpy alone.

`build` makes the program of the decorators it is given: numba's, or `PLAIN` ones, by which it runs as ordinary Python. What
happens in each phase, and why, is told in `arm.cpp`; names are the same. A block of members goes through each phase
together: short loops over the lanes of one flat array at offsets known to the compiler, which then needs no test of whether two
of them overlap and makes vector instructions of every loop.

More than 400 lines: the scheme is one function of 440, which numba has to see whole (its comment says why); a module of its own for
the 150 lines of numbers before it would part names that both use, and leave one above 400 all the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

GRAVITY = 9.81  # m/s^2
QUICK, INNER, INNER_LATER = 2, 3, 1
MOST_QUICK, MOST_ITERATIONS, UNDAMPED, MOST_HALVINGS = 6, 50, 12, 80
TOLERANCE, FINISHED, NARROWEST_RANGE = 1e-4, 1e-9, 0.05
COSINE = (
    -1.2337005501361697,
    0.253669507901046,
    -0.02086348076331063,
    0.0009192602745006437,
    -2.5202041041025108e-05,
    4.710846321668482e-07,
    -6.3832315751919636e-09,
    6.357424822347121e-11,
)
COSINE_SLOPE = (-2.467399217797122, 1.0146177496075262, -0.1248783185922484, 0.006865300346788672)
FIELDS = 48  # numbers of a member in a block
COLUMNS = 4  # of a result: final angle, largest angle, smallest fraction, final temperature

Constants = Mapping[str, float]  # by smajax's names, SI, temperatures in C
Decorator = Callable[[Any], Any]


class Tools(NamedTuple):
    """How functions are compiled: into their callers, by themselves, or over all cores, which count by `over`."""

    inlined: Decorator
    compiled: Decorator
    parallel: Decorator
    over: Any


def _as_it_is(function: Any) -> Any:
    return function


PLAIN = Tools(_as_it_is, _as_it_is, _as_it_is, range)


class Rig(NamedTuple):
    """What all members share; numbers of one precision."""

    step: Any
    per_step: Any
    ahead: Any
    keeps: Any
    ambient: Any
    ohms: Any
    ohms_more: Any
    modulus: Any
    modulus_more: Any
    recoverable: Any
    thermal: Any
    contraction: Any
    start: Any
    rest_angle: Any
    lower: Any
    upper: Any
    per_width_A: Any
    per_width_M: Any
    per_slope_A: Any
    per_slope_M: Any
    start_A: Any
    start_M: Any
    tolerance: Any
    angle_scale: Any
    resting: Any
    initial_temperature: Any
    initial_fraction: Any


def _sizes(p: Constants, dt: float) -> tuple[float, float, float, float]:
    """g = gamma dt in s, cross-section in m^2, heat capacity in J/(m K), g h_c A_c/(m c_p)."""
    g = (1.0 - math.sqrt(0.5)) * dt
    area = 0.25 * math.pi * p["wire_diameter"] ** 2
    capacity = p["density"] * area * p["specific_heat"]
    return g, area, capacity, g * p["convection_coefficient"] * math.pi * p["wire_diameter"] / capacity


def rig_of(p: Constants, dt: float, real: Any) -> Rig:
    """The shared numbers for steps of `dt` s in the precision `real`."""
    gamma = 1.0 - math.sqrt(0.5)
    g, area, _, loss = _sizes(p, dt)
    contraction = 2.0 * p["pulley_radius"] / p["wire_length"]
    width_A = max(p["austenite_finish"] - p["austenite_start"], NARROWEST_RANGE)
    width_M = max(p["martensite_start"] - p["martensite_finish"], NARROWEST_RANGE)
    rounding = float(np.finfo(real).eps)
    shared = Rig(
        step=g,
        per_step=1.0 / g,
        ahead=(1.0 - gamma) / gamma,
        keeps=1.0 / (1.0 + loss),
        ambient=loss / (1.0 + loss) * p["ambient_temperature"],
        ohms=p["resistivity_austenite"] / area,
        ohms_more=(p["resistivity_martensite"] - p["resistivity_austenite"]) / area,
        modulus=p["young_modulus_austenite"],
        modulus_more=p["young_modulus_martensite"] - p["young_modulus_austenite"],
        recoverable=p["recoverable_strain"],
        thermal=p["thermal_modulus"],
        contraction=contraction,
        start=p["start_angle"],
        rest_angle=p["spring_rest_angle"],
        lower=p["lower_stop"],
        upper=p["upper_stop"],
        per_width_A=1.0 / width_A,
        per_width_M=1.0 / width_M,
        per_slope_A=1.0 / (width_A * p["stress_slope_austenite"]),
        per_slope_M=1.0 / (width_M * p["stress_slope_martensite"]),
        start_A=p["austenite_start"] / width_A,
        start_M=(p["martensite_finish"] + width_M) / width_M,
        tolerance=max(TOLERANCE, 1e3 * rounding),
        angle_scale=100.0 * contraction,
        resting=max(1e-10, 64.0 * rounding),
        initial_temperature=p["ambient_temperature"],
        initial_fraction=p["start_fraction"],
    )
    return Rig(*(real(value) for value in shared))


def members_of(p: Constants, dt: float, voltage: np.ndarray, payload_mass: np.ndarray) -> np.ndarray:
    """What is a member's own, float64 of shape (6, members): heating, gravity, spring, damping, pull, first stress in Pa."""
    g, area, capacity, loss = _sizes(p, dt)
    inertia = p["inertia_ratio"] * (payload_mass + p["link_mass"] / 3.0) * p["arm_length"] ** 2
    by_inertia = g * g / inertia
    put = np.minimum(np.abs(p["amplifier_gain"] * voltage), p["amplifier_limit"]) / p["wire_length"]
    weight = (payload_mass + 0.5 * p["link_mass"]) * GRAVITY * p["arm_length"]
    stiffness, lever_area = p["spring_stiffness"] * p["spring_lever"] ** 2, 2.0 * p["pulley_radius"] * area
    angle = p["start_angle"]
    resisting = weight * math.cos(angle) + stiffness * (angle - p["spring_rest_angle"])
    return np.stack(
        [
            g / capacity / (1.0 + loss) * put * put,
            by_inertia * weight,
            by_inertia * stiffness,
            by_inertia * p["damping"] / g,
            by_inertia * lever_area,
            np.maximum(resisting / lever_area, 0.0),
        ]
    )


# One function of 440 lines: numba inlines what is written within it, in the precision that it closes over.
def build(real: Any, lanes: int, tools: Tools = PLAIN) -> Callable[..., Any]:
    """`simulate(rig, members, steps, every, record, result)` in the precision `real` (numpy's), `lanes` members to a block.

    `rig` by `rig_of`, `runs` by `members_of` in the same precision, their number a multiple of `lanes`. `result` of shape
    (members, COLUMNS) is filled; `record` of shape (samples, members recorded, 2) with angle in rad and fraction at every
    `every`-th sample, the first one included. Returns the iterations of all stages of all blocks.
    """
    inlined, compiled, parallel, over = tools
    double = np.finfo(real).bits == 64
    # Numbers of the precision itself: a plain one would make float64 of all it meets.
    number = float if double else real
    zero, half, one, two = (number(value) for value in (0.0, 0.5, 1.0, 2.0))
    finished_at, by_stress, full = number(FINISHED), number(1e-4), number(lanes)
    rounding = number(4.0 * float(np.finfo(real).eps))
    per_pi, back_pi = number(1.0 / math.pi), number(-2.0 / math.pi)
    c0, c1, c2, c3, c4, c5, c6, c7 = (number(value) for value in COSINE)
    d0, d1, d2, d3 = (number(value) for value in COSINE_SLOPE)
    offsets = tuple(range(0, FIELDS * lanes, lanes))
    HEATING, GRAVITATION, SPRING, DAMPING, PULL = offsets[:5]
    TEMPERATURE, ANGLE, VELOCITY, STRESS, STRAIN, FRACTION = offsets[5:11]
    AMPLITUDE_A, AMPLITUDE_M, MISSED_A, MISSED_M = offsets[11:15]
    DISTANCE_A, DISTANCE_M, SHARE_A, SHARE_M, LARGEST, SMALLEST = offsets[15:21]
    BASE_TEMPERATURE, BASE_ANGLE, BASE_VELOCITY = offsets[21:24]
    Z_TEMPERATURE, Z_ANGLE, Z_STRESS, Z_FRACTION, Z_FREE, BRANCH, ENOUGH = offsets[24:31]
    COSINES, SINES = offsets[31:33]
    STEP_TEMPERATURE, MORE_TEMPERATURE, STEP_ANGLE, MORE_ANGLE = offsets[33:37]
    STEP_STRESS, MORE_STRESS, FREE, MORE_FREE = offsets[37:41]
    CHOSEN, PHASE, AMPLITUDE, DISTANCE, SLOPE, GONE, GONE_LAST = offsets[41:48]

    @inlined
    def quarter_cosine(z: Any) -> Any:
        s = z * z
        s2 = s * s
        first = (c0 + c1 * s) + (c2 + c3 * s) * s2
        last = c4 + c5 * s
        if double:
            last += (c6 + c7 * s) * s2
        return one + s * (first + last * (s2 * s2))

    @inlined
    def quarter_cosine_slope(s: Any) -> Any:
        return (d0 + d1 * s) + (d2 + d3 * s) * (s * s)

    @inlined
    def larger(a: Any, b: Any) -> Any:
        return a if a > b else b

    @inlined
    def within(value: Any, low: Any, high: Any) -> Any:
        floored = low if value < low else value
        return high if floored > high else floored

    @inlined
    def share_left(z: Any) -> Any:
        root = quarter_cosine(within(z, zero, one))
        share = root * root
        return share if share > finished_at else zero

    @inlined
    def turn(b: Any, i: int) -> None:
        turns = b[Z_ANGLE + i] * per_pi
        whole = np.rint(turns)
        sign = one - two * (whole - two * np.floor(half * whole))
        z = two * (turns - whole)
        b[COSINES + i] = sign * quarter_cosine(z)
        b[SINES + i] = sign * (back_pi * z * quarter_cosine_slope(z * z))

    @inlined
    def linearise(first: bool, b: Any, r: Rig, i: int) -> None:
        xi, x, sigma = b[Z_FRACTION + i], b[Z_ANGLE + i], b[Z_STRESS + i]
        cosine, sine, pull = b[COSINES + i], b[SINES + i], b[PULL + i]
        damping, gravity, spring = b[DAMPING + i], b[GRAVITATION + i], b[SPRING + i]
        fraction = b[FRACTION + i]
        moved = x - b[BASE_ANGLE + i]
        miss = moved * (one + damping) - r.step * b[BASE_VELOCITY + i] + gravity * cosine
        miss += spring * (x - r.rest_angle) - pull * sigma
        by_angle = one + damping + spring - gravity * sine
        free = x - miss
        below, above = free < r.lower, free > r.upper
        stopped = below | above
        missed = x - r.lower if below else (x - r.upper if above else miss)
        by_angle_held = one if stopped else by_angle
        pull_held = zero if stopped else pull

        grown = zero if first else xi - fraction
        warmer = zero if first else b[Z_TEMPERATURE + i] - b[TEMPERATURE + i]
        modulus = r.modulus + r.modulus_more * (xi if first else fraction + half * grown)
        elastic = -r.contraction * (x - r.start) - b[STRAIN + i] - r.recoverable * grown
        trial = modulus * elastic + b[STRESS + i] + r.thermal * warmer
        taut = one if trial > zero else zero
        by_temperature, stiffness = taut * r.thermal, taut * (modulus * r.contraction)
        by_fraction = taut * (half * r.modulus_more * elastic - modulus * r.recoverable)
        excess = taut * trial - sigma

        ohms = r.ohms + r.ohms_more * xi
        determinant = by_angle_held + pull_held * stiffness
        both = one / (ohms * determinant)
        per_ohm, per_determinant = both * determinant, both * ohms

        heated = b[HEATING + i] * per_ohm
        more_temperature = -heated * per_ohm * r.ohms_more
        step_temperature = heated + r.keeps * b[BASE_TEMPERATURE + i] + r.ambient - b[Z_TEMPERATURE + i]
        right = excess + by_temperature * step_temperature
        right_more = by_fraction + by_temperature * more_temperature
        step_stress = (by_angle_held * right + stiffness * missed) * per_determinant
        more_stress = by_angle_held * right_more * per_determinant
        step_angle = (pull_held * right - missed) * per_determinant
        more_angle = pull_held * right_more * per_determinant

        b[STEP_TEMPERATURE + i], b[MORE_TEMPERATURE + i] = step_temperature, more_temperature
        b[STEP_ANGLE + i], b[MORE_ANGLE + i] = step_angle, more_angle
        b[STEP_STRESS + i], b[MORE_STRESS + i] = step_stress, more_stress
        if not first:
            b[FREE + i] = free + step_angle - by_angle * step_angle + pull * step_stress
            b[MORE_FREE + i] = more_angle - by_angle * more_angle + pull * more_stress

    @inlined
    def decide(first: bool, b: Any, r: Rig, i: int) -> None:
        xi, more_temperature, more_stress = b[FRACTION + i], b[MORE_TEMPERATURE + i], b[MORE_STRESS + i]
        amplitude_A, amplitude_M = b[AMPLITUDE_A + i], b[AMPLITUDE_M + i]
        before_A, before_M = b[DISTANCE_A + i], b[DISTANCE_M + i]
        back = zero if first else xi - b[Z_FRACTION + i]
        temperature = b[Z_TEMPERATURE + i] + b[STEP_TEMPERATURE + i] + more_temperature * back
        stress = b[Z_STRESS + i] + b[STEP_STRESS + i] + more_stress * back
        distance_A = temperature * r.per_width_A - stress * r.per_slope_A - r.start_A
        distance_M = r.start_M - temperature * r.per_width_M + stress * r.per_slope_M
        gap_A = xi - amplitude_A * share_left(distance_A)
        gap_M = one - xi - amplitude_M * share_left(distance_M)
        heats = (gap_A > r.resting) & (distance_A > before_A) & (b[SHARE_A + i] > zero)
        cools = (gap_M > r.resting) & (distance_M > before_M) & (b[SHARE_M + i] > zero)
        loss, gain = gap_A if heats else zero, gap_M if cools else zero
        cooling = one if gain > loss else zero
        heating = one - cooling if larger(loss, gain) > zero else zero

        slope_A = more_stress * r.per_slope_A - more_temperature * r.per_width_A
        slope_M = more_stress * r.per_slope_M - more_temperature * r.per_width_M
        of_cooling = cooling > zero
        distance = distance_M if of_cooling else distance_A
        slope = slope_M if of_cooling else slope_A
        phase = heating * xi + cooling * (one - xi)
        b[CHOSEN + i], b[PHASE + i] = heating - cooling, phase
        b[AMPLITUDE + i] = heating * amplitude_A + cooling * amplitude_M
        b[DISTANCE + i], b[SLOPE + i] = distance, slope
        gone = (heating - cooling) * back
        if first:
            before = before_M if of_cooling else before_A
            falls = slope < zero
            ratio = (before - distance) / (slope if falls else -one)
            gone = ratio if falls else zero
        b[GONE + i] = within(gone, zero, phase)

    @inlined
    def kinetics(b: Any, i: int, gone: Any) -> Any:
        amplitude, slope = b[AMPLITUDE + i], b[SLOPE + i]
        z = within(b[DISTANCE + i] + slope * gone, zero, one)
        root = quarter_cosine(z)
        share = root * root
        remaining = share if share > finished_at else zero
        by_gone = one + two * amplitude * slope * root * z * quarter_cosine_slope(z * z)
        return gone - b[PHASE + i] + amplitude * remaining, by_gone

    @inlined
    def newton(b: Any, i: int) -> None:
        before = b[GONE + i]
        value, slope = kinetics(b, i, before)
        gone = within(before - value / slope, zero, b[PHASE + i])
        b[GONE_LAST + i], b[GONE + i] = abs(gone - before), gone

    @compiled
    def bisect(b: Any, i: int) -> None:
        low, high, gone, change = zero, b[PHASE + i], b[GONE + i], one
        step = 0
        while step < MOST_HALVINGS and change > rounding:
            value, slope = kinetics(b, i, gone)
            if value < zero:
                low = gone
            if value > zero:
                high = gone
            free = gone - value / slope
            inside = free > low and free < high and step % 3 != 2
            following = gone if value == zero else (free if inside else half * (low + high))
            change, gone, step = abs(following - gone), following, step + 1
        b[GONE + i], b[GONE_LAST + i] = gone, zero

    @inlined
    def change_of(b: Any, i: int) -> Any:
        moved = b[FRACTION + i] - b[CHOSEN + i] * b[GONE + i] - b[Z_FRACTION + i]
        return (
            b[STEP_TEMPERATURE + i] + b[MORE_TEMPERATURE + i] * moved,
            b[STEP_ANGLE + i] + b[MORE_ANGLE + i] * moved,
            b[STEP_STRESS + i] + b[MORE_STRESS + i] * moved,
            moved,
        )

    @inlined
    def advance_first(b: Any, i: int) -> None:
        temperature, angle, stress, fraction = change_of(b, i)
        b[Z_TEMPERATURE + i] += temperature
        b[Z_ANGLE + i] += angle
        b[Z_STRESS + i] += stress
        b[Z_FRACTION + i] += fraction
        b[BRANCH + i] = b[CHOSEN + i]

    @inlined
    def advance(again: bool, b: Any, r: Rig, i: int, share: Any) -> None:
        temperature, angle, stress, fraction = change_of(b, i)
        chosen, branch, z_free, done = b[CHOSEN + i], b[BRANCH + i], b[Z_FREE + i], b[ENOUGH + i]
        largest = larger(larger(abs(temperature), abs(angle) * r.angle_scale), abs(fraction))
        modulus = by_stress * (r.modulus + r.modulus_more * b[FRACTION + i])
        still = (share * largest + b[GONE_LAST + i] <= r.tolerance) & (share * abs(stress) <= r.tolerance * modulus)
        enough = one if still & (chosen == branch) else zero
        moves = share * (one - done) if again else share
        free = b[FREE + i] + b[MORE_FREE + i] * fraction
        b[Z_TEMPERATURE + i] += moves * temperature
        b[Z_ANGLE + i] += moves * angle
        b[Z_STRESS + i] += moves * stress
        b[Z_FRACTION + i] += moves * fraction
        if again:
            b[Z_FREE + i] = free if moves > zero else z_free
            b[BRANCH + i] = chosen if moves > zero else branch
            b[ENOUGH + i] = larger(enough, done)
        else:
            b[Z_FREE + i], b[BRANCH + i], b[ENOUGH + i] = free, chosen, enough

    @inlined
    def locate(b: Any, r: Rig, i: int) -> None:
        temperature, stress = b[Z_TEMPERATURE + i], larger(b[Z_STRESS + i], zero)
        distance_A = temperature * r.per_width_A - stress * r.per_slope_A - r.start_A
        distance_M = r.start_M - temperature * r.per_width_M + stress * r.per_slope_M
        b[DISTANCE_A + i], b[DISTANCE_M + i] = distance_A, distance_M
        b[SHARE_A + i], b[SHARE_M + i] = share_left(distance_A), share_left(distance_M)

    @inlined
    def finish(last: bool, b: Any, r: Rig, i: int) -> None:
        branch, fraction = b[BRANCH + i], b[FRACTION + i]
        heating, cooling = larger(branch, zero), larger(-branch, zero)
        held = one - heating - cooling
        ended = within(b[Z_FRACTION + i], zero, one)
        xi = fraction if held > zero else ended
        temperature, stress = b[Z_TEMPERATURE + i], larger(b[Z_STRESS + i], zero)
        grown = xi - fraction
        modulus = r.modulus + r.modulus_more * (fraction + half * grown)

        share_A, share_M = b[SHARE_A + i], b[SHARE_M + i]
        some_A, some_M = larger(share_A, finished_at), larger(share_M, finished_at)
        shares = some_A * some_M
        whole = one / (shares * modulus)
        per_shares = whole * modulus
        laid_A, laid_M = xi * (per_shares * some_M), (one - xi) * (per_shares * some_A)

        elastic = stress - b[STRESS + i] - r.thermal * (temperature - b[TEMPERATURE + i])
        b[STRAIN + i] = b[STRAIN + i] + r.recoverable * grown + elastic * (whole * shares)
        amplitude_A, amplitude_M = b[AMPLITUDE_A + i], b[AMPLITUDE_M + i]
        beyond_A = one - heating if xi - amplitude_A * share_A > r.resting else zero
        beyond_M = one - cooling if one - xi - amplitude_M * share_M > r.resting else zero
        missed_A = held * larger(beyond_A, b[MISSED_A + i])
        missed_M = held * larger(beyond_M, b[MISSED_M + i])
        b[AMPLITUDE_A + i] = laid_A if cooling + beyond_A + missed_A > zero else amplitude_A
        b[AMPLITUDE_M + i] = laid_M if heating + beyond_M + missed_M > zero else amplitude_M
        b[MISSED_A + i], b[MISSED_M + i] = missed_A, missed_M

        free, z_angle, base_angle = b[Z_FREE + i], b[Z_ANGLE + i], b[BASE_ANGLE + i]
        below, above = free < r.lower, free > r.upper
        angle = r.lower if below else (r.upper if above else z_angle)
        moves = zero if below | above else one
        velocity = moves * ((angle - base_angle) * r.per_step)
        b[TEMPERATURE + i], b[STRESS + i], b[FRACTION + i] = temperature, stress, xi
        b[ANGLE + i], b[VELOCITY + i] = angle, velocity
        if last:
            b[BASE_TEMPERATURE + i], b[BASE_ANGLE + i], b[BASE_VELOCITY + i] = temperature, angle, velocity
            b[LARGEST + i] = larger(b[LARGEST + i], angle)
            least = b[SMALLEST + i]
            b[SMALLEST + i] = xi if xi < least else least
        else:
            b[BASE_TEMPERATURE + i] += r.ahead * (temperature - b[BASE_TEMPERATURE + i])
            b[BASE_ANGLE + i] = base_angle + r.ahead * r.step * velocity
            b[BASE_VELOCITY + i] += moves * (r.ahead * (velocity - b[BASE_VELOCITY + i]))
        b[Z_TEMPERATURE + i], b[Z_ANGLE + i], b[Z_STRESS + i], b[Z_FRACTION + i] = temperature, angle, stress, xi
        b[BRANCH + i] = zero

    # One loop over the lanes for each phase, each a function of its own: so short that the compiler makes vectors of it.
    @compiled
    def all_turn(b: Any) -> None:
        for i in range(lanes):
            turn(b, i)

    @compiled
    def all_linearise_first(b: Any, r: Rig) -> None:
        for i in range(lanes):
            linearise(True, b, r, i)

    @compiled
    def all_linearise(b: Any, r: Rig) -> None:
        for i in range(lanes):
            linearise(False, b, r, i)

    @compiled
    def all_decide_first(b: Any, r: Rig) -> None:
        for i in range(lanes):
            decide(True, b, r, i)

    @compiled
    def all_decide(b: Any, r: Rig) -> None:
        for i in range(lanes):
            decide(False, b, r, i)

    @compiled
    def all_newton(b: Any) -> None:
        for i in range(lanes):
            newton(b, i)

    @compiled
    def all_advance_first(b: Any) -> None:
        for i in range(lanes):
            advance_first(b, i)

    @compiled
    def all_advance(b: Any, r: Rig) -> None:
        for i in range(lanes):
            advance(False, b, r, i, one)

    @compiled
    def all_advance_again(b: Any, r: Rig) -> None:
        for i in range(lanes):
            advance(True, b, r, i, one)

    @compiled
    def all_locate(b: Any, r: Rig) -> None:
        for i in range(lanes):
            locate(b, r, i)

    @compiled
    def all_finish(b: Any, r: Rig) -> None:
        for i in range(lanes):
            finish(False, b, r, i)

    @compiled
    def all_finish_last(b: Any, r: Rig) -> None:
        for i in range(lanes):
            finish(True, b, r, i)

    @compiled
    def finished(b: Any) -> Any:
        count = zero
        for i in range(lanes):
            count += b[ENOUGH + i]
        return count == full

    @compiled
    def all_again(b: Any, r: Rig) -> None:
        all_turn(b)
        all_linearise(b, r)
        all_decide(b, r)
        for _ in range(INNER_LATER):
            all_newton(b)

    @compiled
    def to_the_end(b: Any, r: Rig) -> None:
        for i in range(lanes):
            iteration = MOST_QUICK
            while iteration < MOST_ITERATIONS and not b[ENOUGH + i] > zero:
                turn(b, i)
                linearise(False, b, r, i)
                decide(False, b, r, i)
                bisect(b, i)
                advance(False, b, r, i, half if iteration > UNDAMPED and iteration % 2 == 0 else one)
                iteration += 1

    @compiled
    def stage(last: bool, b: Any, r: Rig) -> int:
        all_turn(b)
        all_linearise_first(b, r)
        all_decide_first(b, r)
        for _ in range(INNER):
            all_newton(b)
        all_advance_first(b)
        iterations = 1
        while iterations < QUICK:
            all_again(b, r)
            all_advance(b, r)
            iterations += 1
        while iterations < MOST_QUICK and not finished(b):
            all_again(b, r)
            all_advance_again(b, r)
            iterations += 1
        if iterations == MOST_QUICK and not finished(b):
            to_the_end(b, r)
        all_locate(b, r)
        if last:
            all_finish_last(b, r)
        else:
            all_finish(b, r)
        return iterations

    @compiled
    def start(b: Any, r: Rig, runs: Any, at: int) -> None:
        for i in range(lanes):
            for own in range(5):
                b[own * lanes + i] = runs[own, at + i]
            stress, xi, temperature = runs[5, at + i], r.initial_fraction, r.initial_temperature
            b[TEMPERATURE + i], b[ANGLE + i], b[VELOCITY + i] = temperature, r.start, zero
            b[STRESS + i], b[STRAIN + i], b[FRACTION + i] = stress, zero, xi
            b[Z_TEMPERATURE + i], b[Z_ANGLE + i], b[Z_STRESS + i], b[Z_FRACTION + i] = temperature, r.start, stress, xi
            locate(b, r, i)
            share_A, share_M = b[SHARE_A + i], b[SHARE_M + i]
            b[AMPLITUDE_A + i] = xi / larger(share_A, finished_at)
            b[AMPLITUDE_M + i] = one if xi >= one else (one - xi) / larger(share_M, finished_at)
            b[MISSED_A + i] = one if share_A <= finished_at and xi > zero else zero
            b[MISSED_M + i] = one if share_M <= finished_at and xi < one else zero
            b[LARGEST + i], b[SMALLEST + i] = r.start, xi
            b[BASE_TEMPERATURE + i], b[BASE_ANGLE + i], b[BASE_VELOCITY + i] = temperature, r.start, zero
            b[Z_FREE + i], b[BRANCH + i], b[ENOUGH + i] = r.start, zero, zero

    @compiled
    def write(b: Any, at: int, sample: int, record: Any) -> None:
        for i in range(min(lanes, record.shape[1] - at)):
            record[sample, at + i, 0], record[sample, at + i, 1] = b[ANGLE + i], b[FRACTION + i]

    @compiled
    def block(r: Rig, runs: Any, at: int, steps: int, every: int, record: Any, result: Any) -> int:
        b = np.zeros(FIELDS * lanes, runs.dtype)
        start(b, r, runs, at)
        write(b, at, 0, record)
        iterations = 0
        for step in range(1, steps + 1):
            iterations += stage(False, b, r)
            iterations += stage(True, b, r)
            if step % every == 0:
                write(b, at, step // every, record)
        for i in range(lanes):
            result[at + i, 0], result[at + i, 1] = b[ANGLE + i], b[LARGEST + i]
            result[at + i, 2], result[at + i, 3] = b[SMALLEST + i], b[TEMPERATURE + i]
        return iterations

    @parallel
    def simulate(r: Rig, runs: Any, steps: int, every: int, record: Any, result: Any) -> int:
        iterations = 0
        for k in over(runs.shape[1] // lanes):
            iterations += block(r, runs, k * lanes, steps, every, record, result)
        return iterations

    return simulate
