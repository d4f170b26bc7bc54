// A click on a heading sorts its table by the record's numbers (data-v), by numbers in the text, or by the text; another click the
// other way round. A column is one of numbers where every cell that says something begins with one, or "never", which is later than all.
document.querySelectorAll("table.sortable").forEach(table => table.querySelectorAll("thead th").forEach((head, column) => {
  head.tabIndex = 0;
  const sort = () => {
    const rising = head.getAttribute("aria-sort") !== "ascending";
    const rows = [...table.tBodies[0].rows];
    const said = row => row.cells[column].textContent.trim().replace("−", "-");
    const key = row => {
      const cell = row.cells[column], text = said(row);
      if (cell.dataset.v !== undefined) return Number(cell.dataset.v);
      if (/^never/.test(text)) return Infinity;
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
  image.tabIndex = 0;
  image.style.cursor = "zoom-in";
  image.addEventListener("click", show);
  image.addEventListener("keydown", event => { if (event.key === "Enter") show(); });
});
