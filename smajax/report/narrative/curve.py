"""The curve of the transformation in words, from its coefficients."""

from __future__ import annotations

from collections.abc import Mapping

from smajax.core.wording import and_listed
from smajax.model.effects.transformation_curve import BranchShape, TransformationCurve, branch_shape

# Times the cosine's: an end within this is like it, and one beyond the other is called a tail.
LIKE_THE_COSINE, TAIL = 1.25, 2.5
OVERLAP = (
    "Where long tails of heating and cooling overlap, each small rise and fall of the temperature moves the martensite fraction a little "
    "further: do not trust predictions of many small cycles without a run that has them."
)


def curve_sentences(effect_name: str, coefficients: Mapping[str, float]) -> tuple[str, ...]:
    """What the fitted curve looks like, a sentence a branch and a caution about long tails; nothing of another effect."""
    if effect_name != TransformationCurve.effect_name:
        return ()
    shapes = {branch: branch_shape(coefficients, branch) for branch in ("heating", "cooling")}
    sentences = tuple(_of_branch(branch, shape) for branch, shape in shapes.items())
    if all(max(shape.first_tenth, shape.last_tenth) >= TAIL for shape in shapes.values()):
        sentences += (OVERLAP,)
    return sentences


def _of_branch(branch: str, shape: BranchShape) -> str:
    parts = [text for text in (_end("starts", shape.first_tenth), _end("ends", shape.last_tenth)) if text]
    if shape.halves > LIKE_THE_COSINE:
        parts.append("is slower in its first half than in its second")
    elif shape.halves < 1.0 / LIKE_THE_COSINE:
        parts.append("is faster in its first half than in its second")
    if shape.first_step is not None:
        parts.append(f"goes in two steps, the first with about {shape.first_step:.0%} of it")
    said = and_listed(parts) if parts else "is like the cosine"
    return (
        f"On {branch} the transformation {said} (its first tenth takes {_times(shape.first_tenth)} times the range that it takes in the "
        f"cosine, its last tenth {_times(shape.last_tenth)} times, both against the eight tenths between them)."
    )


def _times(ratio: float) -> str:
    return f"{ratio:.1f}" if ratio < 9.95 else f"{ratio:.0f}"


def _end(verb: str, times: float) -> str:
    if times >= TAIL:
        return f"{verb} with a long tail"
    if times >= LIKE_THE_COSINE:
        return f"{verb} smoothly"
    return f"{verb} sharply" if times <= 1.0 / LIKE_THE_COSINE else ""
