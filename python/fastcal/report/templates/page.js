// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
"use strict";

// Widths in CSS pixels of figures on A4 with 14 mm margins (182 mm of text): the sizes on paper can't be asked for before printing.
const PAPER_WIDTH = 687;
const PAPER_GAP = 12;
const PAPER_CARD = 41; // border and margins of the verdict
const PAPER_SCENE = [440, 240]; // as in page.css
const PAPER_ASPECT = { 2: 0.6, 3: 0.42, 4: 0.36, 6: 0.28 };
const UNITS = /([\d±]) (?=(?:mm|µm|m|px|mrad|rad|deg|Grad|arcmin|kg|Nm?|°C|K|s|A|%|±)(?![\p{L}\d]))/gu;
const NARROW = 480, LINE = 15; // [pixels]
const PHONE = 560; // as in page.css
const plots = [...document.querySelectorAll(".plot")];
const drawn = plots.map(() => false);

// Colours of a drawing on a dark screen; paper is always white.
const DARK = JSON.parse(document.body.dataset.dark);
const prefersDark = matchMedia("(prefers-color-scheme: dark)");
const [sees, from] = [Object.keys(DARK), (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16)).join()];
const TRANSLUCENT = Object.fromEntries(sees.filter((each) => each.length === 7).map((each) => [from(each), from(DARK[each])]));

function darkened(value) {
  if (typeof value === "string") {
    if (value in DARK) return DARK[value];
    const [, colour, rest] = /^rgba\((\d+,\d+,\d+)(,.*)$/.exec(value) ?? [];
    return colour ? (DARK[`rgba(${colour}`] ?? `rgba(${TRANSLUCENT[colour] ?? colour}`) + rest : value;
  }
  if (Array.isArray(value)) return value.map(darkened);
  if (value === null || typeof value !== "object") return value;
  return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, darkened(part)]));
}

function drawing(plot, onPaper = false) {
  const content = JSON.parse(plot.nextElementSibling.textContent);
  if (prefersDark.matches && !onPaper) [content.data, content.layout] = darkened([content.data, content.layout]);
  return content;
}

function colourKeys(onPaper = false) {
  for (const mark of document.querySelectorAll(".key [fill], .key [stroke]")) {
    const name = mark.hasAttribute("fill") ? "fill" : "stroke";
    mark.dataset.colour ??= mark.getAttribute(name);
    mark.setAttribute(name, prefersDark.matches && !onPaper ? darkened(mark.dataset.colour) : mark.dataset.colour);
  }
}

async function redraw(chosen, onPaper = false) {
  colourKeys(onPaper);
  for (const plot of chosen) {
    const { data, layout } = drawing(plot, onPaper);
    if (plot.scene) plot.scene.read(data, layout);
    else await Plotly.react(plot, data, layout);
  }
}

function say(plot, text) {
  const message = document.createElement("div");
  message.className = "message";
  message.textContent = text;
  plot.replaceChildren(message);
  plot.dataset.state = "message";
}

// Words first: drawings hold up a page that was not painted yet. A hidden tab paints nothing and is not waited for.
const shown = () => new Promise((done) => {
  requestAnimationFrame(() => setTimeout(done));
  setTimeout(done, 100);
});

async function loadPlotly() {
  const packed = atob(document.getElementById("plotly-gzip").textContent);
  const bytes = Uint8Array.from(packed, (letter) => letter.charCodeAt(0));
  const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(unpacked).text();
  document.head.append(script);
}

async function draw(plot, place) {
  const { data, layout, narrow, postures, links, pages, rows } = drawing(plot);
  if (plot.dataset.kind === "scene") return drawScene(plot, data, layout, narrow, postures);
  await Plotly.newPlot(plot, data, layout, { responsive: true, displayModeBar: false });
  if (plot.clientWidth < NARROW) {
    await changed(plot, narrow ?? {});
    await wrapTitle(plot, layout);
    await fitted(plot);
  }
  if (rows?.traces) followRows(plot, rows, data);
  if (links?.length) plot.on("plotly_click", ({ points: [hit] }) => leadTo(links[hit.y]));
  if (pages?.length) plot.on("plotly_click", ({ points: [hit] }) => pages[hit.pointIndex] && location.assign(pages[hit.pointIndex]));
  drawn[place] = true;
  plot.dataset.state = "drawn";
}

function drawScene(plot, data, layout, narrow, postures) {
  if (narrow?.height && plot.clientWidth < NARROW) plot.style.height = `${narrow.height}px`;
  plot.scene = new Scene(plot, data, layout);
  if (postures?.rows) followPostures(plot, postures);
  plot.dataset.state = "drawn";
}

async function changed(plot, changes) {
  if (changes.height) plot.style.height = `${changes.height}px`;
  if (Object.keys(changes).length) await Plotly.relayout(plot, changes);
}

// The title below an axis that is shorter stands on two lines, or, where these are too few, below its names as well;
// once more where the axis became shorter meanwhile, as names beside it took their room.
async function wrapTitle(plot, layout) {
  const { height, margin } = plot._fullLayout;
  for (let across = Infinity, rounds = 0; rounds < 3 && plot._fullLayout.xaxis?._length < across - 1; rounds++) {
    across = plot._fullLayout.xaxis._length;
    await changed(plot, wrappedTitle(plot, layout, height, margin.b));
  }
}

function wrappedTitle(plot, { xaxis, annotations }, height, bottom) {
  const text = xaxis?.title?.text ?? "";
  const { _length: across, _offset: before, title } = plot._fullLayout.xaxis;
  const own = linesOf(text, across, title.font);
  if (own.length < 2) return {};
  const lines = own.length > 2 ? linesOf(text, before + across, title.font) : own;
  const added = (lines.length - 1) * LINE;
  const changes = { "margin.b": bottom + added, height: height + added };
  if (lines === own) return { ...changes, "xaxis.title.text": lines.join("<br>") };
  const below = { text: lines.join("<br>"), font: title.font, align: "right", showarrow: false, xref: "paper", x: 1,
    xanchor: "right", yref: "paper", y: 0, yanchor: "top", yshift: -1.5 * LINE };
  return { ...changes, "xaxis.title.text": "", annotations: [...(annotations ?? []), below] };
}

function linesOf(text, width, { size, family }) {
  const pen = document.createElement("canvas").getContext("2d");
  pen.font = `${size}px ${family}`;
  const lines = [""];
  for (const word of text.split(" ")) {
    if (lines.at(-1) && pen.measureText(`${lines.at(-1)} ${word}`).width > width) lines.push("");
    lines.push(`${lines.pop()} ${word}`.trim());
  }
  return lines;
}

// Names in a drawing that run over its edge are written as small as they must be.
async function fitted(plot) {
  const edge = plot.getBoundingClientRect().right - 4;
  const changes = {};
  for (const each of plot.querySelectorAll(".annotation")) {
    const { left, right, width } = each.getBoundingClientRect();
    const size = parseFloat(getComputedStyle(each.querySelector("text")).fontSize);
    if (right > edge) changes[`annotations[${each.dataset.index}].font.size`] = Math.max(8, (size * (edge - left)) / width);
  }
  if (Object.keys(changes).length) await Plotly.relayout(plot, changes);
}

// A link to a card that is folded opens it.
function openTarget() {
  const details = document.getElementById(location.hash.slice(1))?.querySelector(":scope > details");
  if (details) details.open = true;
}

// Opens a part of the page and goes there.
function leadTo(id) {
  const part = document.getElementById(id);
  if (!part) return;
  for (const details of part.querySelectorAll("details")) details.open = true;
  part.scrollIntoView({ behavior: "smooth" });
}

// Single precision, or whole numbers, in base64, as page.py writes arrays.
function unpacked({ bdata, dtype }) {
  const { buffer } = Uint8Array.from(atob(bdata), (letter) => letter.charCodeAt(0));
  return dtype === "i4" ? new Int32Array(buffer) : new Float32Array(buffer);
}

// A number as the texts of the page write it.
function numeral(value, options = {}) {
  const how = { maximumSignificantDigits: 12, useGrouping: false, ...options };
  return new Intl.NumberFormat(document.documentElement.lang, how).format(value).replace("-", "\u2212");
}

// A row is chosen by the slider, a click on a point, an arrow, a line of the outliers or a picture; all then show it.
const chooses = [];
function choose(row) {
  for (const line of document.querySelectorAll("[data-row]")) line.classList.toggle("chosen", line.dataset.row === row);
  for (const show of chooses) show(row);
}

// A panel with a point a row of the training data.
function followRows(plot, { traces, mark }, data) {
  const series = traces.map((t) => ({ x: unpacked(data[t].x), y: unpacked(data[t].y), rows: unpacked(data[t].customdata) }));
  plot.on("plotly_click", ({ points: [hit] }) => traces.includes(hit.curveNumber) && choose(`0:${hit.customdata}`));
  let later;
  chooses.push((row) => {
    const [set, number] = row.split(":").map(Number);
    const at = series.map(({ rows }) => (set === 0 ? rows.indexOf(number) : -1));
    const [x, y] = ["x", "y"].map((axis) => at.flatMap((k, s) => (k < 0 ? [] : [series[s][axis][k]])));
    clearTimeout(later); // a slider that moves asks for many
    later = setTimeout(() => Plotly.restyle(plot, { x: [x], y: [y] }, [mark]), 60);
  });
}

// The arm and the arrows: the chosen row's posture, and only the poses that the filter leaves. A part goes `through`
// points of the posture, lifted at -1; arrow k is of posture of[k], or of its own.
function followPostures(plot, { points, width, parts, of, labels, rows, shown, filters }) {
  const axes = ["x", "y", "z"];
  const at = Object.fromEntries(axes.map((axis) => [axis, unpacked(points[axis])]));
  const posture = of ? [...unpacked(of)] : [...rows.keys()];
  const [slider, said] = ["input", "output"].map((name) => plot.closest(".figure").querySelector(`.posture ${name}`));
  const { scene } = plot;
  const traces = parts.map(({ trace }) => trace);
  let kept = rows.map(() => true);
  const show = (k) => {
    const moved = {};
    for (const axis of axes) {
      const here = at[axis].subarray(k * width, (k + 1) * width);
      moved[axis] = parts.map(({ through }) => through.map((place) => (place < 0 ? NaN : here[place])));
    }
    scene.set(moved, traces);
    slider.value = k;
    said.textContent = labels[k];
  };
  const near = (k) => {
    for (let d = 0; d < rows.length; d++) for (const at of [k + d, k - d]) if (kept[at]) return at;
    return k;
  };
  chooses.push((row) => rows.includes(row) && show(rows.indexOf(row)));
  slider.addEventListener("input", () => choose(rows[near(Number(slider.value))]));
  scene.picked.push((trace, k) => {
    if (k < posture.length && !traces.includes(trace) && scene.data[trace].mode === "markers") choose(rows[posture[k]]);
  });
  for (const line of document.querySelectorAll("[data-row]")) {
    if (!rows.includes(line.dataset.row)) continue;
    line.addEventListener("click", () => {
      choose(line.dataset.row);
      plot.scrollIntoView({ behavior: "smooth", block: "center" });
    });
  }
  const isOfArrows = ({ x }, t) => posture.length && x.length % posture.length === 0 && !traces.includes(t);
  const arrows = scene.data.flatMap((trace, t) => (isOfArrows(trace, t) ? [[t, trace.x]] : []));
  followFilter(plot.closest(".figure").querySelector(".filter"), filters ?? [], (chosen) => {
    kept = chosen;
    const left = ([, x]) =>
      x.map((value, k) => (kept[posture[Math.floor((k * posture.length) / x.length)]] ? value : NaN));
    scene.set({ x: arrows.map(left) }, arrows.map(([t]) => t));
  });
  choose(rows[shown]);
}

// A variable and its range; `tell` gets which poses are in it.
function followFilter(part, filters, tell) {
  if (!part) return;
  const [choice, said] = [part.querySelector("select"), part.querySelector("output")];
  const ends = [...part.querySelectorAll("input")];
  const short = (value) => numeral(value, { maximumSignificantDigits: 4 });
  const values = filters.map((each) => unpacked(each.values));
  const filter = () => {
    const own = values[choice.value];
    if (!own) return;
    const [low, high] = ends.map((end) => Number(end.value)).sort((a, b) => a - b);
    const slack = 1e-6 * (Math.abs(low) + Math.abs(high)); // a range input rounds
    const kept = [...own].map((value) => value >= low - slack && value <= high + slack);
    const { texts } = filters[choice.value];
    const [from, to] = texts.length ? [texts[Math.ceil(low)], texts[Math.floor(high)]] : [short(low), short(high)];
    const words = { low: from, high: to, some: kept.filter(Boolean).length, all: kept.length };
    said.textContent = said.dataset.text.replace(/\{(\w+)\}/g, (_all, name) => words[name]);
    tell(kept);
  };
  choice.addEventListener("change", () => {
    const own = choice.value === "" ? null : [...values[choice.value]].filter(Number.isFinite);
    for (const [k, end] of ends.entries()) {
      end.parentElement.hidden = !own;
      if (!own) continue;
      [end.min, end.max] = [Math.min(...own), Math.max(...own)];
      end.step = filters[choice.value].texts.length ? 1 : "any";
      end.value = k ? end.max : end.min;
    }
    said.textContent = "";
    if (own) filter();
    else tell([...values[0]].map(() => true));
  });
  for (const end of ends) end.addEventListener("input", filter);
}

function switchTraces(button) {
  const figure = button.closest(".figure");
  const plot = figure.querySelector(".plot");
  const buttons = [...figure.querySelectorAll(".controls button")];
  for (const other of buttons) {
    const traces = other.dataset.traces.split(",").map(Number);
    other.setAttribute("aria-pressed", String(other === button));
    if (plot.scene) plot.scene.set({ visible: other === button }, traces);
    else Plotly.restyle(plot, { visible: other === button }, traces);
  }
}

function sortBy(header) {
  const table = header.closest("table");
  const column = header.cellIndex;
  const sign = header.getAttribute("aria-sort") === "ascending" ? -1 : 1;
  for (const other of table.querySelectorAll("thead th")) other.removeAttribute("aria-sort");
  header.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
  const isNumeric = header.classList.contains("number");
  const compare = (a, b) => {
    const [x, y] = [a.cells[column], b.cells[column]];
    if (!isNumeric) return sign * x.textContent.localeCompare(y.textContent, "en", { numeric: true });
    if (!(x.dataset.sort && y.dataset.sort)) return Boolean(y.dataset.sort) - Boolean(x.dataset.sort);
    return sign * (Number(x.dataset.sort) - Number(y.dataset.sort));
  };
  for (const body of table.querySelectorAll("tbody.rows")) body.append(...[...body.rows].sort(compare));
}

function fold(button) {
  const isOpen = button.getAttribute("aria-expanded") === "true";
  button.setAttribute("aria-expanded", String(!isOpen));
  document.getElementById(button.getAttribute("aria-controls")).hidden = isOpen;
}

const flat = () => plots.filter((_plot, place) => drawn[place]);
const scenes = () => plots.filter((plot) => plot.scene);

function stills(size) {
  for (const plot of scenes()) {
    const { data, layout } = drawing(plot, size !== null);
    plot.scene.still(size, data, layout);
  }
}

async function toPaper() {
  for (const details of document.querySelectorAll("details")) {
    details.dataset.wasOpen = details.open;
    details.open = true;
  }
  stills(PAPER_SCENE);
  if (prefersDark.matches) await redraw(flat(), true);
  for (const plot of flat()) {
    const columns = Number(/columns-(\d)/.exec(plot.closest(".figure").className)[1]);
    const across = PAPER_WIDTH - (plot.closest(".verdict") ? PAPER_CARD : 0);
    const width = Math.floor(((across + PAPER_GAP) * columns) / 6 - PAPER_GAP);
    const height = Number(plot.dataset.paper) || Math.min(plot.offsetHeight, Math.round(PAPER_ASPECT[columns] * width));
    toSize(plot, width, height);
    const missing = overhang(plot);
    if (missing > 0) toSize(plot, width, height + 2 * missing);
  }
}

function toSize(plot, width, height) {
  plot.style.setProperty("--paper-height", `${height}px`);
  Plotly.relayout(plot, { width, height, "font.size": 10, "xaxis.title.font.size": 10, "yaxis.title.font.size": 10 });
}

// By how much the title of a vertical axis is longer than its drawing is high, at the end where it is cut more.
function overhang(plot) {
  const frame = plot.querySelector(".main-svg").getBoundingClientRect();
  const titles = [...plot.querySelectorAll(".ytitle, .y2title")].map((each) => each.getBoundingClientRect());
  return Math.ceil(Math.max(0, ...titles.map((each) => Math.max(frame.top - each.top, each.bottom - frame.bottom))));
}

async function toScreen() {
  for (const details of document.querySelectorAll("details")) details.open = details.dataset.wasOpen === "true";
  stills(null);
  if (prefersDark.matches) await redraw(flat());
  for (const plot of flat()) {
    Plotly.relayout(plot, { autosize: true, width: null, height: null, "font.size": 12,
      "xaxis.title.font.size": 12, "yaxis.title.font.size": 12 });
  }
}

// What is wider than a phone stands cell below cell there, as tables do that Table.is_wordy knows to be wide.
function stackWideTables() {
  if (innerWidth > PHONE) return;
  for (const table of document.querySelectorAll("table:not(.wordy)")) {
    if (table.offsetWidth > table.parentElement.clientWidth) table.classList.add("wordy");
  }
}

/** Keeps a number and its unit, and a sign and its number, on one line. */
function keepUnits() {
  const walker = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode;
    if (/\d/.test(text.data) && !text.parentElement.closest("script, code, pre, .plot"))
      text.data = text.data.replace(UNITS, "$1\u00a0").replace(/([=<>±]) (?=[\d−])/g, "$1\u00a0");
  }
}

async function main() {
  keepUnits();
  stackWideTables();
  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (button?.dataset.traces) switchTraces(button);
    else if (button?.classList.contains("sort")) sortBy(button.closest("th"));
    else if (button?.classList.contains("fold")) fold(button);
  });
  for (const details of document.querySelectorAll("details")) {
    details.addEventListener("toggle", () => {
      if (details.open) details.querySelectorAll(".plot").forEach((plot) => plot.dataset.state === "drawn" && Plotly.Plots.resize(plot));
    });
  }
  addEventListener("hashchange", openTarget);
  openTarget();
  await shown();
  const own = plots.filter((plot) => plot.dataset.kind === "scene");
  for (const plot of own) await draw(plot);
  try {
    await loadPlotly();
  } catch {
    plots.forEach((plot) => own.includes(plot) || say(plot, document.body.dataset.oldBrowser));
    return;
  }
  colourKeys();
  for (const [place, plot] of plots.entries()) if (!own.includes(plot)) await draw(plot, place);
  prefersDark.addEventListener("change", () => redraw([...scenes(), ...flat()]));
  addEventListener("beforeprint", toPaper);
  addEventListener("afterprint", toScreen);
  document.body.dataset.state = "ready";
}

main();
