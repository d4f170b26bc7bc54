"""Rotary arm on pulleys with gravity, a weak bias spring and end stops (eq. 3.7, 3.8)."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.load.base import GRAVITY, AbstractMovingLoad
from smajax.model.types import Inputs, Scalar
from smajax.model.wire.cosine import cosine
from smajax.model.wire.wire import Wire


class Arm(AbstractMovingLoad):
    r"""$I_e \ddot\theta + \tau_g + \tau_s + c \dot\theta = \tau_w$ (Elahinia 2004, eq. 3.8), $\tau_w = 2 r A_w \sigma$.

    The source omits the geometry: here the payload sits at the end of a link of length L whose own mass is uniform,
    the angle counts from the horizontal, and the spring pulls on a lever. Angles in rad.

    $I_e = \kappa (m_p + m_a/3) L^2$, $\tau_g = (m_p + m_a/2) g L \cos\theta$, $\tau_s = k a^2 (\theta - \theta_s)$. The wire moves by
    $2 r \theta$ (eq. 3.7): of a plain drum, on which it moves by the radius times the angle, r is half of the radius.
    """

    pulley_radius: Scalar = parameter(
        "m", 1e-4, 1.0, "r: the wire moves by 2 r a radian (eq. 3.7); half of the radius of a plain drum"
    )
    arm_length: Scalar = parameter("m", 1e-3, 10.0, "L: not printed")
    payload_mass: Scalar = parameter("kg", 0.0, 1e2, "m_p")
    link_mass: Scalar = parameter("kg", 1e-5, 1e2, "m_a")
    spring_stiffness: Scalar = parameter("N/m", 0.0, 1e6, "k")
    spring_lever: Scalar = parameter("m", 0.0, 1.0, "lever of the spring: not printed")
    spring_rest_angle: Scalar = parameter("rad", -7.0, 7.0, "angle at which the spring is slack: not printed")
    damping: Scalar = parameter("N m s/rad", 0.0, 1e2, "c: not printed")
    start_angle: Scalar = parameter("rad", -7.0, 7.0, "angle at which the wire's strain counts as zero")
    lower_stop: Scalar = parameter("rad", -7.0, 7.0, "lower end stop")
    upper_stop: Scalar = parameter("rad", -7.0, 7.0, "upper end stop")
    inertia_ratio: Scalar = parameter(
        "-",
        0.01,
        1e2,
        "moment of inertia over that of payload and link: pulleys and shaft add, errors of I_e too",
        default=1.0,
    )

    inputs_optional: ClassVar[frozenset[str]] = frozenset({"load_torque", "added_mass"})
    reading: ClassVar[tuple[str, str]] = ("angle", "rad")

    def start(self) -> Scalar:
        return self.start_angle

    def limits(self) -> tuple[Scalar | float, Scalar | float]:
        return self.lower_stop, self.upper_stop

    def payload(self, inputs: Inputs) -> Scalar:
        """Mass at the end of the link, kg: with `added_mass`, which a run may put down or take up, at rest or without impact."""
        return self.payload_mass + inputs["added_mass"] if "added_mass" in inputs else self.payload_mass

    def inertia(self, inputs: Inputs) -> Scalar:
        return self.inertia_ratio * (self.payload(inputs) + self.link_mass / 3.0) * self.arm_length**2

    def resistance(self, position: Scalar, velocity: Scalar, inputs: Inputs) -> Scalar:
        gravity = (self.payload(inputs) + 0.5 * self.link_mass) * GRAVITY * self.arm_length * cosine(position)
        spring = self.spring_stiffness * self.spring_lever**2 * (position - self.spring_rest_angle)
        # `load_torque`, N m, is a disturbance against +position.
        return gravity + spring + self.damping * velocity + inputs.get("load_torque", 0.0)

    def lever(self) -> Scalar | float:
        return 2.0 * self.pulley_radius

    def spring_rate(self) -> Scalar:
        return self.spring_stiffness * (self.spring_lever / self.lever()) ** 2

    def contraction(self, wire: Wire) -> Scalar:
        return 2.0 * self.pulley_radius / wire.wire_length
