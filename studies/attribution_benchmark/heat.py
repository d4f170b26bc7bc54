"""Heat of the wire per metre: what the command brings, what the surroundings take, what it costs to warm up."""

from __future__ import annotations

import math

from studies.attribution_benchmark.parameters import Effects, Wire

STEFAN_BOLTZMANN = 5.670374419e-8
ZERO_CELSIUS = 273.15
DRAUGHT_AT = (0.35, 0.6)  # share of a run between which the draught blows
REGIME_AT = 45.0  # K above ambient at which the flow around the wire changes
POWER_AT, POWER_FROM = (
    50.0,
    1.0,
)  # K above ambient at which a power law's convection is the constant one; from which on it is one
CLAMP_TIME = 12.0  # s
SAG_TIME = 4.0  # s
PWM_SUPPLY = 2.0  # supply's volts over the largest command of all runs
PEAK_AT, PEAK_WIDTH = 60.0, 8.0  # C and K of the peak of the resistance


class Heat:
    """Losses and capacity of eq. 3.1 with the effects of the truth. `seconds`: length of the run."""

    def __init__(self, wire: Wire, effects: Effects, seconds: float) -> None:
        get = effects.get
        self.ambient, self.drift = wire.ambient_temperature, get("ambient_drift", 0.0)
        self.convection = wire.convection_coefficient * wire.surface
        self.rising = get("rising_convection", 0.0)
        self.exponent = get("free_convection", 0.0)
        self.radiation = get("radiation", 0.0) * STEFAN_BOLTZMANN * wire.surface
        self.draught = get("draught", 0.0)
        self.blows = DRAUGHT_AT[0] * seconds, DRAUGHT_AT[1] * seconds
        self.regime = get("convection_regime", 0.0)
        self.ends = get("end_conduction", 0.0) / wire.wire_length  # W/K over the wire's length
        self.clamp = get("clamp_node", 0.0) * self.convection
        self.capacity_austenite = get("phase_specific_heat", 0.0)
        self.capacity = wire.mass * wire.specific_heat
        self.latent = get("latent_heat", 0.0) * wire.mass

    def loss(self, t: float, temperature: float, clamp: float) -> float:
        """W/m lost; `clamp`: the clamp's temperature above ambient."""
        ambient = self.ambient + self.drift * t
        excess = temperature - ambient
        convection = self.convection * (1 + self.rising * excess)
        if self.exponent:
            convection *= (math.hypot(excess, POWER_FROM) / POWER_AT) ** self.exponent
        if self.draught and self.blows[0] <= t < self.blows[1]:
            convection *= 1 + self.draught
        if self.regime and excess > REGIME_AT:
            convection += self.convection * self.regime * (1 - REGIME_AT / excess)
        lost = (convection + self.ends) * excess
        if self.radiation:
            lost += self.radiation * ((temperature + ZERO_CELSIUS) ** 4 - (ambient + ZERO_CELSIUS) ** 4)
        if self.clamp:
            lost += self.clamp * (excess - clamp)
        return lost

    def heat_capacity(self, xi: float) -> float:
        """J/(K m)."""
        return self.capacity * (1 + self.capacity_austenite * (1 - xi))

    def breaks(self) -> list[float]:
        """Times at which the losses jump."""
        return list(self.blows) if self.draught else []


class Electricity:
    """Power per metre from the command (eq. 3.1, 3.15) with the effects of the truth. `largest`: command of all runs."""

    def __init__(self, wire: Wire, effects: Effects, largest: float) -> None:
        get = effects.get
        self.duty, self.gain, self.length = wire.drive == "duty", wire.gain, wire.wire_length
        self.austenite = wire.resistivity_austenite / wire.area * (1 + get("phase_resistance", 0.0))
        self.martensite = wire.resistivity_martensite / wire.area
        self.by_temperature, self.ambient = get("temperature_resistance", 0.0), wire.ambient_temperature
        self.peak = get("resistance_peak", 0.0)
        cold = self.martensite * wire.wire_length
        self.lead = get("lead_resistance", 0.0) * cold
        self.sag = get("supply_sag", 0.0) * cold
        self.dead = get("drive_dead_zone", 0.0) * largest
        self.pwm, self.supply = get("pwm", 0.0), PWM_SUPPLY * largest
        self.soft = get("drive_saturation", 0.0) / largest if largest else 0.0
        self.scale = 1 + get("input_gain", 0.0)

    def power(self, command: float, temperature: float, xi: float, sag: float) -> tuple[float, float]:
        """W/m into the wire and the current, A; `sag`: the current as the supply remembers it."""
        value = command * self.scale
        if self.dead:
            value = math.copysign(max(abs(value) - self.dead, 0.0), value)
        if self.soft:
            value /= math.sqrt(1 + (self.soft * value) ** 2)
        if self.duty:
            volts, share = self.gain, max(value, 0.0)
        else:
            volts, share = self.gain * value, 1.0
            if self.pwm:  # a mean voltage made by switching heats by more than its square
                share += self.pwm * (self.supply / value - 1) if value else 0.0
        metre = self.austenite + xi * (self.martensite - self.austenite)
        metre *= 1 + self.by_temperature * (temperature - self.ambient)
        if self.peak:
            metre *= 1 + self.peak * math.exp(-(((temperature - PEAK_AT) / PEAK_WIDTH) ** 2))
        whole = metre * self.length
        current = max(volts - self.sag * sag, 0.0) / (whole + self.lead)
        return current * current * metre * share, current * share
