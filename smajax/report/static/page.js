// A click on a heading sorts its table by the record's numbers (data-v), by numbers in the text, or by the text; another click the
// other way round. A column is one of numbers where every cell that says something begins with one, or "never" or "not within", which are later than all.
document.querySelectorAll("table.sortable").forEach(table => table.querySelectorAll("thead th").forEach((head, column) => {
  head.tabIndex = 0;
  const sort = () => {
    const rising = head.getAttribute("aria-sort") !== "ascending";
    const rows = [...table.tBodies[0].rows];
    const said = row => row.cells[column].textContent.trim().replace("−", "-");
    const key = row => {
      const cell = row.cells[column], text = said(row);
      if (cell.dataset.v !== undefined) return Number(cell.dataset.v);
      if (/^(never|not within)/.test(text)) return Infinity;
      // Of a column that is set as numbers a word may stand before: "beyond 0.2", "< 0.1".
      const found = text.match(cell.classList.contains("n") ? /[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?/i : /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?/i);
      return found ? Number(found[0]) : NaN;
    };
    const marked = rows.some(row => row.cells[column].classList.contains("n") || row.cells[column].dataset.v !== undefined);
    const numeric = rows.some(row => Number.isFinite(key(row))) && (marked || rows.every(row => /^[–-]?$/.test(said(row)) || !Number.isNaN(key(row))));
    const text = (a, b) => said(a).localeCompare(said(b), undefined, { numeric: true }) * (rising ? 1 : -1);
    rows.sort((a, b) => {
      if (!numeric) return text(a, b);
      const [x, y] = [key(a), key(b)];
      if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) - Number.isNaN(y);
      return x === y ? 0 : (x < y ? -1 : 1) * (rising ? 1 : -1);
    });
    table.querySelectorAll("th").forEach(other => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", rising ? "ascending" : "descending");
    table.tBodies[0].append(...rows);
  };
  head.addEventListener("click", sort);
  head.addEventListener("keydown", event => { if (event.key === "Enter") sort(); });
}));
// A click on a picture shows it at its full size over the page; another click, or Escape, closes it.
document.querySelectorAll("img").forEach(image => {
  image.tabIndex = 0;
  image.title = "a click shows it at its full size";
  const show = () => {
    const large = document.createElement("dialog");
    large.className = "zoom";
    const copy = image.cloneNode();
    copy.className = "";
    copy.src = image.currentSrc || image.src; // what is shown, where a telephone has a picture of its own
    large.append(copy);
    large.addEventListener("click", () => large.close());
    large.addEventListener("close", () => large.remove());
    document.body.append(large);
    large.showModal();
  };
  image.addEventListener("click", show);
  image.addEventListener("keydown", event => { if (event.key === "Enter") show(); });
});
// Below a picture, and below a table: what it shows as a file.
const below = (place, words, why, act) => {
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: words, title: why });
  button.setAttribute("aria-label", `${words}: ${why}`);
  button.addEventListener("click", act);
  let row = place.nextElementSibling;
  if (!row?.classList.contains("more-of")) { row = document.createElement("div"); row.className = "more-of"; place.after(row); }
  row.append(button);
  return button;
};
const save_as = (name, address) => { const link = document.createElement("a"); link.download = name; link.href = address; link.click(); };
const file_of = words => words.trim().replace(/[^\p{L}\p{N}]+/gu, "_").slice(0, 60) || "smajax";
document.querySelectorAll("img").forEach(image => {
  if (image.closest(".still")) return; // its plot has these
  const kind = /^data:image\/(\w+)/.exec(image.src)?.[1] || "png";
  below(image.closest(".scroll") || image, kind.toUpperCase(), `download the picture: ${image.alt}`, () => save_as(`${file_of(image.alt)}.${kind}`, image.currentSrc || image.src));
});
document.querySelectorAll("table:has(thead)").forEach((table, k) => {
  const box = table.closest(".scroll") || table;
  const beyond = table.querySelectorAll("tr.beyond").length;
  if (beyond) {
    const all = below(box, `all ${table.tBodies[0].rows.length}`, `show the ${beyond} other rows`, () => {
      table.classList.toggle("all");
      all.removeAttribute("aria-label");
      all.textContent = table.classList.contains("all") ? "fewer" : `all ${table.tBodies[0].rows.length}`;
    });
  }
  const cell = text => /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  below(box, "CSV", `download table ${k + 1} as CSV`, () => {
    const text = [...table.rows].map(row => [...row.cells].map(one => cell(one.textContent.trim().replace(/\s+/g, " "))).join(",")).join("\n") + "\n";
    const heading = table.closest("section, header")?.querySelector("h2, h1")?.textContent || "table";
    const part = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    save_as(`${file_of(heading)}.csv`, part);
    setTimeout(() => URL.revokeObjectURL(part), 1000);
  });
});
// A line of a command can be copied; where a browser does not let a page do that, it is marked.
document.querySelectorAll("code.line").forEach(line => {
  const text = line.textContent, words = line.firstChild;
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: "copy" });
  button.setAttribute("aria-label", `copy: ${text}`);
  button.addEventListener("click", async () => {
    try { await navigator.clipboard.writeText(text); button.textContent = "copied"; }
    catch { const range = document.createRange(); range.selectNodeContents(words); getSelection().removeAllRanges(); getSelection().addRange(range); }
    setTimeout(() => { button.textContent = "copy"; }, 1500);
  });
  line.prepend(button);
});
// A link into what is folded away unfolds it; the contents say where the reader is.
const unfold = () => { const at = document.getElementById(decodeURIComponent(location.hash.slice(1))), box = at?.closest("details:not([open])"); if (box) { box.open = true; at.scrollIntoView(); } };
addEventListener("hashchange", unfold);
unfold();
const entries = [...document.querySelectorAll("nav a")].map(link => [link, document.getElementById(link.hash.slice(1))]).filter(([, at]) => at);
if (entries.length) {
  const mark = () => {
    const now = entries.filter(([, at]) => at.getBoundingClientRect().top < innerHeight / 3).pop() || entries[0];
    for (const [link] of entries) link === now[0] ? link.setAttribute("aria-current", "true") : link.removeAttribute("aria-current");
  };
  addEventListener("scroll", mark, { passive: true });
  mark();
}
