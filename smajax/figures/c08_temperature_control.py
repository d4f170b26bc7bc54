"""C8: temperature control while the arm passes its greatest stress takes the overshoot away (Fig. 4.13)."""

from __future__ import annotations

from matplotlib.figure import Figure

from smajax.control_presets import temperature_vsc, vsc3_of_section_4_6
from smajax.figures.drawing import keyed, panels
from smajax.figures.row import Result, Row
from smajax.figures.set_points import SET_POINTS, Runs, draw_angles, measures, overshoot, regulated, steady, time_of

FROM = 10.0  # degrees: from here on VSC overshoots by more than the degree that counts as there


def work(fast: bool) -> Result:
    """VSC and NVSC at eight set points; NVSC is told the true state."""
    before = regulated(vsc3_of_section_4_6, fast)
    after = regulated(temperature_vsc, fast)
    numbers = measures(before, "vsc_") | measures(after, "nvsc_")
    old = {angle: one for angle, (_, one) in before.items()}
    new = {angle: one for angle, (_, one) in after.items()}
    less = all(overshoot(new[angle]) < overshoot(old[angle]) for angle in SET_POINTS)
    sooner = all(
        time_of(new[angle].settling_time) <= time_of(old[angle].settling_time) for angle in SET_POINTS if angle >= FROM
    )
    farther = max(steady(new[angle]) - steady(old[angle]) for angle in SET_POINTS)
    later = {angle: time_of(new[angle].reach_time) - time_of(old[angle].reach_time) for angle in SET_POINTS}
    easy = [angle for angle in SET_POINTS if angle < FROM]
    slower = max(time_of(new[angle].settling_time) - time_of(old[angle].settling_time) for angle in easy)
    slowest = max(time_of(new[angle].settling_time) for angle in SET_POINTS)
    return Result(
        holds=bool(less and sooner and farther < 0.5),
        found=f"at {SET_POINTS[0]:g} to {SET_POINTS[-1]:g}° the overshoot falls from {min(map(overshoot, old.values())):.1f} to "
        f"{max(map(overshoot, old.values())):.0f}° under VSC to {max(map(overshoot, new.values())):.1f}° or less under NVSC, which from {FROM:g}° on settles no "
        f"later, at every set point within {slowest:.1f} s, with a steady error of {max(map(steady, new.values())):.1f}° at most instead of "
        f"{max(map(steady, old.values())):.1f}°",
        numbers=numbers,
        draw=lambda figure: _draw(figure, before, after),
        caveat=f"the price is a later first arrival, by {min(later.values()):.1f} to {max(later.values()):.1f} s, where the VSC is on its way to "
        f"overshoot; below {FROM:g}°, where it overshoots by {max(overshoot(old[angle]) for angle in easy):.1f}° at most, NVSC settles up to {slower:.1f} s later. "
        "VSC has the quick gains of C9: with those of C4 it overshoots nowhere beyond -15°, and nothing is left to mend. Gains of both chosen here.",
    )


def _draw(figure: Figure, before: Runs, after: Runs) -> None:
    top, bottom = panels(figure, 2, share=True)
    for axes, runs, name in ((top, before, "VSC"), (bottom, after, "NVSC")):
        draw_angles(axes, runs)
        axes.set_title(name, fontsize=9.5, loc="left")
        axes.set_xlim(0.0, 6.0)
        axes.set_ylim(-48.0, 95.0)
    keyed(top)


ROW = Row(
    "C8",
    "Fig. 4.13",
    "arm, NVSC (temperature based) and VSC",
    "less overshoot at each desired angle, no slower, same steady error",
    work,
)
