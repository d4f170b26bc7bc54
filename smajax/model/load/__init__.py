"""What the wire pulls on: one equation of motion, or a coupon whose temperature and stress (strain) are prescribed.

In: position, velocity and the load's input channels. Out: inertia, resistance and friction in N (N m for an arm).

Loads: `AbstractMovingLoad` (`base`), `DeadWeight`, `BiasSpring`, `BlockedWire`, `Arm`, `Coupon`, `StrainCoupon`.
Contracts of effects: `ForceTerm` (`force`), `FrictionTerm` (`friction`), `MountingTerm` (`mounting`).
"""
