"""Which effects these runs can show at all."""

from __future__ import annotations

import numpy as np

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import decomposed
from smajax.attribution.traces import Traces

DETECTABLE = 1.0  # standard errors that an effect of one width has to change the runs by to be looked for


def detectable(joint: JointParameters, traces: Traces, noise: float) -> tuple[str, ...]:
    """Effects of which one width would change the runs by more than the noise hides, beside what the unknowns absorb.

    The unknowns absorb within their priors: with the values of presets free, some combinations of them change next to
    nothing, and without a prior the remainder of rounding along these would absorb everything.
    """
    columns = [
        traces.columns[name] * joint.scale(name, float(traces.values[joint.slots[name]])) for name in joint.unknowns
    ]
    matrix = np.stack(columns, axis=1) if columns else np.zeros((len(traces.residual), 0))
    precision = np.diag([joint.precision(name) for name in joint.unknowns])
    normal = matrix.T @ matrix + noise**2 * precision
    eigenvalues, vectors, size = decomposed(normal)
    root = np.sqrt(eigenvalues)
    found = []
    for variant, own in traces.variants.items():
        for name in joint.switches(variant.effect):
            column = own[name] * joint.priors[name].sigma
            absorbed = (vectors.T @ (size * (matrix.T @ column))) / root
            left = np.sqrt(max(float(column @ column - absorbed @ absorbed), 0.0))
            if variant.effect not in found and left > DETECTABLE * noise:
                found.append(variant.effect)
    return joint.ordered(found)
