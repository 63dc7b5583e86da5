// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
"use strict";

// A view in three dimensions that can be turned, of the lines and points of Plotly's scatter3d. It is drawn on a plain
// canvas, far things first: so it turns smoothly without a graphics card, needs no WebGL, and is on paper too.
const AWAY = 5; // of the eye from the middle of the box [half its diagonal]
const STEEPEST = 1.5; // the eye never passes over the top [rad]
const TURN = 0.009, STEP = 0.12; // of a pixel that the mouse is dragged, of an arrow key [rad]
const [HIT, STILL] = [12, 4]; // how near a point is meant; what is a click and no drag [pixels]
const SHADES = 48;
const LINE_HIGH = 14; // of a name [pixels]
const BEFORE = 0.8; // thick lines, the arm, and what is on them stand before the arrows: as if that much nearer
const SIDES = [0, 1, 2];
const [PHONE_SCENE, TALL] = [420, 420]; // narrower: the bar of colours lies; lower: all is drawn smaller [pixels]

class Scene {
  constructor(plot, data, layout) {
    this.plot = plot;
    this.canvas = document.createElement("canvas");
    this.tip = Object.assign(document.createElement("div"), { className: "tip", hidden: true });
    plot.replaceChildren(this.canvas, this.tip);
    plot.tabIndex = 0;
    this.picked = []; // what is told of a click: (trace, point)
    this.read(data, layout);
    this.reset();
    this.listen();
    new ResizeObserver(() => this.later()).observe(plot);
  }

  // Data and layout, with the colours of the screen or of paper.
  read(data, layout) {
    const axes = SIDES.map((k) => layout.scene[`${"xyz"[k]}axis`]);
    this.style = { ink: layout.font.color, font: layout.font.family, ground: layout.paper_bgcolor,
      muted: axes[0].color, grid: axes[0].gridcolor, line: axes[0].linecolor };
    this.titles = axes.map(({ title }) => title.text);
    this.box = axes.map(({ range }) => range);
    this.middle = this.box.map(([low, high]) => (low + high) / 2);
    this.radius = Math.hypot(...this.box.map(([low, high]) => high - low)) / 2;
    this.ticks = this.box.map(niceTicks);
    this.eye = layout.scene.camera.eye;
    this.data = data.map((given, t) => {
      const trace = { ...given, visible: this.data?.[t].visible ?? given.visible ?? true };
      for (const axis of "xyz") trace[axis] = this.data?.[t][axis] ?? plain(given[axis]);
      trace.customdata = plain(given.customdata);
      trace.shades = shades(given.marker ?? given.line);
      return trace;
    });
    this.later();
  }

  // Parts of traces in place of others, as Plotly.restyle has them.
  set(parts, traces) {
    traces.forEach((t, k) => {
      for (const [key, values] of Object.entries(parts)) this.data[t][key] = Array.isArray(values) ? values[k] : values;
    });
    this.later();
  }

  reset() {
    const { x, y, z } = this.eye;
    [this.azimuth, this.height] = [Math.atan2(y, x), Math.atan2(z, Math.hypot(x, y))];
    this.zoom = 1;
    this.later();
  }

  // On paper as large as it says, and sharp, at once: no frame is drawn while a page is printed. Null: on the screen.
  still(size, data, layout) {
    this.size = size && [...size, 3];
    this.read(data, layout);
    this.paint();
  }

  later() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = null;
      this.paint();
    });
  }

  listen() {
    let from = null;
    const at = ({ clientX, clientY }) => {
      const frame = this.canvas.getBoundingClientRect();
      return [clientX - frame.left, clientY - frame.top];
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      from = { last: [event.clientX, event.clientY], moved: 0 };
      this.canvas.setPointerCapture(event.pointerId);
      this.tip.hidden = true;
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!from) return this.tell(at(event));
      const [dx, dy] = [event.clientX - from.last[0], event.clientY - from.last[1]];
      from = { last: [event.clientX, event.clientY], moved: from.moved + Math.abs(dx) + Math.abs(dy) };
      this.turn(-TURN * dx, TURN * dy);
    });
    this.canvas.addEventListener("pointerup", (event) => {
      if (from && from.moved < STILL) {
        const hit = this.nearest(at(event));
        if (hit) for (const tell of this.picked) tell(hit.trace, hit.point);
      }
      from = null;
    });
    this.canvas.addEventListener("pointercancel", () => { from = null; });
    this.canvas.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    this.canvas.addEventListener("dblclick", () => this.reset());
    const keys = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
    this.plot.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (keys[event.key]) this.turn(...keys[event.key]);
      else if (event.key === "+" || event.key === "-") this.closer(event.key === "+" ? 1.15 : 1 / 1.15);
      else if (event.key === "Home") this.reset();
      else return;
      event.preventDefault();
    });
  }

  turn(azimuth, height) {
    this.azimuth += azimuth;
    this.height = Math.max(-STEEPEST, Math.min(STEEPEST, this.height + height));
    this.later();
  }

  closer(times) {
    this.zoom = Math.max(0.5, Math.min(8, this.zoom * times));
    this.later();
  }

  // The point under the mouse that has something to say: of several the nearest to the eye.
  nearest([x, y]) {
    let best = null;
    this.data.forEach(({ mode, visible, hovertemplate }, trace) => {
      if (!visible || !hovertemplate || !mode.startsWith("markers")) return;
      const { at } = this.seen[trace];
      for (let point = 0; 3 * point < at.length; point++) {
        if (Math.hypot(at[3 * point] - x, at[3 * point + 1] - y) > HIT) continue;
        const nearer = Math.hypot(at[3 * point] - x, at[3 * point + 1] - y) + at[3 * point + 2] / this.radius;
        if (!best || nearer < best.nearer) best = { trace, point, nearer, at: at.slice(3 * point, 3 * point + 2) };
      }
    });
    return best;
  }

  tell(place) {
    const hit = this.seen && this.nearest(place);
    this.tip.hidden = !hit;
    if (!hit) return;
    const { text, customdata, hovertemplate } = this.data[hit.trace];
    const number = (_all, digits) => numeral(customdata[hit.point], { minimumFractionDigits: digits,
      maximumFractionDigits: digits, maximumSignificantDigits: undefined });
    this.tip.textContent = hovertemplate.replace("<extra></extra>", "").replace("%{text}", () => text[hit.point])
      .replace(/%\{customdata:\.(\d)f\}/, number);
    const left = Math.min(hit.at[0] + 12, this.plot.clientWidth - this.tip.offsetWidth - 4);
    Object.assign(this.tip.style, { left: `${left}px`, top: `${Math.max(0, hit.at[1] - 30)}px` });
  }

  // Where points are in the picture, and how far away: x, y, depth of each.
  project(xs, ys, zs) {
    const [ca, sa] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [ch, sh] = [Math.cos(this.height), Math.sin(this.height)];
    const [mx, my, mz] = this.middle;
    const away = AWAY * this.radius;
    const out = new Float64Array(3 * xs.length);
    for (let k = 0; k < xs.length; k++) {
      const [x, y, z] = [xs[k] - mx, ys[k] - my, zs[k] - mz];
      const depth = away - (x * ca + y * sa) * ch - z * sh;
      const scale = (this.scale * away) / depth;
      out[3 * k] = this.centre[0] + (y * ca - x * sa) * scale;
      out[3 * k + 1] = this.centre[1] - (z * ch - (x * ca + y * sa) * sh) * scale;
      out[3 * k + 2] = depth;
    }
    return out;
  }

  // As large as the box may be, however it is turned about the upright axis, so that it does not breathe while it is.
  fit(width, height, bar) {
    const corners = SIDES.map((k) => Array.from({ length: 8 }, (_none, c) => this.box[k][(c >> k) & 1]));
    const azimuth = this.azimuth;
    [this.scale, this.centre] = [1, [0, 0]];
    let [wide, high, low] = [0, 0, 0];
    for (let k = 0; k < 12; k++) {
      this.azimuth = azimuth + (k * Math.PI) / 6;
      const at = this.project(...corners);
      for (let c = 0; c < 8; c++) {
        wide = Math.max(wide, Math.abs(at[3 * c]));
        [low, high] = [Math.min(low, at[3 * c + 1]), Math.max(high, at[3 * c + 1])];
      }
    }
    this.azimuth = azimuth;
    const [side, below] = [46, 40]; // for what is written around the box
    const above = 24 + bar.above;
    const room = [width - bar.beside - 2 * side, height - above - below];
    this.scale = Math.min(room[0] / (2 * wide), room[1] / (high - low)) * this.zoom;
    this.centre = [(width - bar.beside) / 2, above + room[1] / 2 - (this.scale * (high + low)) / 2];
  }

  paint() {
    const { canvas, plot, style } = this;
    const [width, height, sharp] = this.size ?? [plot.clientWidth, plot.clientHeight, Math.min(2, devicePixelRatio)];
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * sharp) || canvas.height !== Math.round(height * sharp)) {
      [canvas.width, canvas.height] = [Math.round(width * sharp), Math.round(height * sharp)];
    }
    const pen = this.pen ??= canvas.getContext("2d", { alpha: false });
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.fillStyle = style.ground;
    pen.fillRect(0, 0, width, height);
    [pen.lineCap, pen.lineJoin] = ["round", "round"];
    const scaled = this.data.find(({ visible, marker }) => visible && marker?.showscale);
    const isNarrow = width < PHONE_SCENE;
    this.fit(width, height, { beside: scaled && !isNarrow ? 70 : 0, above: scaled && isNarrow ? 34 : 0 });
    this.room(pen);
    this.seen = this.data.map((trace) => ({ at: trace.visible ? this.project(trace.x, trace.y, trace.z) : [] }));
    const things = this.data.flatMap((trace, t) => (trace.visible ? parts(trace, this.seen[t].at, Math.min(1, height / TALL)) : []));
    things.sort((a, b) => b.depth - a.depth);
    style.labels = [];
    for (const thing of things) thing.draw(pen, style);
    write(pen, style);
    const bar = isNarrow ? [10, 8, width - 20, 10] : [width - 62, 0.2 * height, 12, 0.6 * height];
    if (scaled) this.bar(pen, scaled.marker, bar);
  }

  // The three far faces of the box with their lines, and along its near edges the numbers.
  room(pen) {
    const toEye = [Math.cos(this.azimuth), Math.sin(this.azimuth), this.height]; // only the signs matter
    const far = SIDES.map((k) => this.box[k][toEye[k] > 0 ? 0 : 1]);
    const near = SIDES.map((k) => this.box[k][toEye[k] > 0 ? 1 : 0]);
    const one = (point) => this.project([point[0]], [point[1]], [point[2]]);
    const line = (a, b) => {
      const [p, q] = [one(a), one(b)];
      pen.moveTo(p[0], p[1]);
      pen.lineTo(q[0], q[1]);
    };
    const put = (k, value, others) => Object.assign([...others], { [k]: value });
    [pen.lineWidth, pen.strokeStyle] = [1, this.style.grid];
    pen.beginPath();
    for (const k of SIDES) for (const tick of [...this.ticks[k], ...this.box[k]]) for (const other of SIDES) {
      if (other !== k) line(put(k, tick, far), put(other, near[other], put(k, tick, far)));
    }
    pen.stroke();
    pen.strokeStyle = this.style.line;
    pen.beginPath();
    const upright = [put(0, near[0], put(1, far[1], far)), put(1, near[1], put(0, far[0], far))];
    const edges = [put(1, near[1], far), put(0, near[0], far), upright.sort((a, b) => one(a)[0] - one(b)[0])[0]];
    for (const k of SIDES) line(put(k, this.box[k][0], edges[k]), put(k, this.box[k][1], edges[k]));
    pen.stroke();
    [pen.fillStyle, pen.textBaseline] = [this.style.muted, "middle"];
    const middle = one(this.middle);
    for (const k of SIDES) {
      const [a, b] = [one(put(k, this.box[k][0], edges[k])), one(put(k, this.box[k][1], edges[k]))];
      const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
      let out = [(b[1] - a[1]) / length, (a[0] - b[0]) / length]; // across the edge, away from the box
      const outwards = [0, 1].reduce((sum, c) => sum + out[c] * ((a[c] + b[c]) / 2 - middle[c]), 0);
      if (outwards < 0) out = out.map((v) => -v);
      if (length < 30) continue; // seen end on
      const beside = out[0] < -0.35 ? "right" : out[0] > 0.35 ? "left" : "center";
      const reach = 24 + 16 * Math.abs(out[0]);
      const top = a[1] < b[1] ? a : b;
      const at = k === 2 ? [top[0], top[1] - 14] // above the upright edge, where it needs no width
        : [(a[0] + b[0]) / 2 + reach * out[0], (a[1] + b[1]) / 2 + (reach + 4) * out[1]];
      [pen.font, pen.textAlign] = [`12px ${this.style.font}`, k === 2 ? "center" : beside];
      pen.fillText(this.titles[k], ...at);
      const title = boxOf(pen, this.titles[k], at);
      [pen.font, pen.textAlign] = [`11px ${this.style.font}`, beside];
      const step = length / Math.max(1, this.ticks[k].length);
      const some = this.ticks[k].filter((_tick, place) => step > 26 || place % 2 === 0);
      for (const tick of some) {
        const edge = one(put(k, tick, edges[k]));
        const place = [edge[0] + 9 * out[0], edge[1] + 11 * out[1]];
        const [text, other] = [numeral(tick), boxOf(pen, numeral(tick), place)];
        if (SIDES.slice(0, 2).some((c) => title[c] > other[c + 2] || other[c] > title[c + 2])) pen.fillText(text, ...place);
      }
    }
  }

  // What the colours mean, on a bar that lies where it is wide.
  bar(pen, { colorscale, cmin, cmax, colorbar }, [x, y, wide, high]) {
    const lies = wide > high;
    const fill = pen.createLinearGradient(x, y + (lies ? 0 : high), x + (lies ? wide : 0), y);
    for (const [at, colour] of colorscale) fill.addColorStop(at, colour);
    pen.fillStyle = fill;
    pen.fillRect(x, y, wide, high);
    [pen.fillStyle, pen.textBaseline, pen.font] = [this.style.ink, "middle", `11px ${this.style.font}`];
    for (const tick of niceTicks([cmin, cmax])) {
      const share = (tick - cmin) / (cmax - cmin);
      pen.textAlign = !lies || share < 0.02 ? "left" : "center";
      const place = lies ? [x + share * wide, y + high + 9] : [x + wide + 4, y + high * (1 - share)];
      pen.fillText(numeral(tick), ...place);
    }
    pen.textAlign = "right";
    pen.fillText(colorbar.title.text, ...(lies ? [x + wide, y + high + 24] : [x + wide + 42, y - 14]));
  }
}

// Arrays that page.py packed, as they are; lists stay.
function plain(values) {
  return values?.bdata ? unpacked(values) : values;
}

// Four to seven round numbers within a range.
function niceTicks([low, high]) {
  const wanted = (high - low) / 5;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const step = power * [1, 2, 5, 10].find((each) => each * power >= wanted);
  const [first, last] = [Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)];
  return Array.from({ length: last - first + 1 }, (_none, k) => (first + k) * step);
}

// The colour of each point: one for all, or along a scale.
function shades({ color, colorscale, cmin, cmax }) {
  if (typeof color === "string") return () => color;
  const values = plain(color);
  const scale = Array.from({ length: SHADES }, (_none, k) => mixed(colorscale, k / (SHADES - 1)));
  const step = (cmax - cmin) / (SHADES - 1);
  return (k) => scale[Math.max(0, Math.min(SHADES - 1, Math.round((values[k] - cmin) / step)))];
}

function mixed(scale, at) {
  const k = Math.max(1, scale.findIndex(([place]) => place >= at));
  const [[low, a], [high, b]] = [scale[k - 1], scale[k]];
  const share = (at - low) / (high - low);
  const part = (colour, c) => parseInt(colour.slice(1 + 2 * c, 3 + 2 * c), 16);
  return `rgb(${SIDES.map((c) => Math.round(part(a, c) + share * (part(b, c) - part(a, c))))})`;
}

// What of a trace is drawn, each part with its depth: lines between gaps, of thick ones each piece, and points.
function parts({ mode, marker, line, text, shades: shade, textfont }, at, size) {
  const found = [];
  const count = at.length / 3;
  if (mode === "lines") {
    const thick = line.width > 5;
    for (let k = 0; k + 1 < count; k++) {
      if (!(at[3 * k] === at[3 * k] && at[3 * k + 3] === at[3 * k + 3])) continue;
      const first = k;
      while (!thick && k + 2 < count && at[3 * k + 6] === at[3 * k + 6]) k++;
      const last = k + 1;
      found.push({ depth: ((thick ? BEFORE : 1) * (at[3 * first + 2] + at[3 * last + 2])) / 2, draw(pen) {
        [pen.strokeStyle, pen.lineWidth] = [shade(first), size * (thick ? 0.7 : 0.5) * line.width];
        pen.beginPath();
        pen.moveTo(at[3 * first], at[3 * first + 1]);
        for (let p = first + 1; p <= last; p++) pen.lineTo(at[3 * p], at[3 * p + 1]);
        pen.stroke();
      } });
    }
    return found;
  }
  const sizes = plain(marker.size);
  for (let k = 0; k < count; k++) {
    if (at[3 * k] !== at[3 * k]) continue;
    const radius = (size * (sizes[k] ?? marker.size)) / 2 + 0.5;
    // A point lies on the end of a line, a joint on its links, and an open ring on whatever it rings.
    const nearer = marker.symbol === "circle-open" ? BEFORE ** 2 : marker.line ? 0.99 * BEFORE : 0.999;
    found.push({ depth: nearer * at[3 * k + 2], draw(pen, style) {
      const [x, y] = [at[3 * k], at[3 * k + 1]];
      pen.beginPath();
      if (marker.symbol === "diamond") {
        for (const [dx, dy] of [[0, -1.3], [1.3, 0], [0, 1.3], [-1.3, 0]]) pen.lineTo(x + radius * dx, y + radius * dy);
        pen.closePath();
      } else pen.arc(x, y, radius, 0, 7);
      if (marker.symbol === "circle-open") {
        [pen.strokeStyle, pen.lineWidth] = [shade(k), marker.line.width];
        pen.stroke();
        return;
      }
      pen.fillStyle = shade(k);
      pen.fill();
      if (marker.line) {
        [pen.strokeStyle, pen.lineWidth] = [marker.line.color, marker.line.width];
        pen.stroke();
      }
      if (mode.endsWith("text")) {
        style.labels.push({ text: text[k], x, y: y + radius + 6, colour: textfont.color });
      }
    } });
  }
  return found;
}

// Names stand before all else, below their points, and each below those that it would cover.
// Left, top, right and bottom of a text that is written at x and y.
function boxOf(pen, text, [x, y]) {
  const wide = pen.measureText(text).width;
  const left = x - { left: 0, center: wide / 2, right: wide }[pen.textAlign];
  return [left - 2, y - 7, left + wide + 2, y + 7];
}

function write(pen, { labels, font, ground }) {
  pen.save();
  [pen.font, pen.textAlign, pen.textBaseline] = [`12px ${font}`, "center", "top"];
  [pen.strokeStyle, pen.lineWidth, pen.lineJoin] = [ground, 3, "round"];
  const taken = [];
  for (const { text, x, y, colour } of labels.sort((a, b) => a.y - b.y)) {
    const half = pen.measureText(text).width / 2 + 3;
    let top = y;
    for (const [from, to, above] of taken) {
      if (x - half < to && from < x + half && Math.abs(top - above) < LINE_HIGH) top = above + LINE_HIGH;
    }
    taken.push([x - half, x + half, top]);
    pen.strokeText(text, x, top);
    pen.fillStyle = colour;
    pen.fillText(text, x, top);
  }
  pen.restore();
}
