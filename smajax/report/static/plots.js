"use strict";
// Plots by uPlot, of the pages that are written and of smajax app. A drag zooms, with Shift it moves; a double click shows all; Ctrl
// and the wheel, two fingers, keys and buttons do the same. Plots of one group share the cursor and the part that is shown.
const smajaxPlots = (() => {
  const groups = new Map();
  const shown = value => value == null || !Number.isFinite(value) ? "–" : String(Number(value.toPrecision(4)));
  const place = value => value == null ? "" : String(Number(value.toPrecision(6)));
  const colour = (name, alpha = 1) => {
    const found = getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
    return alpha < 1 ? found + Math.round(255 * alpha).toString(16).padStart(2, "0") : found;
  };
  const unit = text => text ? " " + text : "";
  const element = (name, more = {}, ...inside) => { const made = Object.assign(document.createElement(name), more); made.append(...inside); return made; };
  const ends = plot => [plot.data[0][0], plot.data[0][plot.data[0].length - 1]];

  // Show the part from `min` to `max`, kept within the data.
  function show(plot, min, max) {
    const [first, last] = ends(plot), wide = Math.min(max - min, last - first);
    if (!(wide > 0)) return;
    const from = Math.max(first, Math.min(min, last - wide));
    plot.setScale("x", { min: from, max: from + wide });
  }
  function zoom(plot, factor, about) {
    const { min, max } = plot.scales.x, at = about ?? (min + max) / 2;
    show(plot, at - (at - min) * factor, at + (max - at) * factor);
  }
  function slide(plot, share) { const { min, max } = plot.scales.x; show(plot, min + share * (max - min), max + share * (max - min)); }
  const MOVES = {
    ArrowLeft: plot => slide(plot, -0.25), ArrowRight: plot => slide(plot, 0.25), "+": plot => zoom(plot, 0.5), "=": plot => zoom(plot, 0.5),
    "-": plot => zoom(plot, 2), "0": plot => show(plot, ...ends(plot)),
  };
  function keys(box, plot_of) {
    box.addEventListener("keydown", event => {
      const move = MOVES[event.key], plot = plot_of();
      if (!move || !plot || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      move(plot);
    });
  }
  // With Shift a drag moves the part that is shown.
  function grab(plot, down) {
    const { min, max } = plot.scales.x, wide = plot.over.clientWidth;
    const move = event => { const by = (down.clientX - event.clientX) / wide * (max - min); show(plot, min + by, max + by); };
    document.addEventListener("mousemove", move);
    document.addEventListener("mouseup", () => document.removeEventListener("mousemove", move), { once: true });
  }
  // One finger reads values, two zoom and move; a page that is drawn upwards still moves.
  function touch(plot) {
    const over = plot.over, fingers = new Map();
    over.style.touchAction = "pan-y";
    over.addEventListener("wheel", event => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      zoom(plot, event.deltaY > 0 ? 1.25 : 0.8, plot.posToVal(event.clientX - over.getBoundingClientRect().left, "x"));
    }, { passive: false });
    const from = event => event.clientX - over.getBoundingClientRect().left;
    let begin = null;
    over.addEventListener("pointerdown", event => {
      if (event.pointerType !== "touch") return;
      fingers.set(event.pointerId, from(event));
      const at = [...fingers.values()];
      begin = at.length === 2 ? at.map(one => plot.posToVal(one, "x")) : null;
    });
    over.addEventListener("pointermove", event => {
      if (!fingers.has(event.pointerId)) return;
      fingers.set(event.pointerId, from(event));
      const at = [...fingers.values()];
      if (at.length === 1) { plot.setCursor({ left: at[0], top: 10 }, true, true); return; }
      if (!begin || Math.abs(at[1] - at[0]) < 8) return;
      const scale = (begin[1] - begin[0]) / (at[1] - at[0]);
      if (scale > 0) show(plot, begin[0] - scale * at[0], begin[0] + scale * (over.clientWidth - at[0]));
    });
    for (const gone of ["pointerup", "pointercancel"]) over.addEventListener(gone, event => { fingers.delete(event.pointerId); begin = null; });
  }

  // The key of a panel: what is drawn, with the values at the cursor; a click hides a line.
  function key_of(panel, x) {
    const at = element("span", { className: "at" });
    const row = element("div", { className: "key" }, element("strong", { textContent: panel.label || "" }), at);
    const bands = (panel.bands || []).map(band => ({ ...band, isBand: true }));
    const entries = [...panel.lines, ...bands].map(line => {
      if (line.silent) return null;
      const value = element("span", { className: "value" });
      const mark = element("i", { className: line.isBand ? "area" : line.dash ? "dashed" : "" });
      mark.style.setProperty("--of", `var(--${line.colour})`);
      const entry = element("button", { type: "button", title: "hide, or show again" }, mark, line.name, " ", value);
      entry.setAttribute("aria-pressed", "true");
      row.append(entry);
      return { entry, value };
    });
    const tell = plot => {
      const k = plot.cursor.idx;
      at.textContent = k == null ? "" : `${x.name} ${place(plot.data[0][k])}${unit(x.unit)}`;
      entries.forEach((one, n) => {
        if (!one) return;
        const [first, second] = plot.own[n].series;
        const said = k == null ? "" : second ? `${shown(plot.data[second][k])} … ${shown(plot.data[first][k])}` : shown(plot.data[first][k]) + unit(panel.unit);
        if (one.value.textContent !== said) one.value.textContent = said;
      });
    };
    return { row, entries, tell };
  }

  // One panel. panel: {label, unit, height, lines: [{name, y, colour, width, alpha, dash, silent}], bands: [{name, low, high, colour, alpha}],
  // range, log}; x: {y, name, unit, label}; last: with the axis below.
  function panel_in(box, panel, x, { group, last = true, spans = [] }) {
    const data = [x.y], series = [{}], bands = [], areas = [], own = [];
    for (const band of panel.bands || []) {
      data.push(band.high, band.low);
      bands.push({ series: [data.length - 2, data.length - 1], fill: () => colour(band.colour, band.alpha) });
      areas.push({ series: [data.length - 2, data.length - 1] });
      for (const name of ["high", "low"]) series.push({ label: `${band.name} ${name}`, stroke: () => "rgb(0 0 0 / 0)", width: 0, points: { show: false } });
    }
    for (const line of panel.lines) {
      data.push(line.y);
      own.push({ series: [data.length - 1] });
      const lone = line.y.some(value => value == null) || line.y.length < 3;
      series.push({ label: line.name, stroke: () => colour(line.colour, line.alpha), width: line.width || 1.4, dash: line.dash ? [6, 4] : undefined, points: lone ? { show: true, size: 4 } : undefined });
    }
    own.push(...areas);
    const key = key_of(panel, x);
    const at = element("div", { className: "panel" });
    box.append(key.row, at);
    const axis = more => ({ stroke: () => colour("quiet"), grid: { stroke: () => colour("line"), width: 1 }, ticks: { stroke: () => colour("line"), width: 1 }, font: "12px system-ui, sans-serif", ...more });
    const below = last ? { label: x.label, labelSize: x.label ? 18 : 0, labelGap: 2, labelFont: "12px system-ui, sans-serif", size: 30 } : { size: 4, values: (u, splits) => splits.map(() => "") };
    const height = panel.height + (last ? 52 : 4);
    const plot = new uPlot({
      width: Math.max(box.clientWidth, 120), height, padding: [6, 10, 0, 0], legend: { show: false },
      cursor: {
        sync: group ? { key: group, setSeries: false } : undefined, drag: { x: true, y: false }, y: false,
        bind: { mousedown: (u, over, act) => event => { if (event.button === 0 && event.shiftKey) { grab(u, event); return null; } return act(event); } },
      },
      scales: { x: { time: false }, y: panel.log ? { distr: 3 } : panel.range ? { range: panel.range } : {} },
      series, bands, axes: [axis(below), axis({ size: 66, values: (u, splits) => splits.map(one => one == null ? "" : String(Number(one.toPrecision(6)))), space: 24 })],
      hooks: {
        drawClear: [u => {
          u.ctx.fillStyle = colour("tint", 0.35);
          for (const [begin, end] of spans) { const left = u.valToPos(begin, "x", true), right = u.valToPos(end, "x", true); u.ctx.fillRect(Math.max(left, u.bbox.left), u.bbox.top, Math.min(right, u.bbox.left + u.bbox.width) - Math.max(left, u.bbox.left), u.bbox.height); }
        }],
        setCursor: [u => { if (u.own) key.tell(u); }],
        setScale: [(u, name) => {
          if (name !== "x" || !group) return;
          const { min, max } = u.scales.x;
          for (const other of groups.get(group) || []) if (other !== u && (other.scales.x.min !== min || other.scales.x.max !== max)) other.setScale("x", { min, max });
        }],
      },
    }, data, at);
    Object.assign(plot, { own, panel, about: x });
    plot.root.plot = plot;
    key.entries.forEach((one, n) => one?.entry.addEventListener("click", () => {
      const on = one.entry.getAttribute("aria-pressed") !== "true";
      one.entry.setAttribute("aria-pressed", String(on));
      for (const k of own[n].series) plot.setSeries(k, { show: on });
    }));
    if (group) groups.set(group, [...(groups.get(group) || []), plot]);
    new ResizeObserver(() => { if (box.clientWidth > 100 && Math.abs(box.clientWidth - plot.width) > 2) plot.setSize({ width: box.clientWidth, height }); }).observe(box);
    touch(plot);
    return plot;
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => document.querySelectorAll(".uplot").forEach(one => one.plot?.redraw()));
  return { panel_in, keys, show, zoom, slide, ends, shown, colour, groups, element, MOVES };
})();
