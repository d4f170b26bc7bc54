"""Findings made by hand for tests of the report: every part of the page has something to show."""

from __future__ import annotations

import numpy as np

from smajax.attribution.findings import (
    AveragedModel,
    AveragedRun,
    CoefficientFinding,
    EffectFinding,
    Findings,
    ParameterFinding,
    ResidualDiagnostics,
    Role,
    Round,
    RunFinding,
    Verdict,
)
from smajax.attribution.reasons import LikelierModel, NoLikelierModel
from smajax.fit.identifiability import Checks, Identifiability
from smajax.fit.integration import IntegrationError
from smajax.fit.uncertainty import Remark, RemarkKind

NOISE = 2.0e-5  # m
NAN = float("nan")


def made_run(name: str, role: Role, seed: int, samples: int = 1200) -> RunFinding:
    """A heating and a cooling that the model before gets too fast and the model after gets right but for noise."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 60.0, samples)
    voltage = np.where(time % 30.0 < 15.0, 6.0 + 0.3 * seed, 0.5)

    def temperature(lag: float) -> np.ndarray:
        values = np.empty_like(time)
        values[0] = 23.0
        for k in range(1, samples):
            target = 23.0 + 1.9 * voltage[k] ** 2
            values[k] = values[k - 1] + (target - values[k - 1]) * (time[1] / lag)
        return values

    def position(degrees: np.ndarray) -> np.ndarray:
        return 0.02475 * (1.0 - fraction(degrees))

    def fraction(degrees: np.ndarray) -> np.ndarray:
        return 0.5 * (1.0 + np.cos(np.pi * np.clip((degrees - 55.0) / 25.0, 0.0, 1.0)))

    true = temperature(4.0)
    measured = position(true) + rng.normal(0.0, NOISE, samples)
    before, after = position(temperature(3.6)), position(true) + 1e-6
    return RunFinding(
        name=name,
        role=role,
        time=time,
        inputs={"voltage": voltage, "mass": np.full(samples, 0.075)},
        measured=measured,
        before=before,
        after=after,
        states={"temperature": true, "martensite_fraction": fraction(true), "stress": np.full(samples, 41.6e6)},
        offset_before=1.234567e-4,
        offset_after=2.5e-6,
        rmse_before=float(np.sqrt(np.mean((measured - before) ** 2))),
        rmse_after=float(np.sqrt(np.mean((measured - after) ** 2))),
        average=AveragedRun(
            after, np.full(samples, 2.0 * NOISE), float(np.sqrt(np.mean((measured - after) ** 2))), 0.93, samples
        ),
    )


def made_phase(samples: float, share: float, mean: float, rmse: float) -> dict[str, float]:
    return {"samples": samples, "share_of_squared_error": share, "mean": mean, "rmse": rmse}


def made_residual(rmse: float, white: bool, moved: float = 0.0) -> ResidualDiagnostics:
    """`moved` samples go from cooling to rest: each model has its own phases."""
    return ResidualDiagnostics(
        rmse=rmse,
        noise_sigma=NOISE,
        ratio=rmse / NOISE,
        white=white,
        whiteness_p_value=0.41 if white else 1.2e-48,
        independent=1500.0 if white else 60.0,
        by_phase={
            "heating, transforming": {
                "samples": 310.0,
                "share_of_squared_error": 0.71,
                "mean": 3e-4,
                "rmse": rmse * 1.6,
            },
            "cooling, transforming": {
                "samples": 420.0 - moved,
                "share_of_squared_error": 0.25,
                "mean": -2e-4,
                "rmse": rmse * 0.8,
            },
            "not transforming": made_phase(1670.0 + moved, 0.04, 0.0, rmse * 0.2),
        },
        correlation={"time": 0.01, "input": 0.34 if not white else 0.02, "martensite_fraction": NAN},
    )


def made_effect(name: str, title: str, equation: str, alone: float, added: bool = False) -> EffectFinding:
    return EffectFinding(
        name=name,
        title=title,
        equation=equation,
        formula="m c_p dT/dt = ... + m dH dxi/dt (Elahinia 2004, eq. 3.1 with the latent heat that it leaves out)",
        added=added,
        coefficients={"enthalpy": CoefficientFinding(24187.3, 210.6, "J/kg")} if added else {},
        evidence={
            "posterior_probability": 0.998 if added else 0.02 if np.isfinite(alone) else NAN,
            "alone_rmse_fit": alone,
            "score_p_value_at_the_end": NAN if added else 2.0e-12,
            "score_gain_at_the_end": NAN if added else 0.004,
        },
    )


def made_findings() -> Findings:
    """A loop that found latent heat; one run has a name that is markup."""
    runs = (made_run("step 6 V", "fit", 0), made_run("<b>x</b>", "fit", 1), made_run("sine, held", "held-out", 2))
    return Findings(
        experiment="latent",
        title="Dead weight, 75 g",
        source="latent/experiment.toml",
        verdict=Verdict.EXPLAINED,
        warnings=("3 runs, 2 to fit and 1 held out; 1200 samples each at 20 Hz.",),
        checks=Checks(Identifiability(("convection_coefficient", "stress_slope_austenite"), 2400, 2, correlated=())),
        output_name="position",
        output_unit="m",
        noise_sigma=NOISE,
        noise_how="estimated from the flat part of the runs",
        runs=runs,
        before=(
            ParameterFinding("convection_coefficient", "W/(m^2 K)", 131.45678, 0.812, 1.0, 5e3, 150.0),
            ParameterFinding("recoverable_strain", "-", 0.0461, 1.2e-5, 0.0, 0.12, 0.04),
            ParameterFinding(
                "stress_slope_austenite", "Pa/K", 1e6, None, 1e6, 1e8, 6.89e6, Remark(RemarkKind.LOWER_BOUND)
            ),
        ),
        after=(
            ParameterFinding("convection_coefficient", "W/(m^2 K)", 149.98765, 0.301, 1.0, 5e3, 150.0),
            ParameterFinding("recoverable_strain", "-", 0.0460, 1.1e-5, 0.0, 0.12, 0.04),
            ParameterFinding("stress_slope_austenite", "Pa/K", 6.9e6, 4e4, 1e6, 1e8, 6.89e6),
            ParameterFinding("latent_heat.enthalpy", "J/kg", 24187.3, 210.6, 0.0, 1e5, 1e4),
        ),
        effects=(
            made_effect("radiation", "radiation to the surroundings", "heat", 1.02e-3),
            made_effect("latent_heat", "latent heat of transformation", "heat", 2.04e-5, added=True),
            made_effect("sensor_lag", "lag of the sensor", "sensor", NAN),
        ),
        averaged=(AveragedModel(("latent_heat",), 0.9), AveragedModel(("latent_heat", "radiation"), 0.1)),
        residual_before=made_residual(1.1e-3, False),
        residual_after=made_residual(2.0e-5, True, moved=60.0),
        rounds=(
            Round(
                1,
                (),
                "latent_heat",
                LikelierModel("", 812.4, (("latent_heat", 812.4, 2.04e-5), ("radiation", 3.2, 1.02e-3))),
            ),
            Round(2, (), "", NoLikelierModel((("latent_heat + radiation", -4.1, 2.03e-5),))),
        ),
        explained_variance=0.998,
        step=0.02,
        integration=IntegrationError({"position": 0.0}, {"position": 0.0}, 0.0, "one step a sample"),
        offset=True,
        wire="flexinol_table_3_2",
        load="dead_weight",
        provenance={"smajax": "0.1.0", "seed": "0", "command": "smajax close-loop latent/experiment.toml"},
    )
