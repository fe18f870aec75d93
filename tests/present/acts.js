// What the tests do with a page: `page` is its name, `view` its window, `doc` its document.
const known = JSON.parse(doc.getElementById("pointed")?.textContent ?? "null");
const told = stage => stage.parentElement.querySelector(".told").textContent;
const found = {stages: doc.querySelectorAll(".stage").length};
const all = [...doc.querySelectorAll("table.sortable")], table = all.at(-1);
if (page === "designs") {
  const button = table.tHead.querySelectorAll("button")[2];
  const head = button.parentElement, bar = table.parentElement.previousElementSibling;
  found.name = button.textContent;
  found.before = column(table, 2);
  button.click();
  found.up = [head.getAttribute("aria-sort"), column(table, 2)];
  button.click();
  found.down = [head.getAttribute("aria-sort"), column(table, 2)];
  const input = bar.querySelector("input");
  type(view, input, "friction<0.2");
  found.less = [column(table, 1), bar.querySelector("span").textContent];
  type(view, input, "nothing-like-it");
  found.none = column(table, 1);
  type(view, input, "");
  found.again = column(table, 1).length;
}
found.figures = [...doc.querySelectorAll(".stage")].map(stage => {
  const image = stage.querySelector("img"), figure = known.figures[image.dataset.spots];
  const [x, y, , id] = figure.points[Math.floor(figure.points.length / 2)];
  const hint = told(stage);
  pointAt(view, stage, x, y);
  const drawings = [stage.querySelector(".shape"), stage.parentElement.querySelector(".told svg path")];
  const pointed = told(stage), drawn = drawings.map(path => path?.getAttribute("d")).find(Boolean) || "";
  press(view, stage, "Home");
  const first = told(stage);
  press(view, stage, "ArrowRight");
  const counts = {all: figure.all, told: figure.points.length};
  return {name: image.dataset.spots, hint, words: known.cases[id], pointed, drawn, first, second: told(stage), x, y, ...counts};
});
const player = doc.querySelector("#player .player");
if (player) {
  const slider = player.querySelector("input"), path = player.querySelectorAll("path")[1];
  const start = path.getAttribute("d");
  type(view, slider, slider.max);
  found.played = [slider.max, start !== path.getAttribute("d"), player.querySelector(".told").textContent];
}
return found;
