// Every figure with numbers (a script of JSON beside its picture) becomes a plot; the picture stays for print and for readers
// without scripts. Numbers are 16 bits between the least and the largest of their column, the common axis 32.
const smajaxSeries = (() => {
  const { element, panel_in, keys, colour, MOVES } = smajaxPlots;
  function decoded({ low, step, bits, data }, length) {
    if (!data) return Array(length).fill(low);
    const raw = Uint8Array.from(atob(data), one => one.charCodeAt(0)).buffer;
    const whole = bits === 32 ? new Uint32Array(raw) : new Uint16Array(raw), none = 2 ** bits - 1;
    return Array.from(whole, one => one === none ? null : low + step * one);
  }
  function read(figure) {
    const told = JSON.parse(figure.querySelector("script[type='application/json']").textContent);
    const column = k => decoded(told.columns[k], told.length);
    const line = ({ column: k, ...more }) => ({ ...more, y: column(k) });
    const band = ({ low, high, ...more }) => ({ ...more, low: column(low), high: column(high) });
    return { ...told, x: { ...told.x, y: column(0) }, panels: told.panels.map(one => ({ ...one, lines: one.lines.map(line), bands: one.bands.map(band) })) };
  }
  const save = (name, part) => {
    const link = element("a", { download: name, href: URL.createObjectURL(part) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  const cell = text => /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  const number = value => value == null ? "" : String(Number(value.toPrecision(6)));
  const in_unit = (name, unit) => unit ? `${name} [${unit}]` : name;
  function as_csv({ x, panels }) {
    const columns = [[in_unit(x.name, x.unit), x.y]];
    for (const panel of panels) {
      const named = name => in_unit(panel.name && panel.name !== name ? `${panel.name}: ${name}` : name, panel.unit);
      for (const line of panel.lines) columns.push([named(line.name), line.y]);
      for (const band of panel.bands) columns.push([named(`${band.name}, low`), band.low], [named(`${band.name}, high`), band.high]);
    }
    return [columns.map(([name]) => cell(name)).join(","), ...x.y.map((_, k) => columns.map(([, values]) => number(values[k])).join(","))].join("\n") + "\n";
  }

  // The part that is shown, as it is on the screen, in vectors.
  function as_svg(plots) {
    const text = said => String(said ?? "").replace(/[&<>]/g, one => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[one]);
    const word = (at, down, said, more = "") => `<text x="${at}" y="${down}" ${more}>${text(said)}</text>`;
    const parts = [], scale = devicePixelRatio || 1, fix = value => value.toFixed(2);
    let top = 0;
    for (const plot of plots) {
      const { panel } = plot, box = Object.fromEntries(Object.entries(plot.bbox).map(([name, value]) => [name, value / scale]));
      let right = box.left + 8 + 7 * (panel.label || "").length;
      parts.push(word(4, top + 14, panel.label, 'font-weight="600"'));
      for (const one of [...panel.lines, ...panel.bands]) if (!one.silent) {
        parts.push(`<rect x="${right}" y="${top + 7}" width="14" height="${one.low ? 8 : 3}" fill="${colour(one.colour)}" opacity="${one.alpha ?? 1}"/>`, word(right + 18, top + 14, one.name));
        right += 34 + 6.5 * one.name.length;
      }
      top += 20;
      const x = value => fix(plot.valToPos(value, "x") + box.left), y = value => fix(plot.valToPos(value, "y") + top + box.top);
      const [first, last] = plot.series[0].idxs, shown = [...Array(last - first + 1).keys()].map(k => k + first), at = plot.data[0];
      const clip = `c${parts.length}`;
      parts.push(`<clipPath id="${clip}"><rect x="${box.left}" y="${top + box.top}" width="${box.width}" height="${box.height}"/></clipPath>`);
      plot.axes.forEach((axis, side) => (axis._splits || []).forEach((value, k) => {
        if (value == null) return;
        const along = side ? y(value) : x(value);
        parts.push(side ? `<path d="M${box.left} ${along}h${box.width}" stroke="${colour("line")}"/>` + word(box.left - 6, Number(along) + 4, axis._values?.[k], 'text-anchor="end"')
          : `<path d="M${along} ${top + box.top}v${box.height}" stroke="${colour("line")}"/>` + word(along, top + box.top + box.height + 16, axis._values?.[k], 'text-anchor="middle"'));
      }));
      const way = values => { let on = false; return shown.map(k => { if (values[k] == null) { on = false; return ""; } const step = `${on ? "L" : "M"}${x(at[k])} ${y(values[k])}`; on = true; return step; }).join(""); };
      for (const band of panel.bands) {
        const held = shown.filter(k => band.low[k] != null && band.high[k] != null);
        if (held.length) parts.push(`<path clip-path="url(#${clip})" d="M${held.map(k => `${x(at[k])} ${y(band.high[k])}`).join("L")}L${held.reverse().map(k => `${x(at[k])} ${y(band.low[k])}`).join("L")}Z" fill="${colour(band.colour)}" fill-opacity="${band.alpha ?? 1}"/>`);
      }
      panel.lines.forEach((line, n) => {
        if (plot.series[plot.own[n].series[0]].show) parts.push(`<path clip-path="url(#${clip})" d="${way(line.y)}" fill="none" stroke="${colour(line.colour)}" stroke-opacity="${line.alpha ?? 1}" stroke-width="${line.width || 1.4}"${line.dash ? ' stroke-dasharray="6 4"' : ""}/>`);
      });
      top += plot.height;
    }
    const { about, bbox, width } = plots[plots.length - 1];
    parts.push(word((bbox.left + bbox.width / 2) / scale, top - 4, about.label, 'text-anchor="middle"'));
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${top + 6}" viewBox="0 0 ${width} ${top + 6}" font-family="system-ui, sans-serif" font-size="12" fill="${colour("ink")}"><rect width="100%" height="100%" fill="${colour("card")}"/>${parts.join("")}</svg>`;
  }
  function as_png(plots) {
    const image = new Image();
    image.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(as_svg(plots));
    return image.decode().then(() => {
      const canvas = element("canvas", { width: 2 * image.width, height: 2 * image.height });
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      return new Promise(done => canvas.toBlob(done, "image/png"));
    });
  }

  const TOOLS = [["+", "+", "zoom in"], ["−", "-", "zoom out"], ["←", "ArrowLeft", "earlier"], ["→", "ArrowRight", "later"], ["all", "0", "show all"]];
  let count = 0;
  function build(figure) {
    if (figure.plots) return figure.plots;
    const told = read(figure), live = figure.querySelector(".live"), group = `series-${++count}`, file = told.file;
    const plots = told.panels.map((panel, k) => panel_in(live, panel, told.x, { group, last: k === told.panels.length - 1, spans: told.spans }));
    figure.plots = plots;
    const button = (said, why, act) => { const made = element("button", { type: "button", textContent: said, title: why }); made.setAttribute("aria-label", why); made.addEventListener("click", act); return made; };
    live.prepend(element("div", { className: "tools" },
      element("span", {}, ...TOOLS.map(([said, key, why]) => button(said, why, () => MOVES[key](plots[0])))),
      element("span", {},
        button("CSV", "download the numbers as CSV", () => save(`${file}.csv`, new Blob([as_csv(told)], { type: "text/csv" }))),
        button("PNG", "download what is shown as PNG", () => as_png(plots).then(part => save(`${file}.png`, part))),
        button("SVG", "download what is shown as SVG", () => save(`${file}.svg`, new Blob([as_svg(plots)], { type: "image/svg+xml" }))))));
    live.style.minHeight = "";
    keys(live, () => plots[0]);
    return plots;
  }
  const seen = new IntersectionObserver(entries => entries.forEach(entry => { if (entry.isIntersecting) { seen.unobserve(entry.target); build(entry.target.parentElement); } }), { rootMargin: "500px" });
  document.querySelectorAll("figure.series").forEach(figure => {
    const live = element("div", { className: "live", tabIndex: 0 });
    live.setAttribute("role", "group");
    live.setAttribute("aria-label", `${figure.dataset.about}. Arrow keys move, + and - zoom, 0 shows all.`);
    live.style.minHeight = `${figure.dataset.height}px`; // what follows stays where it is
    figure.append(live);
    figure.classList.add("moving");
    seen.observe(live);
  });
  return { build, read, as_csv, as_svg, as_png, save };
})();
