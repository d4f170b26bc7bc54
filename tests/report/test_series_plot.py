"""Series of a page: thinned with every extreme, decoded to what was drawn, and moved in a browser."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from markupsafe import Markup

from smajax.report.frame import STATIC
from smajax.report.html import findings_to_html
from smajax.report.plain_page import whole
from smajax.report.series_picture import COLOURS, as_picture, series
from smajax.report.series_plot import (
    NUMBERS,
    POINTS,
    Band,
    Line,
    Panel,
    SeriesPlot,
    content,
    encoded,
    kept_samples,
    moving,
    room,
)
from tests.helpers.in_browser import HOSTILE
from tests.helpers.made_findings import made_findings, made_run

LARGEST = 800_000  # bytes of a page


def decoded(column: dict[str, Any], length: int) -> np.ndarray:
    """As series.js reads a column."""
    if not column["data"]:
        return np.full(length, np.nan if column["low"] is None else column["low"])
    whole_ones = np.frombuffer(base64.b64decode(column["data"]), "<u4" if column["bits"] == 32 else "<u2")
    values = column["low"] + column["step"] * whole_ones
    return np.where(whole_ones == 2 ** column["bits"] - 1, np.nan, values)


def a_plot(samples: int = 400, name: str = "measured") -> SeriesPlot:
    time = np.linspace(0.0, 20.0, samples)
    wave = np.sin(time)
    upper = Panel("position", "mm", (Line(name, wave, "measured"), Line("model", 0.5 * wave, "after")))
    band = Band("noise", wave - 0.1, wave + 0.1, "noise")
    return SeriesPlot(
        f"a run, {name}", time, (upper, Panel("residual", "mm", (Line("left", 0.5 * wave, "before"),), (band,)))
    )


def test_thinning_keeps_every_extreme_of_every_series() -> None:
    rng = np.random.default_rng(1)
    columns = [rng.normal(size=100_003) for _ in range(5)]
    columns[3][70_000:70_900] = np.nan
    columns[0][77_777], columns[4][100_002] = 50.0, -30.0
    kept = kept_samples(columns, 2000)
    assert len(kept) < 2100
    assert np.all(np.diff(kept) > 0)
    assert (kept[0], kept[-1]) == (0, 100_002)
    for values in columns:
        assert (np.nanmin(values[kept]), np.nanmax(values[kept])) == (np.nanmin(values), np.nanmax(values))
    # Not only of the whole, but all along: the largest of each twentieth.
    for part in np.array_split(np.arange(100_000), 20):
        inside = kept[(kept >= part[0]) & (kept <= part[-1])]
        assert np.max(columns[1][inside]) >= np.quantile(columns[1][part], 0.999)
    assert np.isnan(columns[3][kept]).any()
    np.testing.assert_array_equal(kept_samples([np.arange(9.0)], 2000), np.arange(9))


def test_numbers_come_back_as_they_were() -> None:
    values = np.asarray([0.0247, np.nan, -0.001, 0.0111111, 0.0])
    found = decoded(encoded(values), 5)
    np.testing.assert_allclose(found, values, atol=0.6 * (0.0247 + 0.001) / 65534)
    assert (found[0], found[2]) == pytest.approx((0.0247, -0.001), abs=1e-12)
    np.testing.assert_array_equal(decoded(encoded(np.full(4, 7.25)), 4), 7.25)
    assert np.isnan(decoded(encoded(np.full(3, np.nan)), 3)).all()
    np.testing.assert_allclose(decoded(encoded(np.asarray([3.0, np.nan])), 2), [3.0, np.nan])
    time = np.arange(200_000) * 5e-3
    assert np.all(np.diff(decoded(encoded(time, 32), len(time))) > 0.0)


def test_the_page_holds_the_series_that_were_given() -> None:
    plot = a_plot(50_000)
    found = content(plot)
    length = found["length"]
    assert length <= POINTS + 10
    time = decoded(found["columns"][0], length)
    for panel, given in zip(found["panels"], plot.panels, strict=True):
        for line, one in zip(panel["lines"], given.lines, strict=True):
            shown = decoded(found["columns"][line["column"]], length)
            np.testing.assert_allclose(shown, np.interp(time, plot.at, one.values), atol=1e-4)
    assert room(1) == POINTS
    assert room(100) * 100 <= NUMBERS


def test_names_cannot_leave_the_script_that_holds_them() -> None:
    figure = str(moving(a_plot(name="</script><b>x</b>"), Markup("")))
    assert figure.count("</script>") == 1
    assert "<b>" not in figure
    told = json.loads(re.findall(r'<script type="application/json">(.*)</script>', figure)[0])
    assert told["panels"][0]["lines"][0]["name"] == "</script><b>x</b>"


def test_the_picture_has_the_colours_of_the_plot() -> None:
    light = (STATIC / "look.css").read_text(encoding="utf-8").split("@media")[0]
    assert {name: colour for name, colour in re.findall(r"--(\w+): (#\w+);", light) if name in COLOURS} == COLOURS
    assert as_picture(a_plot()).startswith(b"\x89PNG")


@pytest.mark.usefixtures("blank_pictures")
def test_a_report_of_many_long_runs_is_no_larger_than_800_kb() -> None:
    """Ten runs have a picture behind their plot, of some 19 kB, all one over the temperature, of some 6 kB: 370 kB."""
    runs = tuple(made_run(f"run {k}", "held-out" if k % 5 == 4 else "fit", k, 2000) for k in range(30))
    page = findings_to_html(dataclasses.replace(made_findings(), runs=runs))
    assert page.count('<figure class="series"') == 32
    assert "20 more runs" in page
    assert page.count("this plot needs scripts") == 20
    assert len(page.encode()) < LARGEST - 370_000


def test_a_report_with_its_pictures_is_no_larger_than_800_kb(folder: Path) -> None:
    assert 300_000 < (folder / "report.html").stat().st_size < LARGEST


ZOOMED = "() => document.querySelector('figure.series').plots.map(one => [one.scales.x.min, one.scales.x.max])"


def shown_page(browser: Any, folder: Path, plot: SeriesPlot, **how: Any) -> Any:
    path = folder / "page.html"
    path.write_text(whole("A page", ["<h1>A page</h1>", str(series(plot))]), encoding="utf-8")
    page = browser.new_page(**how)
    page.goto(path.as_uri())
    page.wait_for_selector("figure.series canvas")
    return page


def test_plots_zoom_move_show_values_and_are_joined(browser: Any, tmp_path: Path) -> None:
    plot = a_plot(401, HOSTILE)
    page = shown_page(browser, tmp_path, plot, viewport={"width": 1000, "height": 900})
    assert page.evaluate(ZOOMED) == [[0.0, 20.0]] * 2
    over = page.locator(".u-over").first
    box = over.bounding_box()
    # A drag zooms both panels.
    page.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 40, steps=4)
    page.mouse.up()
    page.wait_for_function("() => document.querySelector('figure.series').plots.every(one => one.scales.x.max < 11)")
    (low, high), other = page.evaluate(ZOOMED)
    assert (low, high) == pytest.approx((5.0, 10.0), abs=0.1)
    assert other == [low, high]
    # With Shift it moves them.
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 40, steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")
    (moved, end), other = page.evaluate(ZOOMED)
    assert (moved, end - moved) == pytest.approx((6.0, 5.0), abs=0.15)
    assert other == [moved, end]
    # The value under the cursor stands in the key of each panel, as the series has it.
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 30)
    at, *values = page.evaluate(
        "() => [document.querySelector('.key .at').textContent, ...[...document.querySelectorAll('.key .value')].map(one => one.textContent)]"
    )
    time = float(at.split()[1])
    assert (moved + end) / 2 == pytest.approx(time, abs=0.1)
    assert [float(text.split()[0]) for text in values[:3]] == pytest.approx(
        [np.sin(time), 0.5 * np.sin(time), 0.5 * np.sin(time)], abs=2e-3
    )
    assert "…" in values[3]
    # Buttons and keys, within the data.
    page.get_by_role("button", name="show all").click()
    assert page.evaluate(ZOOMED) == [[0.0, 20.0]] * 2
    page.locator(".live").focus()
    for key in ("+", "ArrowLeft", "ArrowLeft", "ArrowLeft"):
        page.keyboard.press(key)
    page.wait_for_function("() => document.querySelector('figure.series').plots.every(one => one.scales.x.max === 10)")
    assert page.evaluate(ZOOMED) == [[0.0, 10.0]] * 2


def test_a_plot_downloads_its_numbers_and_pictures(browser: Any, tmp_path: Path) -> None:
    page = shown_page(browser, tmp_path, a_plot(100), viewport={"width": 700, "height": 900})
    files = {}
    for kind in ("CSV", "SVG", "PNG"):
        with page.expect_download() as waiting:
            page.get_by_role("button", name=f"as {kind}").click()
        files[kind] = Path(waiting.value.path()).read_bytes()
        assert waiting.value.suggested_filename == f"a_run_measured.{kind.lower()}"
    head, *rows = files["CSV"].decode().splitlines()
    assert head == (
        'time [s],position: measured [mm],position: model [mm],residual: left [mm],"residual: noise, low [mm]","residual: noise, high [mm]"'
    )
    values = np.asarray([[float(cell) for cell in row.split(",")] for row in rows])
    np.testing.assert_allclose(values[:, 1], np.sin(values[:, 0]), atol=1e-4)
    svg = files["SVG"].decode()
    assert svg.count("<path clip-path") == 4
    assert files["PNG"].startswith(b"\x89PNG")


def test_without_scripts_and_in_print_the_picture_is_there(browser: Any, tmp_path: Path) -> None:
    page = shown_page(browser, tmp_path, a_plot(), viewport={"width": 700, "height": 900})
    seen = "() => [...document.querySelectorAll('.still img, .live')].map(one => one.getClientRects().length > 0)"
    assert page.evaluate(seen) == [False, True]
    page.emulate_media(media="print")
    assert page.evaluate(seen) == [True, False]
    plain = browser.new_context(java_script_enabled=False).new_page()
    plain.goto((tmp_path / "page.html").as_uri())
    assert plain.locator(".still img").is_visible()


def test_a_dark_page_has_dark_plots(browser: Any, tmp_path: Path) -> None:
    """Lines and words of a plot take the page's colours, and take others when these change."""
    page = shown_page(browser, tmp_path, a_plot(), viewport={"width": 700, "height": 900}, color_scheme="light")
    mean = (
        "() => { const c = document.querySelector('figure.series canvas'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        " let sum = 0, n = 0; for (let k = 0; k < d.length; k += 4) if (d[k + 3] > 200) { sum += d[k] + d[k + 1] + d[k + 2]; n++; } return sum / n / 3; }"
    )
    light = page.evaluate(mean)
    page.emulate_media(color_scheme="dark")
    page.wait_for_timeout(200)
    dark = page.evaluate(mean)
    assert light != dark
    assert page.evaluate("() => getComputedStyle(document.body).backgroundColor") == "rgb(21, 23, 26)"
