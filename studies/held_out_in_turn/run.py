"""Every measured run held out in turn: `python -m studies.held_out_in_turn.run [--only flexinol_isobaric]`.

`close-loop` on the measured wires, once for each of their runs, which it does not see: the error on that run by the base model, by the
extended model and by the average of the likely models, and how many of its samples lie in the 90 % band. The experiment files keep one
run out each; here none is chosen. A run that is kept is not made again; --again makes all of them.
"""

from __future__ import annotations

import argparse
import json
import re
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from smajax.core.files import replace
from smajax.core.runtime import prepare

HERE = Path(__file__).parent
KEPT, PAGE = HERE / "turns.json", HERE / "README.md"
# Folder of the experiment -> its title, the unit of the errors and an SI unit over it.
WIRES = {
    "bias_spring_bench": ("Flexinol on a bias spring, heated by current, position", "mm", 1e-3),
    "flexinol_isobaric": ("Flexinol at constant stress, strain", "%", 1e-2),
    "nitihf_isobaric": ("NiTiHf at constant stress, strain", "%", 1e-2),
}
RUN = re.compile(r'^name = "(?P<name>[^"]+)"\nrole = "(?P<role>[^"]+)"$', re.MULTILINE)


@dataclass(frozen=True)
class Turn:
    """One run that was held out: root mean square errors on it, SI, and the share of its samples in the band."""

    wire: str
    run: str
    base: float
    extended: float
    average: float
    in_band: float
    samples: int
    added: tuple[str, ...]
    verdict: str
    seconds: float


def run_names(text: str) -> list[str]:
    """Of the runs of an experiment file."""
    return [one["name"] for one in RUN.finditer(text)]


def with_held_out(text: str, run: str) -> str:
    """The experiment file with all runs but one to be fitted. Raises ValueError for a run that it does not have."""
    if run not in run_names(text):
        raise ValueError(f"no run {run!r}; expected one of {', '.join(run_names(text))}")

    def role(found: re.Match[str]) -> str:
        return f'name = "{found["name"]}"\nrole = "{"held-out" if found["name"] == run else "fit"}"'

    return RUN.sub(role, text)


def turn(wire: str, run: str) -> Turn:
    """The loop closed without one run of a wire."""
    from smajax.attribution.close_loop import close_loop
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE

    text = (HERE.parent / wire / "experiment.toml").read_text(encoding="utf-8")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "experiment.toml"
        path.write_text(with_held_out(text, run), encoding="utf-8")
        began = clock.monotonic()
        found = close_loop(load_experiment(path, CATALOGUE))
        seconds = clock.monotonic() - began
    one = next(each for each in found.runs if each.name == run)
    average = one.average
    if average is None:
        raise RuntimeError(f"{wire} without {run} has no average of likely models; expected one, from two fit runs on")
    added = tuple(effect.name for effect in found.effects if effect.added)
    errors = one.rmse_before, one.rmse_after, average.rmse
    return Turn(wire, run, *errors, average.coverage, average.samples, added, found.verdict.value, seconds)


def load(record: Sequence[Mapping[str, object]]) -> list[Turn]:
    """What `KEPT` holds."""
    return [Turn(**{**one, "added": tuple(one["added"])}) for one in record]  # type: ignore[arg-type]


def in_band(turns: Sequence[Turn]) -> float:
    """Share of all samples of these runs that lie in their bands."""
    return sum(one.in_band * one.samples for one in turns) / sum(one.samples for one in turns)


def page(turns: Sequence[Turn]) -> str:
    """The study's README."""
    lines = [
        "# Every measured run held out in turn",
        "",
        "`smajax close-loop` on the measured wires, once for each of their runs, which it does not see. Errors are root mean squares on that run. "
        f"Of all samples {in_band(turns):.1%} lie in the 90 % band of the averaged prediction.",
    ]
    for wire, (title, unit, size) in WIRES.items():
        own = [one for one in turns if one.wire == wire]
        if not own:
            continue
        lines += [
            "",
            f"## {title}",
            "",
            f"| held out | base model, {unit} | extended model, {unit} | average of the likely models, {unit} | in the 90 % band | added effects |",
            "|---|---|---|---|---|---|",
        ]
        for one in own:
            errors = " | ".join(f"{error / size:.3g}" for error in (one.base, one.extended, one.average))
            added = ", ".join(f"`{name}`" for name in one.added) or f"none ({one.verdict})"
            lines.append(f"| {one.run} | {errors} | {one.in_band:.0%} | {added} |")
        lines += ["", f"In the band: {in_band(own):.1%} of the samples."]
    lines += [
        "",
        "A run at the end of the range of stresses is an extrapolation, and there the band is too narrow; between them it is too wide. "
        "Errors on runs left out are its measure, and with three or four runs most of these are extrapolations as well. "
        "On the bench two runs have the same command on two days and differ by 0.5 mm: while both are fitted nothing that the library has is likelier than the base model.",
        "",
        "Made by `python -m studies.held_out_in_turn.run`.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=WIRES)
    parser.add_argument("--again", action="store_true", help="make what is kept again")
    asked = parser.parse_args()
    prepare()
    kept = (
        {(one.wire, one.run): one for one in load(json.loads(KEPT.read_text(encoding="utf-8")))}
        if KEPT.exists()
        else {}
    )
    for wire in WIRES:
        if asked.only not in (None, wire):
            continue
        for run in run_names((HERE.parent / wire / "experiment.toml").read_text(encoding="utf-8")):
            if (wire, run) in kept and not asked.again:
                continue
            one = kept[wire, run] = turn(wire, run)
            print(
                f"{wire} {run}: {one.base:.3g} -> {one.extended:.3g}, {one.in_band:.0%} in the band, {one.seconds:.0f} s",
                flush=True,
            )
            order = sorted(kept.values(), key=lambda each: list(WIRES).index(each.wire))
            replace(KEPT, json.dumps([asdict(each) for each in order], indent=1) + "\n")
            replace(PAGE, page(order))


if __name__ == "__main__":
    main()
