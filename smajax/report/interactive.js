// A click on a heading sorts its table by the record's numbers (data-v), by numbers in the text, or by the text.
document.querySelectorAll("table.sortable").forEach(table => table.querySelectorAll("thead th").forEach((head, column) => {
  head.tabIndex = 0;
  const sort = () => {
    const rising = head.getAttribute("aria-sort") !== "ascending";
    const key = row => {
      const cell = row.cells[column];
      if (cell.dataset.v !== undefined) return Number(cell.dataset.v);
      const found = cell.classList.contains("n") ? cell.textContent.replace("−", "-").match(/^-?[\d.]+(e[-+]?\d+)?/i) : null;
      return found ? Number(found[0]) : NaN;
    };
    const rows = [...table.tBodies[0].rows];
    const numeric = rows.some(row => !Number.isNaN(key(row)));
    rows.sort((a, b) => {
      if (!numeric) return a.cells[column].textContent.localeCompare(b.cells[column].textContent) * (rising ? 1 : -1);
      const [x, y] = [key(a), key(b)];
      if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) - Number.isNaN(y);
      return (x - y) * (rising ? 1 : -1);
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
