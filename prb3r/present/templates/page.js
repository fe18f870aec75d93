"use strict";
// Without this script the page is complete; with it tables sort and filter, and figures tell which case is pointed at.
const add = (parent, tag, attributes = {}, text = "") => {
  const inSvg = tag === "svg" || parent.namespaceURI.endsWith("svg");
  const made = inSvg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.textContent = text;
  return parent.appendChild(made);
};

// Tables ------------------------------------------------------------------------------------------------------------
const number = text => parseFloat(text.replaceAll("−", "-").replaceAll(",", ""));
const keyOf = cell => (cell.dataset.key === undefined ? number(cell.textContent) : parseFloat(cell.dataset.key));
const byWords = new Intl.Collator(undefined, {numeric: true}).compare;
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0], rows = [...body.rows], heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const words = !head.classList.contains("n"), name = head.textContent;
    head.textContent = "";
    add(head, "button", {type: "button", title: "Sort by this column"}, name || "Row").addEventListener("click", () => {
      const sign = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      heads.forEach(other => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
      const compare = (a, b) => {
        if (words) return sign * byWords(a.cells[column].textContent, b.cells[column].textContent);
        const [x, y] = [a, b].map(row => keyOf(row.cells[column]));
        return isNaN(x) || isNaN(y) ? isNaN(x) - isNaN(y) : sign * (x - y);
      };
      body.append(...rows.toSorted(compare));
    });
  });
  if (rows.length < 8) continue;
  const bar = document.createElement("div"), label = add(bar, "label", {}, "Filter ");
  bar.className = "filter";
  const input = add(label, "input", {type: "search", placeholder: "words, or heading<number"});
  const count = add(bar, "span", {"aria-live": "polite"}, `${rows.length} rows`);
  table.parentElement.before(bar);
  const keeps = (row, word) => {
    const asked = word.match(/^([^<>]+)([<>])(−?-?[\d.,e−-]+)$/);
    const column = asked ? heads.findIndex(head => head.textContent.toLowerCase().includes(asked[1])) : -1;
    if (column < 0) return row.textContent.toLowerCase().includes(word);
    const value = keyOf(row.cells[column]);
    return asked[2] === "<" ? value < number(asked[3]) : value > number(asked[3]);
  };
  input.addEventListener("input", () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    rows.forEach(row => { row.hidden = !words.every(word => keeps(row, word)); });
    const left = rows.filter(row => !row.hidden).length;
    count.textContent = left < rows.length ? `${left} of ${rows.length} rows` : `${rows.length} rows`;
  });
}

// Manipulators: place (0.1 mm) and angle (mrad) of every disk, plates as cubic curves between them ---------------------
const source = document.getElementById("pointed");
const data = source ? JSON.parse(source.textContent) : {figures: {}, cases: {}, states: {}, paths: []};
const outline = (state, half, to) => {
  const disks = [];
  for (let k = 0; k + 2 < state.length; k += 3) disks.push([state[k] / 10, state[k + 1] / 10, state[k + 2] / 1000]);
  const at = (x, y) => to(x, y).map(part => part.toFixed(2)).join(" ");
  return disks.map(([x, y, angle], k) => {
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const disk = `M${at(x - half * s, y + half * c)}L${at(x + half * s, y - half * c)}M${at(x, y)}`;
    if (k + 1 === disks.length) return disk;
    const [u, v, turn] = disks[k + 1], third = Math.hypot(u - x, v - y) / 3;
    const ends = at(u - third * Math.cos(turn), v - third * Math.sin(turn));
    return `${disk}C${at(x + third * c, y + third * s)} ${ends} ${at(u, v)}`;
  }).join("");
};
const stateAt = (id, step) => data.states[`${id}:${step}`] || data.states[`${id}:-1`];
const frame = () => {
  const ends = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [state] of Object.values(data.states)) {
    for (let k = 0; k + 2 < state.length; k += 3) {
      const [x, y] = [state[k] / 10, state[k + 1] / 10];
      ends[0] = Math.min(ends[0], x); ends[1] = Math.min(ends[1], y);
      ends[2] = Math.max(ends[2], x); ends[3] = Math.max(ends[3], y);
    }
  }
  const room = data.half + 0.03 * (ends[2] - ends[0] + ends[3] - ends[1]);
  return {box: `${ends[0] - room} ${-ends[3] - room} ${ends[2] - ends[0] + 2 * room} ${ends[3] - ends[1] + 2 * room}`,
    to: (x, y) => [x, -y]};
};

// Figures: the case that is pointed at, by pointer or arrow keys ---------------------------------------------------------
for (const image of document.querySelectorAll("img[data-spots]")) {
  const figure = data.figures[image.dataset.spots], points = figure.points, tall = 1000 * figure.ratio;
  const stage = document.createElement("div");
  stage.className = "stage";
  image.before(stage);
  stage.append(image);
  stage.tabIndex = 0;
  stage.setAttribute("role", "group");
  stage.setAttribute("aria-label", `${image.alt} Arrow keys go from case to case.`);
  const svg = add(stage, "svg", {viewBox: `0 0 1000 ${tall}`, preserveAspectRatio: "none", "aria-hidden": "true"});
  const drawn = add(svg, "path", {class: "shape"}), ring = add(svg, "ellipse", {class: "ring", rx: 0, ry: 0});
  const told = document.createElement("div");
  told.className = "told";
  told.setAttribute("aria-live", "polite");
  stage.after(told);
  const some = figure.all > points.length ? ` Of ${figure.all.toLocaleString("en")} places ${points.length.toLocaleString("en")} tell.` : "";
  const hint = `Point at a place of the figure, or focus it and use the arrow keys, to see which case it is.${some}`;
  const words = add(told, "span", {}, hint);
  const order = points.map((_, k) => k).sort((a, b) => points[a][2] - points[b][2] || points[a][0] - points[b][0]);
  let place = -1;
  const show = k => {
    const [x, y, panel, id, step] = points[k], scale = figure.scales[panel], state = stateAt(id, step);
    const size = 5000 / svg.getBoundingClientRect().width;
    for (const [name, value] of Object.entries({cx: 1000 * x, cy: tall * y, rx: size, ry: size})) ring.setAttribute(name, value);
    const onPaper = scale && state ? (u, v) => [1000 * (scale[0] + scale[2] * u), tall * (scale[1] - scale[3] * v)] : null;
    drawn.setAttribute("d", onPaper ? outline(state[0], data.half, onPaper) : "");
    const where = scale ? `Tip at x = ${((x - scale[0]) / scale[2]).toFixed(0)} mm, y = ${((scale[1] - y) / scale[3]).toFixed(0)} mm. ` : "";
    words.textContent = [data.cases[id] || "", where + (state && state[1] ? state[1] : "")].filter(Boolean).join("\n");
    told.querySelector("svg")?.remove();
    if (state && !onPaper) {
      const {box, to} = frame();
      add(add(told, "svg", {viewBox: box, role: "img", "aria-label": "The manipulator there"}), "path", {class: "shape", d: outline(state[0], data.half, to)});
    }
    place = order.indexOf(k);
  };
  stage.addEventListener("pointermove", event => {
    const box = svg.getBoundingClientRect();
    const away = points.map(([x, y]) => Math.hypot(box.left + x * box.width - event.clientX, box.top + y * box.height - event.clientY));
    const nearest = away.indexOf(Math.min(...away));
    if (away[nearest] < 30) show(nearest);
  });
  stage.addEventListener("keydown", event => {
    const steps = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity};
    if (!(event.key in steps)) return;
    event.preventDefault();
    show(order[Math.max(0, Math.min(order.length - 1, place + steps[event.key]))]);
  });
}

// Paths: a player ----------------------------------------------------------------------------------------------------------
const player = document.getElementById("player");
if (player && data.paths.length) {
  player.hidden = false;
  const box = document.createElement("div");
  box.className = "player";
  player.append(box);
  const {box: view, to} = frame(), svg = add(box, "svg", {viewBox: view, role: "img", "aria-label": "The manipulator along its path"});
  const trace = add(svg, "path", {class: "shape", style: "stroke-width: 1; opacity: .5"}), drawn = add(svg, "path", {class: "shape"});
  const button = add(box, "button", {type: "button"}, "Play"), slider = add(box, "input", {type: "range", min: 0, value: 0, "aria-label": "Step"});
  const choice = add(box, "select", {"aria-label": "Case"}), words = add(box, "div", {class: "told"});
  data.paths.forEach(([id], k) => add(choice, "option", {value: k}, data.cases[id].split("\n")[0]));
  let timer = 0;
  const show = () => {
    const [id, steps] = data.paths[choice.value], state = data.states[`${id}:${steps[slider.value]}`];
    drawn.setAttribute("d", outline(state[0], data.half, to));
    words.textContent = `Step ${steps[slider.value]} of ${steps.at(-1)}. ${state[1]}`;
  };
  const stop = () => { clearInterval(timer); timer = 0; button.textContent = "Play"; };
  const choose = () => {
    const [id, steps] = data.paths[choice.value];
    slider.max = steps.length - 1;
    slider.value = 0;
    const tips = steps.map(step => data.states[`${id}:${step}`][0].slice(-3)).map(([x, y]) => to(x / 10, y / 10).join(" "));
    trace.setAttribute("d", `M${tips.join("L")}`);
    show();
  };
  button.addEventListener("click", () => {
    if (timer) { stop(); return; }
    if (slider.value === slider.max) slider.value = 0;
    button.textContent = "Pause";
    timer = setInterval(() => { slider.value = +slider.value + 1; show(); if (slider.value === slider.max) stop(); }, 150);
  });
  slider.addEventListener("input", show);
  choice.addEventListener("change", () => { stop(); choose(); });
  choose();
}
