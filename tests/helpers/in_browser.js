// What is wrong with a page as a browser shows it, in sentences. Run inside of the page; returns a list.
async hostile => {
  const wrong = [];
  const shown = element => element.getClientRects().length > 0;
  const named = element => `${element.tagName.toLowerCase()}${element.id ? "#" + element.id : ""} "${element.textContent.trim().slice(0, 40)}"`;

  // Nothing sticks out to the side, but in a box that moves sideways.
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > width) wrong.push(`the page is ${document.documentElement.scrollWidth} px wide, the window ${width}`);
  const moves = element => {
    for (let box = element.parentElement; box && box !== document.body; box = box.parentElement)
      if (["auto", "scroll"].includes(getComputedStyle(box).overflowX)) return true;
    return false;
  };
  for (const element of document.body.querySelectorAll("*"))
    if (shown(element) && element.getBoundingClientRect().right > width + 1 && !moves(element)) wrong.push(`cut off at the side: ${named(element)}`);

  // Text of a size that can be read.
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const text = [];
  while (walker.nextNode()) {
    const parent = walker.currentNode.parentElement;
    if (["SCRIPT", "STYLE", "NOSCRIPT"].includes(parent.tagName) || !walker.currentNode.data.trim() || !shown(parent)) continue;
    text.push(walker.currentNode.data);
    const size = parseFloat(getComputedStyle(parent).fontSize);
    if (size < 11) wrong.push(`text of ${size} px: ${named(parent)}`);
  }

  // Every picture is there, large enough, and shows something.
  for (const image of document.images) {
    await image.decode().catch(() => wrong.push(`a picture that cannot be read: ${image.alt}`));
    const [across, down] = [image.naturalWidth, image.naturalHeight];
    if (!across || !down) continue;
    if (!image.alt) wrong.push("a picture without a word for it");
    if (shown(image) && image.getBoundingClientRect().width < Math.min(300, across)) wrong.push(`a picture ${image.getBoundingClientRect().width} px wide: ${image.alt}`);
    const canvas = Object.assign(document.createElement("canvas"), { width: across, height: down });
    const pen = canvas.getContext("2d");
    pen.drawImage(image, 0, 0);
    const levels = pen.getImageData(0, 0, across, down).data.filter((_, k) => k % 4 === 1);
    const mean = levels.reduce((sum, one) => sum + one, 0) / levels.length;
    const spread = Math.sqrt(levels.reduce((sum, one) => sum + (one - mean) ** 2, 0) / levels.length);
    if (spread < 5) wrong.push(`a blank picture: ${image.alt}`);
  }

  // Every table has rows, no row is empty, and no cell shows a value that is none in a program's words.
  for (const table of document.querySelectorAll("table")) {
    const rows = [...table.tBodies].flatMap(body => [...body.rows]);
    if (!rows.length) wrong.push(`a table without a row: ${named(table)}`);
    for (const row of rows) {
      if (![...row.cells].some(cell => cell.textContent.trim())) wrong.push("an empty row");
      for (const cell of row.cells)
        if (/^(nan|none|null|undefined|inf|\[object.*)$/i.test(cell.textContent.trim())) wrong.push(`a cell says ${cell.textContent.trim()}`);
    }
    const head = (table.tHead?.rows[0] ?? rows[0])?.cells.length;
    if (rows.some(row => row.cells.length !== head)) wrong.push(`rows of another length than their heading: ${named(table)}`);
  }

  // Every table with headings sorts: a click on one, by number where all cells begin with one; another the other way round. No row is lost.
  for (const table of document.querySelectorAll("table:has(thead):not(.sortable)")) wrong.push(`a table that does not sort: ${named(table)}`);
  for (const table of document.querySelectorAll("table.sortable")) {
    const body = table.tBodies[0], all = () => [...body.rows].map(row => row.textContent);
    const before = all().sort().join("\n");
    [...table.tHead.rows[0].cells].forEach((heading, column) => {
      if (!heading.textContent.trim() && column === 0) wrong.push(`the first heading is empty: ${named(table)}`);
      for (const rising of [true, false, true]) {
        heading.click();
        const cells = [...body.rows].map(row => row.cells[column]).filter(cell => !["", "–"].includes(cell.textContent.trim()));
        const number = cell => {
          if (cell.dataset.v !== undefined) return Number(cell.dataset.v);
          const text = cell.textContent.trim().replace("−", "-");
          return text.startsWith("never") ? Infinity : parseFloat(cell.classList.contains("n") ? text.replace(/^\D*?(?=[-+.]?\d)/, "") : text);
        };
        const numbers = cells.map(number).filter(value => !Number.isNaN(value));
        const numeric = numbers.some(Number.isFinite) && (numbers.length === cells.length || cells.some(cell => cell.classList.contains("n") || cell.dataset.v !== undefined));
        const [values, order] = numeric
          ? [numbers, (a, b) => (a < b ? -1 : a > b ? 1 : 0)]
          : [cells.map(cell => cell.textContent.trim()), (a, b) => a.localeCompare(b, undefined, { numeric: true })];
        const sorted = values.every((value, k) => !k || order(values[k - 1], value) * (rising ? 1 : -1) <= 0);
        if (!sorted) wrong.push(`a click on "${heading.textContent}" does not sort: ${values}`);
        if (heading.getAttribute("aria-sort") !== (rising ? "ascending" : "descending")) wrong.push(`"${heading.textContent}" does not say how it sorts`);
      }
    });
    if (all().sort().join("\n") !== before) wrong.push("sorting lost a row");
  }

  // A click on a picture shows it at its full size, Escape closes it (the test presses that).
  if (document.images.length) {
    document.images[0].click();
    const large = document.querySelector("dialog[open] img");
    if (!large || Math.round(large.getBoundingClientRect().width) !== document.images[0].naturalWidth) wrong.push("a click on a picture does not show it at its full size");
  }

  // What a user wrote is text: it is read as written, runs nowhere, and nothing was escaped twice.
  if (hostile && !text.some(part => part.includes(hostile))) wrong.push("the user's text is not on the page as written");
  if (window.hacked) wrong.push("the user's text ran as a program");
  const rest = text.map(part => part.replaceAll(hostile, "")).join("\n");
  for (const found of rest.match(/<\/?[a-z][^<>\n]*>|&(lt|gt|amp|quot|#\w+);/g) || []) wrong.push(`markup as text: ${found}`);
  return wrong;
}
