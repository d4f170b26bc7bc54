"""Checks of the reference by closed forms and against itself; `python -m studies.reference.self_check`, a minute."""

from __future__ import annotations

import itertools
from collections import defaultdict
from dataclasses import replace
from typing import Any

import numpy as np

from studies.reference.event_march import Vector
from studies.reference.path_reference import simulate_path
from studies.reference.substep_path import Point, substep_path
from studies.reference.wire_law import LAWS, detwinned_share
from studies.reference.wire_parameters import CHOICES, ArmParameters, DeadWeightParameters, WireParameters
from studies.reference.wire_reference import simulate_arm, simulate_dead_weight

LIFT = [(2.0, 7.5), (3.5, 0.0), (5.0, 6.5)]
SWAP = [(1.0, 11.0, 0.363), (1.5, 11.0, 0.2), (2.0, 11.0, 0.363), (5.0, 0.0, 0.363)]
VARIED = ("law", "renewal", "constitutive", "stiffness")
SHARES = ("martensite_fraction", "detwinned_fraction", "strain")
TIMES = np.linspace(0, 5, 5001)
STRESS_PATH = [(30.0, 1e8), (82.0, 1.5e8), (78.0, 0.6e8), (84.0, 2e8), (60.0, 2.2e8), (66.0, 1.4e8), (88.0, 1.4e8)]
STRAIN_PATH = [(75.0, 0.0), (75.0, 0.03), (80.0, 0.015), (72.0, 0.028), (90.0, 0.022), (90.0, 0.0), (70.0, 0.035)]


def check(what: str, miss: float | np.floating[Any], most: float) -> None:
    """Print a miss and hold it against what it may be."""
    print(f"{what:64s} {miss:9.2e} of {most:.0e}")
    assert miss <= most, f"{what}: off by {miss:.3e}; expected at most {most:.0e}"


def cosine(u: Vector | float) -> Vector:
    """Share left at progress u, by the book."""
    return (1 + np.cos(np.pi * np.clip(u, 0, 1))) / 2


def closed_forms() -> None:
    """Where the answer can be written down."""
    w = WireParameters(initial_martensite_fraction=0.0, martensite_slope=8e6)
    load = np.linspace(0, 1, 401)
    for law in ("enhanced", "brinson"):
        out = simulate_path(replace(w, law=law), [(70.0, 0.0), (70.0, 0.05)], load, control="strain")
        want = 1 - cosine((52.0 - (70.0 - out["stress"] / 8e6)) / 10)
        check(f"isothermal loading, {law}: xi by stress", np.abs(out["martensite_fraction"] - want).max(), 1e-9)
        ends = simulate_path(replace(w, law=law), [(70.0, 8e6 * 18), (70.0, 8e6 * 28)], [0, 1e-4, 1 - 1e-4, 1])
        low, begun, ending, high = ends["martensite_fraction"]
        assert low == 0 < begun < 1e-7, f"{law}: loading transforms from C_M (T - M_s)"
        assert 1 - 1e-7 < ending < 1 == high, f"{law}: loading transforms up to C_M (T - M_f)"
    around = simulate_path(w, [(70.0, 0.0), (70.0, 3e8), (70.0, 0.0), (95.0, 0.0)], [1, 2, 3])
    check("loaded, unloaded and heated: no martensite left", abs(around["martensite_fraction"][2]), 1e-12)
    at = np.linspace(0, 2, 801)
    for law, ramp in (("enhanced", [100.0, 30.0]), ("liang", [100.0, 30.0]), ("tanaka", [100.0, 30.0])):
        params = WireParameters(law=law)
        out = simulate_path(params, [(30.0, 1e8), *((t, 1e8) for t in ramp)], at)
        y = out["temperature"] - 1e8 / 10.3e6
        up, down = (y - 68) / 10, (52 - y) / 10
        if law == "tanaka":
            hot = 0.01 ** max(up[400], 0.0)
            want = np.where(at <= 1, 0.01 ** np.maximum(up, 0), 1 - (1 - hot) * 0.01 ** np.maximum(down, 0))
        else:
            want = np.where(at <= 1, cosine(up), 1 - cosine(down))
        check(
            f"heating and cooling under constant stress, {law}", np.abs(out["martensite_fraction"] - want).max(), 1e-9
        )
    paused = [(30.0, 0.0), (73.0, 0.0), (73.0, 0.0), (90.0, 0.0)]
    for renewal, rest in (("corrected", 0.0), ("printed", 0.25)):
        out = simulate_path(WireParameters(law="enhanced", renewal=renewal), paused, [3.0])
        check(f"heating resumed after a pause at half, {renewal}", abs(out["martensite_fraction"][0] - rest), 1e-9)
    # Unloaded while cooling a little, Liang's wire passes its curve; heated again it starts anew from there.
    out = simulate_path(WireParameters(law="liang"), [(80.0, 2e8), (79.0, 6e7), (95.0, 6e7)], [1.0, 1.2, 2.0])
    u = (out["temperature"] - 6e7 / 10.3e6 - 68) / 10
    want = cosine(u) / cosine(u[0])
    check("Liang: a curve passed while off is re-anchored", np.abs(out["martensite_fraction"] - want).max(), 1e-9)
    for law in ("brinson", "tanaka"):
        for made, start in (("loading", (75.0, 3.5e8)), ("cooling", (30.0, 3e8))):
            corners = [(75.0, 0.0), start, (75.0, 3.5e8), (75.0, 0.0)]
            before, after = simulate_path(replace(w, law=law), corners, [2.0, 3.0])["martensite_fraction"]
            grown = before - after
            assert (grown > 0.5) == (made == "loading"), f"{law}: unloading recovers only martensite made by loading"
    cold = WireParameters(law="brinson", initial_martensite_fraction=1.0)
    out = simulate_path(cold, [(30.0, 0.0), (30.0, 1.4e8), (30.0, 0.0), (90.0, 0.0)], [1.0, 2.0, 3.0])
    share = detwinned_share(cold, 1.4e8)[0]
    miss = np.abs(out["strain"][:2] - [1.4e8 / 28e9 + 0.04 * share, 0.04 * share]).max()
    check("detwinning of cold martensite: strain under load and left", miss, 1e-11)


def constitutive_miss(params: WireParameters, out: dict[str, Vector]) -> float:
    """Strain off the constitutive law along a trajectory: exactly where E is constant or the form integrated."""
    xi, push = out["martensite_fraction"], out["stress"] - params.thermoelastic_coefficient * out["temperature"]
    push = push + params.thermoelastic_coefficient * params.ambient_temperature
    stiffening = 0.0 if params.stiffness == "martensite" else params.modulus_martensite - params.modulus_austenite
    modulus = params.modulus_martensite + (xi - 1) * stiffening
    if params.constitutive == "integrated" or not stiffening:
        elastic = push / modulus
    else:
        compliance = (1 / modulus[1:] + 1 / modulus[:-1]) / 2
        elastic = np.append(0, np.cumsum(np.diff(push) * compliance))
    miss = out["strain"] - elastic - params.recoverable_strain * out["detwinned_fraction"]
    return float(np.ptp(miss))


def paths() -> None:
    """Every law, renewal, form and stiffness: constitutive law, tolerance, the other form, plain sub-steps."""
    at, misses = np.linspace(0, 6, 12001), defaultdict[str, float](float)

    def note(what: str, *pairs: tuple[Vector | list[float], Vector]) -> None:
        for one, other in pairs:
            misses[what] = max(misses[what], float(np.abs(np.asarray(one) - other).max()))

    for law, renewal, form, stiffness in itertools.product(*(CHOICES[name][-4:] for name in VARIED)):
        for control, path in (("stress", STRESS_PATH), ("strain", STRAIN_PATH)):
            params = WireParameters(
                law=law,
                renewal=str(renewal),
                constitutive=str(form),
                stiffness=str(stiffness),
                martensite_slope=8e6,
                detwinning_start=60e6,
                initial_martensite_fraction=1.0 if control == "stress" else 0.0,
            )
            out = simulate_path(params, path, at, control=control)
            coarse = {name: values[::200] for name, values in out.items()}
            misses["constitutive law"] = max(misses["constitutive law"], constitutive_miss(params, out))
            tight = simulate_path(params, path, at[::200], control=control, rtol=1e-12)
            note("relative tolerance 1e-12 for 1e-10", *((tight[name], coarse[name]) for name in SHARES))
            if form == "rate" and stiffness == "martensite":
                other = simulate_path(replace(params, constitutive="integrated"), path, at[::200], control=control)
                note("constant E: integrated form for rate form", *((other[name], coarse[name]) for name in SHARES))
                note("the same, stress / 100 MPa", (other["stress"] / 1e8, coarse["stress"] / 1e8))
            steps, ends = substep_path(params, path, 200, control), {n: v[::2000] for n, v in out.items()}
            note(f"sub-steps, {control} led: xi", ([p.xi for p in steps], ends["martensite_fraction"]))
            note(f"sub-steps, {control} led: xi_s", ([p.detwinned for p in steps], ends["detwinned_fraction"]))
            note(f"sub-steps, {control} led: strain", ([p.strain for p in steps], ends["strain"]))
    for what, miss in misses.items():
        check(what, miss, 1e-11 if what.endswith("stress led: xi") else 1e-5 if "sub" in what else 1e-8)


def replayed(params: WireParameters, out: dict[str, Vector]) -> Vector:
    """Most that xi, xi_s and strain of a run differ from those of the bare material led through its T and stress."""
    point, most = Point(params, out["temperature"][0], out["stress"][0]), np.zeros(3)
    for i in range(1, len(out["time"])):
        point = point.moved(float(out["temperature"][i]), float(out["stress"][i]))
        miss = [
            abs(p - out[name][i]) for p, name in zip((point.xi, point.detwinned, point.strain), SHARES, strict=True)
        ]
        most = np.maximum(most, miss)
    return most


def dynamics() -> None:
    """Arm and weight under every law: replay along their own path, constitutive law, tolerance."""
    misses = defaultdict[str, float](float)
    for law, form, renewal in itertools.product(LAWS, ("rate", "integrated"), ("corrected", "printed")):
        arm, weight = (
            replace(
                rig, law=law, constitutive=form, renewal=renewal, convection_coefficient=400.0, detwinning_start=5e7
            )
            for rig in (ArmParameters(gain=3.0), DeadWeightParameters(gain=2.0))
        )
        assert isinstance(arm, ArmParameters)
        assert isinstance(weight, DeadWeightParameters)
        runs = (
            (arm, simulate_arm(arm, LIFT, TIMES), simulate_arm(arm, LIFT, TIMES, rtol=1e-8)),
            (weight, simulate_dead_weight(weight, SWAP, TIMES), simulate_dead_weight(weight, SWAP, TIMES, rtol=1e-8)),
        )
        for params, out, loose in runs:
            assert np.ptp(out["martensite_fraction"]) > 0.99, "the wire transforms throughout"
            first = detwinned_share(params, out["stress"][0])[0] if law == "brinson" else 1.0
            result = {
                "xi_s at the start": abs(out["detwinned_fraction"][0] - first),
                "constitutive law": constitutive_miss(params, out),
                "relative tolerance 1e-8 for 1e-9: xi": np.abs(loose[SHARES[0]] - out[SHARES[0]]).max(),
                **dict(zip(("replay: xi", "replay: xi_s", "replay: strain"), replayed(params, out), strict=True)),
            }
            for what, miss in result.items():
                misses[what] = max(misses[what], float(miss))
    for what, miss in misses.items():
        check(f"dynamic, {what}", miss, 1e-12 if "start" in what else 2e-4 if "xi_s" in what else 1e-5)


def drives() -> None:
    """The plain modes, the three drives of one power, the sampled controller against its own volts."""

    def apart(one: dict[str, Vector], other: dict[str, Vector]) -> float:
        return max(float(np.abs(one[n] - other[n]).max()) for n in ("angle", "temperature", "martensite_fraction"))

    plain = ArmParameters(gain=2.0, latent_heat=1e4)
    volts = simulate_arm(plain, LIFT, TIMES)
    for law in ("enhanced", "liang"):
        named = simulate_arm(replace(plain, law=law), LIFT, TIMES)
        check(
            f"law {law} against the plain modes",
            apart(named, simulate_arm(replace(plain, conditions=law), LIFT, TIMES)),
            1e-7,
        )
    amps = [(end, 2.0 * v / (0.9 * 45)) for end, v in LIFT]  # with one resistance, 45 ohm/m, in both phases
    watts = [(end, 0.9 * 45 * i**2) for end, i in amps]
    check("current for voltage", apart(volts, simulate_arm(replace(plain, drive="current"), amps, TIMES)), 1e-7)
    check("power for voltage", apart(volts, simulate_arm(replace(plain, drive="power"), watts, TIMES)), 1e-7)

    def lead(
        time: float, angle: float, speed: float, _t: float, _stress: float, _xi: float, total: float
    ) -> tuple[float, float]:
        miss = 0.5 * (time > 1) - angle
        return min(max(6 + 4 * miss + 2 * total - 0.2 * speed, 0.0), 9.0), total + 0.02 * miss

    for split in (None, "brinson"):
        params = replace(plain, law=split)
        out = simulate_arm(params, [], TIMES, controller=lead, period=0.02, memory=0.0)
        held = [(0.02 * (i + 1), float(out["volts"][20 * i])) for i in range(250)]
        check(
            f"controller against its volts as segments, law {split}",
            apart(out, simulate_arm(params, held, TIMES)),
            1e-9,
        )


def main() -> None:
    """All of them."""
    closed_forms()
    paths()
    dynamics()
    drives()


if __name__ == "__main__":
    main()
