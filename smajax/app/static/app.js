"use strict";
// Plots, saving as one types, what changes elsewhere, and the progress of a command. The state is on the server: nothing is kept here.
const query = new URLSearchParams(document.body.dataset.folder ? { folder: document.body.dataset.folder } : {});
const address = path => path + (query.size ? "?" + query : "");

// --- Plots.
const SERIES = ["plot", "wire", "good", "fair", "poor", "quiet"];
function draw(box, data) {
  const several = data.series || [{ name: data.name, y: data.y }];
  const lines = several.map((one, k) => ({ ...one, colour: SERIES[k % SERIES.length], dash: k >= SERIES.length }));
  const label = data.x_name + (data.x_unit ? " (" + data.x_unit + ")" : "");
  const panel = { label: data.unit || "", unit: data.unit, height: (Number(box.dataset.height) || 150) - 52, lines, log: data.log };
  box.plot = smajaxPlots.panel_in(box, panel, { y: data.x, name: data.x_name, unit: data.x_unit, label }, { group: box.dataset.group });
  smajaxPlots.keys(box, () => box.plot);
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
  const plot = (smajaxPlots.groups.get(button.dataset.visible) || [])[0];
  if (!plot) return;
  const form = button.form, fields = [];
  const [first, last] = smajaxPlots.ends(plot);
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
