// What is wrong with how a page stands: parts beyond its edges, parts that lie on each other.
const BLOCKS = "h1, h2, h3, p, li, dt, dd, img, table, .filter, .told > span, .told > svg, .player > *, .card";
const wrongIn = view => {
  const doc = view.document, wrong = [], width = doc.documentElement.clientWidth;
  if (doc.documentElement.scrollWidth > width) wrong.push(`scrolls sideways: ${doc.documentElement.scrollWidth} > ${width}`);
  const parts = [...doc.querySelectorAll(BLOCKS)].filter(part => part.getClientRects().length);
  const seen = part => {
    // what a scrolling box cuts off is not seen
    let {left, right, top, bottom} = part.getBoundingClientRect();
    for (let box = part.parentElement; box; box = box.parentElement) {
      if (view.getComputedStyle(box).overflowX === "visible") continue;
      const cut = box.getBoundingClientRect();
      [left, right, top, bottom] = [Math.max(left, cut.left), Math.min(right, cut.right), Math.max(top, cut.top), Math.min(bottom, cut.bottom)];
    }
    return {left, right, top, bottom};
  };
  const boxes = parts.map(seen), name = part => `${part.tagName} ${part.textContent.slice(0, 30)}`;
  parts.forEach((part, i) => {
    const a = boxes[i];
    if (a.right > width + 1 || a.left < -1) wrong.push(`beyond the edge: ${name(part)}`);
    for (let k = i + 1; k < parts.length; k++) {
      const b = boxes[k];
      if (part.contains(parts[k])) continue;
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left), down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (across > 1 && down > 1) wrong.push(`overlap: ${name(part)} and ${name(parts[k])}`);
    }
  });
  for (const cell of doc.querySelectorAll("td, th, button, p, h1, h2, h3")) {
    if (cell.getClientRects().length && cell.scrollWidth > cell.clientWidth + 1 && cell.clientWidth) wrong.push(`text beyond its box: ${name(cell)}`);
  }
  return [...new Set(wrong)];
};

// Helpers of the tests: sorted values of a column, a press of a key, a pointer at a place of a figure.
const column = (table, k) => [...table.tBodies[0].rows].filter(row => !row.hidden).map(row => row.cells[k].textContent);
const press = (view, part, key) => part.dispatchEvent(new view.KeyboardEvent("keydown", {key, bubbles: true, cancelable: true}));
const pointAt = (view, stage, x, y) => {
  const box = stage.querySelector("svg").getBoundingClientRect();
  const place = {clientX: box.left + x * box.width, clientY: box.top + y * box.height, bubbles: true};
  stage.dispatchEvent(new view.PointerEvent("pointermove", place));
};
const type = (view, input, text) => { input.value = text; input.dispatchEvent(new view.Event("input", {bubbles: true})); };

addEventListener("load", async () => {
  const found = {};
  for (const [page, text] of Object.entries(PAGES)) {
    for (const width of WIDTHS) {
      const view = document.createElement("iframe");
      Object.assign(view.style, {width: `${width}px`, height: "900px", border: 0});
      view.srcdoc = text;
      const ready = new Promise(resolve => { view.onload = resolve; });
      document.body.append(view);
      await ready;
      const inner = view.contentWindow, before = wrongIn(inner);
      let kept = null;
      try { kept = act(page, inner, inner.document); } catch (error) { before.push(`the test fails: ${error.stack}`); }
      found[`${page} ${width}`] = {wrong: [...new Set([...before, ...wrongIn(inner)])], found: kept ?? null};
      view.remove();
    }
  }
  document.getElementById("found").textContent = JSON.stringify(found);
});
