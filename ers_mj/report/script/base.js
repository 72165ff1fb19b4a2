// Charts from the page's JSON block, drawn as SVG as wide as there is room: scales, axes, lines, what all charts do.
// base -> timeline -> traces, recordings; base -> figures; all -> page; charts.py joins them into one script. Nothing is fetched or evaluated.
const DATA = JSON.parse(document.getElementById("chart-data").textContent);
const WIDE = 620; // [px] from which panels stand side by side
const PRINTED = 700; // [px] width of a chart on paper
const MOST_MISSING = 65535; // the packed number that stands for none
const state = { view: null, off: "none", width: 0 }; // [s, s] shown; effect switched off; width forced (0: the page's)
const charts = [];

// -- small parts ---------------------------------------------------------------------------------------------------

const SPACE = (template => {
  template.innerHTML = "<svg></svg>";
  return template.content.firstChild.namespaceURI;
})(document.createElement("template"));

function make(tag, attributes, parent, text) {
  const node = document.createElementNS(SPACE, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  if (parent) parent.appendChild(node);
  return node;
}

function html(tag, attributes, parent, text) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  if (parent) parent.appendChild(node);
  return node;
}

// A packed series {o: lowest, s: step, b: 16-bit numbers as base64} as numbers, NaN where there is none.
function unpacked(series) {
  const bytes = Uint8Array.from(atob(series.b), c => c.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float64Array.from({ length: bytes.length / 2 }, (_, k) => {
    const n = view.getUint16(2 * k, true);
    return n === MOST_MISSING ? NaN : series.o + series.s * n;
  });
}

function told(x, digits = 4) {
  if (!Number.isFinite(x)) return "—";
  const size = Math.abs(x);
  const plain = x !== 0 && (size < 1e-3 || size >= 1e6) ? x.toExponential(digits - 1) : String(+x.toPrecision(digits));
  return plain.replace(/-/g, "−");
}

// The first place at which rising numbers are not below x.
function place(rising, x) {
  let low = 0, high = rising.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rising[middle] < x) low = middle + 1; else high = middle;
  }
  return low;
}

function nearest(rising, x) {
  const k = Math.min(Math.max(place(rising, x), 1), rising.length - 1);
  return x - rising[k - 1] < rising[k] - x ? k - 1 : k;
}

function extent(lists, begin, end) {
  let low = Infinity, high = -Infinity;
  for (const list of lists) for (let k = begin; k < end; k++) {
    if (list[k] < low) low = list[k];
    if (list[k] > high) high = list[k];
  }
  return low <= high ? [low, high] : [-1, 1];
}

function padded([low, high], share = 0.06) {
  const room = (high - low) * share || Math.abs(high) * share || 1;
  return [low - room, high + room];
}

// -- scales, axes, lines -------------------------------------------------------------------------------------------

function linear([low, high], from, to) {
  const scale = x => from + (x - low) / (high - low) * (to - from);
  scale.back = pixel => low + (pixel - from) / (to - from) * (high - low);
  scale.ticks = most => {
    const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find(n => n * power >= rough * 0.75);
    const first = Math.ceil(low / step - 1e-9), out = [];
    for (let k = first; k * step <= high + 1e-9 * step; k++) out.push(+(k * step).toPrecision(12));
    return out;
  };
  return scale;
}

function logarithmic([low, high], from, to) {
  const inner = linear([Math.log10(low), Math.log10(high)], from, to);
  const scale = x => inner(Math.log10(x));
  scale.back = pixel => 10 ** inner.back(pixel);
  scale.ticks = most => {
    const decades = Math.log10(high / low), out = [];
    const parts = decades * 2 <= most ? [1, 2, 5] : [1];
    const every = Math.max(1, Math.ceil(decades / most));
    for (let d = Math.floor(Math.log10(low)); d <= Math.log10(high); d += every) {
      for (const n of parts) if (n * 10 ** d >= low && n * 10 ** d <= high) out.push(n * 10 ** d);
    }
    return out;
  };
  return scale;
}

// Grid, numbers and names of one panel; box is {x, y, w, h} in pixels. The name of the vertical axis lies above it.
function axes(svg, box, x, y, names) {
  for (const v of y.ticks(Math.max(3, Math.floor(box.h / 36)))) {
    make("line", { class: "grid", x1: box.x, x2: box.x + box.w, y1: y(v), y2: y(v) }, svg);
    make("text", { class: "number end", x: box.x - 6, y: y(v) + 4 }, svg, told(v));
  }
  for (const v of x.ticks(Math.max(2, Math.floor(box.w / 70)))) {
    make("line", { class: "grid", x1: x(v), x2: x(v), y1: box.y, y2: box.y + box.h }, svg);
    if (names.x) make("text", { class: "number middle", x: x(v), y: box.y + box.h + 16 }, svg, told(v));
  }
  make("text", { class: "name", x: box.x, y: box.y - 7 }, svg, names.y);
  if (names.x) make("text", { class: "name middle", x: box.x + box.w / 2, y: box.y + box.h + 34 }, svg, names.x);
}

// A line through (X, Y) from begin to end, holes left open; as steps where each value holds until the next.
function line(svg, x, y, X, Y, begin, end, kind, stepped = false) {
  let path = "", open = false;
  for (let k = begin; k < end; k++) {
    const h = x(X[k]), v = y(Y[k]);
    if (!Number.isFinite(v)) { open = false; continue; }
    path += open ? (stepped ? `H${h.toFixed(1)}V${v.toFixed(1)}` : `L${h.toFixed(1)} ${v.toFixed(1)}`)
      : `M${h.toFixed(1)} ${v.toFixed(1)}`;
    open = true;
  }
  if (stepped && open) path += `H${x(X[X.length - 1]).toFixed(1)}`;
  make("path", { class: `line ${kind}`, d: path }, svg);
}

let clips = 0;
function clipped(svg, box) {
  const id = `clip-${++clips}`;
  make("rect", { x: box.x, y: box.y, width: box.w, height: box.h }, make("clipPath", { id }, svg));
  return make("g", { "clip-path": `url(#${id})` }, svg);
}

function band(svg, box, x, [low, high]) {
  const left = Math.max(x(low), box.x), right = Math.min(Math.max(x(high), x(low) + 1), box.x + box.w);
  if (right > left) make("rect", { class: "shade", x: left, y: box.y, width: right - left, height: box.h }, svg);
}

function legend(host, entries) {
  const list = html("ul", { class: "legend" }, host);
  for (const [kind, text] of entries) {
    const item = html("li", {}, list);
    html("i", { class: `key ${kind}` }, item);
    item.append(text);
  }
}

// -- what all charts do --------------------------------------------------------------------------------------------

class Chart {
  constructor(host, data) {
    this.host = host;
    this.data = data;
    legend(host, this.entries());
    this.bar = html("div", { class: "bar-above" }, host);
    this.read = html("output", { class: "read" }, this.bar);
    this.plot = html("div", { class: "plot", role: "group", "aria-label": host.dataset.described }, host);
    host.querySelector("figcaption")?.before(this.plot);
    this.plot.before(this.bar);
    this.bar.before(host.querySelector(".legend"));
    if (this.hint) this.listen();
    this.rest();
    new ResizeObserver(() => { if (this.plot.clientWidth !== this.width) this.draw(); }).observe(this.plot);
  }

  listen() {
    this.plot.tabIndex = 0;
    this.plot.addEventListener("pointermove", event => this.hover(this.at(event)));
    this.plot.addEventListener("pointerleave", () => this.leave());
    this.plot.addEventListener("blur", () => this.leave());
    this.plot.addEventListener("keydown", event => { if (this.key(event)) event.preventDefault(); });
  }

  at(event) {
    const box = this.svg.getBoundingClientRect(), scale = this.width / (box.width || 1);
    return { x: (event.clientX - box.left) * scale, y: (event.clientY - box.top) * scale };
  }

  sheet(height) {
    this.svg = make("svg", { viewBox: `0 0 ${this.width} ${height}`, "aria-hidden": "true", focusable: "false" });
    this.plot.replaceChildren(this.svg);
    return this.svg;
  }

  draw() {
    this.width = state.width || this.plot.clientWidth;
    if (this.width) this.paint();
  }

  rest() { this.read.textContent = this.hint || ""; }
  leave() { this.marks?.replaceChildren(); this.rest(); }
}

// Levels over frequencies f, of which the k-th is read.
class OverFrequency extends Chart {
  get hint() { return "Point, or move with the arrow keys, to read a frequency."; }

  entries() { return this.data.levels.map(({ kind, name }) => [kind, name]); }

  key({ key }) {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[key];
    if (!way) return false;
    this.k = Math.min(Math.max(this.k + way, 0), this.f.length - 1);
    this.point();
    return true;
  }
}
