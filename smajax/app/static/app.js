"use strict";
// Plots, saving as one types, what changes elsewhere, and the progress of a command. The state is on the server: nothing is kept here.
const query = new URLSearchParams(document.body.dataset.folder ? { folder: document.body.dataset.folder } : {});
const address = path => path + (query.size ? "?" + query : "");
const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const SERIES = ["--plot", "--wire", "--good", "--fair", "--poor", "--quiet"];

// --- Plots: of one group share the cursor and the part that is shown.
const groups = new Map();
function shown(value) { return value == null ? "–" : String(Number(value.toPrecision(4))); }
function axis(label, more) {
  return { stroke: colour("--quiet"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1 }, font: "12px system-ui", label, labelSize: label ? 18 : 0, labelFont: "12px system-ui", ...more };
}
function draw(box, data) {
  const several = data.series || [{ name: data.name, y: data.y }];
  const unit = data.unit ? " " + data.unit : "";
  const group = box.dataset.group;
  const height = Number(box.dataset.height) || 150;
  let moving = false;
  const options = {
    width: Math.max(box.clientWidth, 120), height,
    cursor: { sync: group ? { key: group, setSeries: false } : undefined, drag: { x: true, y: false } },
    scales: { x: { time: false }, y: data.log ? { distr: 3 } : {} },
    series: [{ label: data.x_name, value: (u, v) => v == null ? "–" : shown(v) + (data.x_unit ? " " + data.x_unit : "") },
      ...several.map((one, k) => ({ label: one.name, stroke: colour(SERIES[k % SERIES.length]), width: 1.4, dash: k < 6 ? undefined : [6, 4], points: { show: several.length && (data.x || []).length < 3 }, value: (u, v) => shown(v) + (v == null ? "" : unit) }))],
    axes: [axis(data.x_name + (data.x_unit ? " (" + data.x_unit + ")" : ""), { size: 26, labelSize: 16, labelGap: 0 }), axis(data.unit || "", { size: 56 })],
    hooks: { setScale: [(u, key) => {
      if (key !== "x" || !group || moving) return;
      for (const other of groups.get(group) || []) if (other !== u && other.move) other.move(u.scales.x.min, u.scales.x.max);
    }] },
  };
  const plot = new uPlot(options, [data.x, ...several.map(one => one.y)], box);
  plot.move = (min, max) => { if (plot.scales.x.min === min && plot.scales.x.max === max) return; moving = true; plot.setScale("x", { min, max }); setTimeout(() => { moving = false; }); };
  plot.data_range = () => [plot.data[0][0], plot.data[0][plot.data[0].length - 1]];
  box.plot = plot;
  if (group) groups.set(group, [...(groups.get(group) || []), plot]);
  new ResizeObserver(() => { if (box.clientWidth > 100 && Math.abs(box.clientWidth - plot.width) > 2) plot.setSize({ width: box.clientWidth, height }); }).observe(box);
  box.addEventListener("keydown", event => {
    const { min, max } = plot.scales.x, wide = max - min, middle = (min + max) / 2;
    const to = { ArrowLeft: [min - wide / 4, max - wide / 4], ArrowRight: [min + wide / 4, max + wide / 4], "+": [middle - wide / 4, middle + wide / 4], "=": [middle - wide / 4, middle + wide / 4], "-": [middle - wide, middle + wide], "0": plot.data_range() }[event.key];
    if (!to) return;
    event.preventDefault();
    const [first, last] = plot.data_range();
    plot.setScale("x", { min: Math.max(to[0], first), max: Math.min(to[1], last) });
  });
}
async function fill(box) {
  try {
    const answer = await fetch(box.dataset.src);
    const data = await answer.json();
    if (data.error) { box.textContent = data.error; return; }
    if (box.plot && box.plot.series.length === (data.series || [0]).length + 1) { box.plot.setData([data.x, ...(data.series || [{ y: data.y }]).map(one => one.y)]); return; }
    if (!data.x || !data.x.length || (data.series && !data.series.length)) return;
    box.replaceChildren();
    box.closest("figure")?.removeAttribute("hidden");
    draw(box, data);
  } catch { /* the server is away: the banner says so */ }
}
const seen = new IntersectionObserver(entries => entries.forEach(entry => {
  if (entry.isIntersecting) { seen.unobserve(entry.target); fill(entry.target); }
}), { rootMargin: "300px" });
document.querySelectorAll(".plot[data-src]").forEach(box => {
  if (!box.dataset.every) { seen.observe(box); return; }
  fill(box);
  setInterval(() => { if (document.querySelector("[data-running=yes]")) fill(box); }, Number(box.dataset.every));
});

// --- Saving: what was changed is sent at once; the parts of the page that depend on it come back.
let saving = 0;
const say = text => { const at = document.getElementById("saved"); if (at) at.textContent = text; };
function swap(text) {
  const fresh = new DOMParser().parseFromString(text, "text/html");
  document.querySelectorAll("[data-live][id]").forEach(old => {
    const now = fresh.getElementById(old.id);
    if (now && now.innerHTML !== old.innerHTML) old.innerHTML = now.innerHTML;
  });
  document.querySelectorAll("[aria-invalid]").forEach(one => one.removeAttribute("aria-invalid"));
  fresh.querySelectorAll("[aria-invalid]").forEach(one => document.getElementsByName(one.name)[0]?.setAttribute("aria-invalid", "true"));
  if (fresh.body.dataset.stamp) document.body.dataset.stamp = fresh.body.dataset.stamp;
}
async function save(form, fields, reload) {
  saving += 1;
  say("Saving…");
  try {
    const answer = await fetch(form.action || location.href, { method: "POST", body: new URLSearchParams(fields) });
    const text = await answer.text();
    if (answer.status === 403) { say(text); return; }
    if (reload && answer.ok) { location.reload(); return; }
    swap(text);
    say(answer.ok ? "Saved in experiment.toml" : "Not saved, see above");
    if (!answer.ok) form.querySelectorAll("input[type=radio]").forEach(one => { one.checked = one.defaultChecked; });
  } catch { say("Not saved: the server does not answer"); } finally { saving -= 1; }
}
document.querySelectorAll("form[data-autosave]").forEach(form => {
  form.addEventListener("submit", event => event.preventDefault());
  form.addEventListener("change", event => {
    const one = event.target;
    if (!one.name) return;
    const value = one.type === "checkbox" ? (one.checked ? "on" : "off") : one.value;
    save(form, [[one.name, value]], "reload" in one.dataset);
  });
});
document.querySelectorAll("button[data-visible]").forEach(button => button.addEventListener("click", () => {
  const plot = (groups.get(button.dataset.visible) || [])[0];
  if (!plot) return;
  const form = button.form, fields = [];
  const [first, last] = plot.data_range();
  for (const [what, at, end] of [["start", plot.scales.x.min, first], ["end", plot.scales.x.max, last]]) {
    const name = button.dataset.prefix + "." + what;
    const value = Math.abs(at - end) < 1e-9 ? "" : Number(at.toPrecision(5)) + " s";
    form.elements[name].value = value;
    fields.push([name, value]);
  }
  save(form, fields, false);
}));

// --- Files that are dropped.
const input = document.querySelector("#upload input[type=file]");
if (input) {
  const zone = input.closest(".drop");
  const over = on => event => { event.preventDefault(); zone.classList.toggle("over", on); };
  zone.addEventListener("dragover", over(true));
  zone.addEventListener("dragleave", over(false));
  zone.addEventListener("drop", event => { over(false)(event); input.files = event.dataTransfer.files; input.form.requestSubmit(); });
  input.addEventListener("change", () => { say("Sending…"); input.form.requestSubmit(); });
}

// --- What matters most of the preset's values: takes some seconds.
const influences = document.getElementById("influences");
if (influences) saving += 1;
if (influences) fetch(influences.dataset.src).then(answer => answer.json()).then(found => {
  influences.textContent = found.sentence;
  document.body.dataset.stamp = found.stamp; // it writes what it found into the file, as comments
  for (const [name, text] of Object.entries(found.remarks)) {
    const at = document.querySelector(`[data-influence="${CSS.escape(name)}"]`);
    if (at) at.textContent = text;
  }
}).catch(() => { influences.textContent = ""; }).finally(() => { saving -= 1; });

// --- What happens elsewhere: a command that runs, another tab, the command line, a server that is gone.
// A form, or a link, on its way is not overtaken by a reload.
window.addEventListener("beforeunload", () => { saving += 1; });
document.addEventListener("submit", event => { if (!event.defaultPrevented) saving += 1; });
const offline = document.getElementById("offline");
const typing = () => { const at = document.activeElement; return at && /^(INPUT|SELECT)$/.test(at.tagName) && at.value !== at.defaultValue && /^(text|)$/.test(at.type); };
async function watch() {
  const box = document.getElementById("watching");
  if (!box || !box.querySelector("[data-running=yes]")) return;
  const answer = await fetch(box.dataset.watch);
  if (answer.ok) document.getElementById("watch").innerHTML = await answer.text();
}
async function look() {
  try {
    await watch();
    const answer = await fetch(address("/stamp"));
    if (answer.status === 403) { offline.textContent = "The server was started anew: open the address that it printed. What was running goes on."; offline.hidden = false; return; }
    offline.hidden = true;
    const { stamp } = await answer.json();
    if (stamp !== document.body.dataset.stamp && !saving && !typing() && !("stay" in document.body.dataset)) location.reload();
  } catch {
    offline.textContent = "The server does not answer. Nothing is lost, and a fit that is running goes on: start smajax app again in this folder.";
    offline.hidden = false;
  }
}
setInterval(look, 1000);
