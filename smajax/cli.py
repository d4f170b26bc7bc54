"""The command line: `smajax close-loop experiment.toml --out DIR`, `smajax demo`, `smajax figures`, `sweep` and `tune`."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from smajax.report.findings import Findings

app = typer.Typer(
    name="smajax",
    help="Shape-memory-alloy wire actuators: from measured runs to the physical effect that a model lacks.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=True,
    rich_markup_mode=None,  # the plain help is there at once
)
DEMOS = ("latent", "complete")
TUNED_AT = "-40,-20,0,20,40,60,85"
SET_POINTS, GAINS = "-40,-20,0,10,20,40,50,60,80", "0.5,0.7,1,1.4,2"


def console() -> Console:
    """Where progress and errors are said."""
    from rich.console import Console

    return Console(stderr=True)


def _browse(page: Path) -> None:
    import webbrowser

    webbrowser.open(page.resolve().as_uri())


@contextmanager
def _resumable(kept: str = "Finished fits are kept: the same command goes on from there.") -> Iterator[None]:
    """Ctrl-C is answered here: typer would end in silence."""
    try:
        yield
    except KeyboardInterrupt:
        console().print(f"\nInterrupted. {kept}", soft_wrap=True)
        # At once: an interpreter that shuts down in the middle of a compilation can crash.
        os._exit(130)


def _folder(out: Path) -> None:
    """Before the work, not after it: a folder that cannot be written to is found out at once."""
    for part in (out, *out.parents):
        if part.exists() and not part.is_dir():
            raise NotADirectoryError(f"--out: {part} is a file; give the name of a folder.")
    out.mkdir(parents=True, exist_ok=True)


def _loop(experiment: Path, out: Path, command: str) -> tuple[Findings, Path]:
    # Imported here so that `--help` does not wait for JAX; x64 is the caller's choice, and this is the caller.
    from smajax.runtime import prepare

    prepare()
    from smajax.catalogue import CATALOGUE
    from smajax.close_loop import close_loop
    from smajax.experiment.load import load_experiment
    from smajax.progress import shown
    from smajax.report.write import write_report

    _folder(out)
    loaded = load_experiment(experiment, CATALOGUE)
    with _resumable(), shown(console()) as progress:
        findings = close_loop(loaded, memory=out / "fits", progress=progress, command=command)
    return findings, write_report(findings, out)


def _say(findings: Findings, page: Path) -> None:
    typer.echo(f"\n{findings.title}\nVerdict: {findings.verdict}")
    for sentence in findings.summary:
        typer.echo(f"  {sentence}")
    typer.echo(f"Report: {page.resolve()}")


@app.command("close-loop")
def close_loop_command(
    experiment: Annotated[Path, typer.Argument(help="experiment.toml, or the folder that holds it")],
    out: Annotated[Path, typer.Option(help="folder for report.html and report.json; finished fits are kept there too")],
    json_out: Annotated[bool, typer.Option("--json", help="print report.json on stdout instead of words")] = False,
    open_page: Annotated[bool, typer.Option("--open", help="open the report in a browser")] = False,
) -> None:
    """Fit the base model, find what it lacks, add it, and report the error before and after.

    Ctrl-C loses nothing: the same command with the same --out goes on from the fits that are finished.

    Example:  smajax close-loop experiment.toml --out report
    """
    findings, page = _loop(
        experiment, out, f"smajax close-loop {shlex.quote(str(experiment))} --out {shlex.quote(str(out))}"
    )
    if json_out:
        from smajax.report.json_file import findings_to_json

        typer.echo(json.dumps(findings_to_json(findings)))
    else:
        _say(findings, page)
    if open_page:
        _browse(page)


@app.command("identify")
def identify_command(
    experiment: Annotated[Path, typer.Argument(help="experiment.toml, or the folder that holds it")],
    out: Annotated[
        Path, typer.Option(help="folder for identify.html and identify.json; fits are kept there as they go")
    ],
    starts: Annotated[int, typer.Option(min=0, help="points of the box that fits may start from; 0: as declared")] = 64,
    profile: Annotated[str, typer.Option(help="parameters to draw a profile of, with commas, or `all`")] = "",
    robust: Annotated[bool, typer.Option("--robust", help="Huber's loss: samples far off count less")] = False,
    design: Annotated[bool, typer.Option("--design", help="say which run to do next")] = False,
    posterior: Annotated[
        int, typer.Option(min=0, help="draws of each of 8 Markov chains, 1000 or so; needs the extra `bayes`")
    ] = 0,
    json_out: Annotated[bool, typer.Option("--json", help="print identify.json on stdout instead of words")] = False,
    open_page: Annotated[bool, typer.Option("--open", help="open the page in a browser")] = False,
) -> None:
    """Fit the unknowns of an experiment to its runs, with error bars, and say what the runs cannot tell.

    An effect is part of the model when the experiment names one of its parameters ("latent_heat.enthalpy"). Ctrl-C loses
    nothing: the same command with the same --out goes on from the fits as they were.

    Example:  smajax identify experiment.toml --out identified --profile all --design
    """
    from smajax.runtime import prepare

    prepare()
    from smajax.catalogue import CATALOGUE
    from smajax.declared import free_by_name
    from smajax.experiment.load import load_experiment
    from smajax.identify import identify
    from smajax.progress import shown
    from smajax.report.identify_page import write_identified
    from smajax.report.identify_record import record
    from smajax.report.identify_words import conclusions, estimate_rows, posterior_rows

    _folder(out)
    loaded = load_experiment(experiment, CATALOGUE)
    unknowns = list(free_by_name(loaded, [run for run in loaded.runs if run.role == "fit"]))
    profiled = unknowns if profile == "all" else [part.strip() for part in profile.split(",") if part.strip()]
    command = f"smajax identify {shlex.quote(str(experiment))} --out {shlex.quote(str(out))} --starts {starts}"
    command += f" --profile {','.join(profiled)}" * bool(profiled) + " --robust" * robust + " --design" * design
    command += f" --posterior {posterior}" * bool(posterior)
    if any((out / "fits").glob("*.npz")):
        console().print(
            f"Fits kept in {out / 'fits'} are gone on with where they are of the same work.", soft_wrap=True
        )
    try:
        with _resumable("Fits are kept as they go: the same command goes on from there."), shown(console()) as progress:
            found = identify(
                loaded,
                starts=starts,
                profiled=profiled,
                robust=robust,
                design=design,
                draws=posterior,
                memory=out / "fits",
                progress=progress,
                command=command,
            )
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    page = write_identified(found, out)
    if json_out:
        typer.echo(json.dumps(record(found), allow_nan=False))
    else:
        typer.echo(f"\n{found.title or found.experiment}")
        for sentence in [*conclusions(found), *found.weak]:
            typer.echo(f"  {sentence}")
        rows = estimate_rows(found)
        wide = max(28, *(len(row[0]) for row in rows))
        for row in rows:
            typer.echo(f"  {row[0]:<{wide}} {row[1]} {row[2]}" + (f"  ({row[-1]})" if row[-1] else ""))
        for row in posterior_rows(found):
            value = f"{row[1]} {row[2]}".strip()
            typer.echo(
                f"  posterior: {row[0]:<{wide}} {value}, 95 % {row[3]}, R-hat {row[4]}, {row[5]} independent draws"
            )
        for one in found.suggestions[:1]:
            typer.echo(f"  Next run: {one.what}")
        typer.echo(f"Report: {page.resolve()}")
    if open_page:
        _browse(page)


@app.command()
def effects(json_out: Annotated[bool, typer.Option("--json", help="for machines")] = False) -> None:
    """List the effects that `close-loop` may add: equation, formula, and what each means for a wire."""
    from smajax.effects.library import LIBRARY
    from smajax.parameters import parameters

    told = {
        name: {
            "title": effect.title,
            "equation": effect.equation,
            "formula": effect.formula,
            "meaning": effect.sentence,
            "parameters": {
                entry.name: {"unit": entry.unit, "bounds": [entry.low, entry.high]}
                for entry in parameters(effect.base()).values()
            },
        }
        for name, effect in LIBRARY.items()
    }
    if json_out:
        typer.echo(json.dumps(told))
        return
    for name, one in told.items():
        typer.echo(f"{name}  [{one['equation']}]\n  {one['title']}: {one['formula']}\n  {one['meaning']}")
        for full, entry in one["parameters"].items():  # type: ignore[attr-defined]
            typer.echo(f"    {full}: {entry['bounds'][0]:g} to {entry['bounds'][1]:g} {entry['unit']}")


@app.command()
def presets(json_out: Annotated[bool, typer.Option("--json", help="for machines")] = False) -> None:
    """List the wires, loads and drives that an experiment file may name, and the controllers of the arm."""
    from smajax.control_presets import CONTROLLERS
    from smajax.presets import DRIVES, LOADS, WIRES

    told = {"wires": list(WIRES), "loads": list(LOADS), "drives": list(DRIVES), "controllers": list(CONTROLLERS)}
    if json_out:
        typer.echo(json.dumps(told))
        return
    for kind, names in told.items():
        typer.echo(f"{kind}: {', '.join(names)}")


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="folder for the reports")] = Path("demo-report"),
    only: Annotated[str | None, typer.Option(help=f"one of {', '.join(DEMOS)}")] = None,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="open the first report in a browser")] = True,
) -> None:
    """The main job on two virtual benches shipped with the package: one lacks an effect, the other lacks nothing.

    Each bench was made by a simulator that shares no code with this one; what it really contains lies in truth.toml,
    which the loop does not read and which is printed after each verdict.
    """
    if only is not None and only not in DEMOS:
        raise typer.BadParameter(f"there is no demo `{only}`; choose one of {', '.join(DEMOS)}.", param_hint="--only")
    pages = []
    for name in DEMOS if only is None else (only,):
        with resources.as_file(resources.files("smajax") / "demo" / name) as folder:
            typer.echo(f"\n=== {name} ===")
            findings, page = _loop(folder / "experiment.toml", out / name, f"smajax demo --only {name}")
            _say(findings, page)
            typer.echo("The truth, which the loop did not read:")
            for line in (folder / "truth.toml").read_text(encoding="utf-8").splitlines():
                typer.echo(f"  {line}")
        pages.append(page)
    if open_page and sys.stdout.isatty() and not os.environ.get("CI"):
        _browse(pages[0])


@app.command()
def figures(
    names: Annotated[
        list[str] | None, typer.Argument(help="chapters (chapter3, chapter4) and single figures (M7 C12); default all")
    ] = None,
    out: Annotated[Path, typer.Option(help="folder for the pictures, the numbers (JSON) and the table")] = Path(
        "figures"
    ),
    fast: Annotated[bool, typer.Option("--fast", help="coarser steps, fewer samples, the same claims")] = False,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="open the page in a browser")] = True,
) -> None:
    """Draw the source's figures, each with the number that proves it, and print which claims hold.

    Exit code 1 when one does not. Ctrl-C loses nothing: the same command goes on with the figures that are missing.

    Example:  smajax figures M7 C12 --out figures
    """
    from smajax.runtime import prepare

    prepare()
    from smajax.figures.catalogue import CHAPTERS, rows
    from smajax.figures.write import as_markdown, as_page, as_text, draw
    from smajax.progress import shown

    try:
        asked = [row for name in names or CHAPTERS for row in rows(name)]
    except KeyError as error:
        raise typer.BadParameter(error.args[0], param_hint="NAME") from None
    with _resumable("Finished figures are kept: the same command goes on."), shown(console()) as progress:
        drawn = draw(list(dict.fromkeys(asked)), out, fast, progress)
    (out / "README.md").write_text(as_markdown(drawn), encoding="utf-8")
    page = out / "index.html"
    page.write_text(as_page(drawn), encoding="utf-8")
    typer.echo(as_text(drawn))
    typer.echo(f"Page: {page.resolve()}")
    if open_page and sys.stdout.isatty() and not os.environ.get("CI"):
        _browse(page)
    if not all(one.holds for one in drawn):
        raise typer.Exit(1)


def _numbers(option: str, text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.replace(",", " ").split())
    except ValueError:
        raise typer.BadParameter(f"numbers with commas between them, not `{text}`", param_hint=option) from None


def _pairs(option: str, several: list[str] | None) -> dict[str, float]:
    pairs: dict[str, float] = {}
    for part in ",".join(several or ()).replace(" ", ",").split(","):
        name, sign, value = part.partition("=")
        if not part:
            continue
        try:
            if not sign or name in pairs:
                raise ValueError
            pairs[name] = float(value)
        except ValueError:
            raise typer.BadParameter(
                f"each name once with its number, as in `name=0.2,other=1`, not `{part}`", param_hint=option
            ) from None
    return pairs


@app.command()
def tune(
    controller: Annotated[str, typer.Argument(help="pid, vsc1, vsc2, vsc3, nvsc, sld, backstepping1 or backstepping2")],
    set_points: Annotated[str | None, typer.Option(help="degrees, with commas; default -40,-20,0,20,40,60,85")] = None,
    variation: Annotated[
        list[str] | None,
        typer.Option(help="how wrong the plant may be: inertia=0.2,convection=0.2; may be repeated"),
    ] = None,
    objective: Annotated[str, typer.Option(help="nominal, worst or mean-variance")] = "worst",
    weights: Annotated[
        list[str] | None,
        typer.Option(
            help="of tracking_error, overshoot, settling_time, steady_error, energy, chatter, peak_temperature; default "
            "settling_time=1,overshoot=1,steady_error=2 (a second, a degree, half a degree)"
        ),
    ] = None,
    limits: Annotated[
        list[str] | None, typer.Option(help="of the same, met in every loop: settling_time=4,overshoot=2")
    ] = None,
    by: Annotated[str, typer.Option(help="trust-region or adam")] = "trust-region",
    start: Annotated[
        Path | None, typer.Option(help="gains.json to begin from, in the place of the preset's gains")
    ] = None,
    starts: Annotated[int | None, typer.Option(min=1, help="points that gains are moved from; default 6")] = None,
    rounds: Annotated[int | None, typer.Option(min=1, help="steps, at most; default 30")] = None,
    seconds: Annotated[float, typer.Option(min=0.1, help="length of each closed loop")] = 10.0,
    estimator: Annotated[str, typer.Option(help="`printed` or `model` filter; none: told the true state")] = "",
    noise: Annotated[float, typer.Option(min=0.0, help="noise of the angle's readings, degrees (1 sigma)")] = 0.0,
    period: Annotated[float, typer.Option(help="sample time of the controller, s, a multiple of 0.01")] = 0.01,
    delay: Annotated[int, typer.Option(min=0, help="control periods until a command arrives")] = 0,
    seed: Annotated[int, typer.Option(help="of starts, plants and noise")] = 0,
    out: Annotated[Path, typer.Option(help="folder for gains.json, the page, the pictures and the numbers")] = Path(
        "tune"
    ),
    fast: Annotated[bool, typer.Option("--fast", help="by default set points -20,20,60, 3 starts, 10 rounds")] = False,
    json_out: Annotated[bool, typer.Option("--json", help="print tune.json on stdout instead of words")] = False,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="open the page in a browser")] = True,
) -> None:
    """Tune the gains of a controller of the arm by gradient, on many set points and plants at once.

    Variations: inertia, damping, convection, ambient, payload, supply. The gains are checked on plants and set points that
    tuning never saw. `smajax sweep --gains tune/gains.json` reads them. Exit code 1 when a limit is not met. Ctrl-C loses
    nothing: the same command goes on.

    Example:  smajax tune sld --variation inertia=0.2,damping=0.2,convection=0.2 --limits settling_time=4,overshoot=2
    """
    from smajax.runtime import prepare

    prepare(cores=True)
    from smajax.figures.rigs import arm
    from smajax.gains_file import GainsFileError, read_gains
    from smajax.progress import shown
    from smajax.tune.folder import tune_into
    from smajax.tune.objective import REGULATION
    from smajax.tune.page import conclusions, gain_rows
    from smajax.tune.settings import TuneSettings

    try:
        begun = read_gains(start, arm()) if start is not None else None
        if begun is not None and begun.controller != controller:
            raise GainsFileError(f"gains file {start} is of {begun.controller}, not of {controller}.")
    except GainsFileError as error:
        raise typer.BadParameter(str(error), param_hint="--start") from None
    settings = TuneSettings(
        controller,
        _numbers("--set-points", set_points if set_points is not None else "-20,20,60" if fast else TUNED_AT),
        _pairs("--variation", variation),
        objective,
        _pairs("--weights", weights) or dict(REGULATION),
        _pairs("--limits", limits),
        8 if fast else 32,
        starts or (3 if fast else 6),
        rounds or (10 if fast else 30),
        by,
        seconds,
        estimator,
        noise,
        period,
        delay,
        seed,
        4 if fast else 32,
        {} if begun is None else begun.values,
    )
    command = "smajax " + shlex.join(sys.argv[1:])
    try:
        settings.check(arm())
        _folder(out)
        with _resumable("Finished rounds are kept: the same command goes on."), shown(console()) as progress:
            found = tune_into(arm(), settings, out, command, progress)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    page = out / "tune.html"
    if json_out:
        typer.echo((out / "tune.json").read_text(encoding="utf-8"), nl=False)
    else:
        for sentence in conclusions(found):
            typer.echo(sentence)
        for row in gain_rows(found):
            typer.echo(f"  {row[0]:<24} {row[1]:>10} -> {row[2]:<10} {row[3]}" + (f"  ({row[5]})" if row[5] else ""))
        typer.echo(f"Gains: {(out / 'gains.json').resolve()}")
        typer.echo(f"Page: {page.resolve()}")
    if open_page and sys.stdout.isatty() and not os.environ.get("CI"):
        _browse(page)
    if settings.limits and not found.within_limits:
        raise typer.Exit(1)


@app.command()
def sweep(
    controllers: Annotated[
        str | None,
        typer.Option(
            help="pid, vsc1, vsc2, vsc3, nvsc, sld, backstepping1, backstepping2 (with commas), or `all`; default all, "
            "or those of the gains files"
        ),
    ] = None,
    over: Annotated[str, typer.Option(help="the two mismatches of the maps")] = "convection,damping",
    points: Annotated[
        int | None, typer.Option(min=2, help="mismatches from 0.5 to 2 along each side of a map; default 15")
    ] = None,
    set_points: Annotated[
        str | None, typer.Option(help="degrees, with commas; default -40,-20,0,10,20,40,50,60,80")
    ] = None,
    gains: Annotated[
        list[Path] | None,
        typer.Option(help="gains.json of `smajax tune`, in the place of the preset's; may be repeated"),
    ] = None,
    gain_shares: Annotated[
        str | None, typer.Option(help="shares of the controller's main gain; default 0.5,0.7,1,1.4,2")
    ] = None,
    seconds: Annotated[float, typer.Option(min=0.1, help="length of each closed loop")] = 10.0,
    estimator: Annotated[str, typer.Option(help="`printed` or `model` filter; none: told the true state")] = "",
    noise: Annotated[float, typer.Option(min=0.0, help="noise of the angle's readings, degrees (1 sigma)")] = 0.0,
    period: Annotated[float, typer.Option(help="sample time of the controller, s, a multiple of 0.01")] = 0.01,
    delay: Annotated[int, typer.Option(min=0, help="control periods until a command arrives")] = 0,
    out: Annotated[Path, typer.Option(help="folder for the page, the pictures and the rows")] = Path("sweep"),
    fast: Annotated[
        bool, typer.Option("--fast", help="by default 3 x 3 mismatches, set points -20,20,60, gain 1")
    ] = False,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="open the page in a browser")] = True,
) -> None:
    """Run controllers of the arm on plants that are not what they believe, and compare them on every set point.

    Mismatches: inertia, damping, convection, ambient, payload, supply. Ctrl-C loses nothing: the same command goes on.

    Example:  smajax sweep --controllers pid,sld --over convection,ambient --out sweep
    """
    from smajax.runtime import prepare

    prepare(cores=True)
    from smajax.control_presets import CONTROLLERS
    from smajax.figures.rigs import arm
    from smajax.gains_file import GainsFileError, read_gains
    from smajax.progress import shown
    from smajax.sweep_run import SweepSettings, as_text, run_sweep

    try:
        tuned = tuple(read_gains(path, arm()) for path in gains or ())
    except GainsFileError as error:
        hint = " Shares of the main gain are `--gain-shares`." if any(not one.suffix for one in gains or ()) else ""
        raise typer.BadParameter(f"{error}{hint}", param_hint="--gains") from None
    asked = controllers or ",".join(dict.fromkeys(one.controller for one in tuned)) or "all"
    names = tuple(CONTROLLERS) if asked == "all" else tuple(part for part in asked.split(",") if part)
    pair = tuple(over.split(","))
    if len(pair) != 2:
        raise typer.BadParameter(f"two mismatches with a comma between them, not `{over}`", param_hint="--over")
    settings = SweepSettings(
        names,
        *pair,
        points or (3 if fast else 15),
        _numbers("--set-points", set_points if set_points is not None else "-20,20,60" if fast else SET_POINTS),
        _numbers("--gain-shares", gain_shares if gain_shares is not None else "1" if fast else GAINS),
        seconds,
        filtered=estimator,
        noise=noise,
        period=period,
        delay=delay,
        tuned=tuned,
    )
    try:
        with _resumable("Finished controllers are kept: the same command goes on."), shown(console()) as progress:
            rows = run_sweep(arm(), settings, out, progress)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    typer.echo(as_text(rows))
    page = out / "index.html"
    typer.echo(f"Page: {page.resolve()}")
    if open_page and sys.stdout.isatty() and not os.environ.get("CI"):
        _browse(page)


def main() -> None:
    """Entry point: errors that a user can mend are said in one paragraph with exit code 2, without a traceback."""
    try:
        app()
    except Exception as error:
        # Imported when there is an error: `--help` does not wait for them.
        from smajax.experiment.errors import ExperimentError
        from smajax.measured.table import MeasuredDataError

        if not isinstance(error, (ExperimentError, MeasuredDataError, OSError)):
            raise
        console().print(f"error: {error}", style="red", markup=False, highlight=False, soft_wrap=True)
        raise SystemExit(2) from None
