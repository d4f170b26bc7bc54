"""Pictures of an identification, each a function from the record to a PNG."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from smajax.core.display_units import axis_label, digits, display, label
from smajax.fit.identify_result import Identified, IdentifiedRun
from smajax.model.channels import channel
from smajax.report.pictures import AFTER, QUIET, as_png, new_figure, tidy
from smajax.report.run_plots import measured_line, output_panel, residual_panel, run_plot
from smajax.report.series_plot import Band, Line, Panel, SeriesPlot


def run_plot_of(result: Identified, run: IdentifiedRun, k: int = 0) -> SeriesPlot:
    """Of the k-th output: measured, simulated, residual with the noise's band and the parameters', varying inputs."""
    sensor, one = result.outputs[k], run.series[k]
    shown = display(sensor.unit, sensor.name)
    measured, simulated = shown.of(one.measured), shown.of(one.simulated)
    both = shown.of(np.broadcast_to(1.96 * np.hypot(one.spread, sensor.noise_sigma), measured.shape))
    output = output_panel(sensor.name, shown, [measured_line(measured), Line("simulated", simulated, "after")])
    band = Band("95 %: noise and parameters", -both, both, "noise", 0.8)
    residual = residual_panel(shown, [Line("residual", measured - simulated, "after", 1.0)], [band])
    return run_plot(f"{label(run.name)}, {label(sensor.name)}", run.time, run.inputs, output, residual)


def _panels(count: int, height: float, upright: bool) -> tuple[Figure, np.ndarray]:
    """A figure with room for `count` panels of a height (inch), three a row, or two for a telephone."""
    columns = min(2 if upright else 3, count)
    rows = -(-count // columns)
    figure = new_figure(height * rows + 0.5, width=2.3 * columns + 0.4 if upright else 2.7 * columns + 0.6)
    # Room between the numbers at the ends of two axes side by side.
    figure.get_layout_engine().set(w_pad=0.12, h_pad=0.08)  # type: ignore[union-attr, call-arg]
    return figure, figure.subplots(rows, columns, squeeze=False).ravel()


def profile_curves(result: Identified, upright: bool = False) -> bytes | None:
    """Rise of the cost over each profiled parameter, with the parabola that its standard error stands for."""
    if not result.profiles:
        return None
    figure, panels = _panels(len(result.profiles), 2.5, upright)
    estimates = {one.name: one for one in result.estimates}
    for axes, one in zip(panels, result.profiles, strict=False):
        estimate = estimates[one.name]
        unit = display(estimate.unit, one.name)
        axes.plot(unit.of(one.values), one.rise, "o-", color=AFTER, markersize=3.5, linewidth=1.2)
        if estimate.standard_error:
            fine = np.linspace(one.values.min(), one.values.max(), 100)
            axes.plot(
                unit.of(fine), ((fine - estimate.value) / estimate.standard_error) ** 2, color=QUIET, linewidth=0.9
            )
        axes.axhline(3.84, color="#c8553d", linewidth=0.8)
        axes.set_ylim(0.0, 9.0)
        # A narrow interval has long numbers: few of them, and none beyond the panel's own width.
        axes.xaxis.set_major_locator(MaxNLocator(3, prune="both"))
        axes.set_xlabel(axis_label(one.name, unit), fontsize=8)
        tidy(axes)
    for axes in panels[len(result.profiles) :]:
        axes.set_visible(False)
    panels[0].set_ylabel("rise of the cost", fontsize=8)
    return as_png(figure)


def posterior_histograms(result: Identified, upright: bool = False) -> bytes | None:
    """Each parameter's draws beside the Gaussian of its standard error."""
    drawn = result.posterior
    if drawn is None:
        return None
    figure, panels = _panels(len(drawn.names), 2.2, upright)
    estimates = {one.name: one for one in result.estimates}
    for axes, name, draws in zip(panels, drawn.names, drawn.flat.T, strict=False):
        estimate = estimates[name]
        unit = display(estimate.unit, name)
        axes.hist(unit.of(draws), bins=40, density=True, color=AFTER, alpha=0.55)
        if estimate.standard_error:
            error = unit.of(estimate.standard_error)
            left, right = axes.get_xlim()
            fine = np.linspace(left, right, 200)
            height = np.exp(-0.5 * ((fine - unit.of(estimate.value)) / error) ** 2) / (error * np.sqrt(2.0 * np.pi))
            axes.plot(fine, height, color=QUIET, linewidth=1.1)
        axes.set_xlabel(axis_label(name, unit), fontsize=8)
        axes.set_yticks([])
        axes.xaxis.set_major_locator(MaxNLocator(3, prune="both"))
        tidy(axes)
    for axes in panels[len(drawn.names) :]:
        axes.set_visible(False)
    return as_png(figure)


def suggested_inputs(result: Identified) -> list[SeriesPlot]:
    """The inputs of the suggested runs, best first."""
    plots = []
    for number, one in enumerate(result.suggestions, start=1):
        name = max(one.inputs, key=lambda channel_: float(np.ptp(one.inputs[channel_])))
        unit, values = channel(name), one.inputs[name]
        line = Line(label(name), np.asarray(unit.of(values)), "input", silent=True)
        panel = Panel(f"{number}. {label(name)}", unit.unit, (line,), height=110)
        axis = ("time", "s") if result.clocked else ("sample", "")
        about = f"suggested run {number}: {digits(one.information, 3)} nats"
        plots.append(SeriesPlot(about, np.arange(len(values)) * float(result.step), (panel,), axis))
    return plots
