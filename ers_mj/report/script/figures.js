// -- residuals over angle and speed --------------------------------------------------------------------------------

class HeatMap extends Chart {
  get hint() { return "Point, or move with the arrow keys, to read a bin."; }

  constructor(host, data) {
    super(host, data);
    this.values = [unpacked(data.before), unpacked(data.after)];
    this.cell = [data.x.length >> 1, data.y.length >> 1];
  }

  entries() { return []; }

  paint() {
    const { data } = this, beside = this.width >= WIDE, left = 52, gap = 26;
    const w = beside ? (this.width - left - gap - 10) / 2 : this.width - left - 10, h = beside ? 230 : 200;
    this.boxes = [0, 1].map(k => ({ x: left + (beside ? k * (w + gap) : 0), y: 24 + (beside ? 0 : k * (h + 30)), w, h }));
    const svg = this.sheet(this.boxes[1].y + h + 92);
    this.scales = this.boxes.map(box => [linear([data.x[0], data.x.at(-1)], box.x, box.x + box.w),
      linear([data.y[0], data.y.at(-1)], box.y + box.h, box.y)]);
    this.boxes.forEach((box, k) => {
      const [x, y] = this.scales[k], cells = make("g", { class: "heat" }, svg);
      this.values[k].forEach((value, n) => Number.isFinite(value) && this.rect(cells, k, n,
        { class: "cell", "fill-opacity": (0.05 + 0.95 * Math.min(value / data.top, 1)).toFixed(3) }));
      axes(svg, box, x, k && beside ? Object.assign(() => 0, { ticks: () => [] }) : y,
        { y: `${k ? "after" : "before"}${k && beside ? "" : `: ${data.y_name}`}`, x: beside || k ? data.x_name : "" });
    });
    this.scaleBar(svg, this.boxes[1].y + h + 56, left);
    this.marks = make("g", {}, svg);
  }

  rect(parent, k, n, attributes) {
    const { data } = this, [x, y] = this.scales[k], rows = data.y.length - 1, i = Math.floor(n / rows), j = n % rows;
    return make("rect", { x: x(data.x[i]), y: y(data.y[j + 1]), width: x(data.x[i + 1]) - x(data.x[i]),
      height: y(data.y[j]) - y(data.y[j + 1]), ...attributes }, parent);
  }

  scaleBar(svg, y, left) {
    const group = make("g", { class: "heat" }, svg), steps = 24, w = Math.min(240, this.width - left - 90) / steps;
    for (let k = 0; k < steps; k++) make("rect", { class: "cell", x: left + k * w, y, width: w + 0.5, height: 10,
      "fill-opacity": (0.05 + 0.95 * k / (steps - 1)).toFixed(3) }, group);
    make("text", { class: "number", x: left, y: y + 25 }, svg, "0");
    make("text", { class: "number", x: left + steps * w + 8, y: y + 9 }, svg,
      `≥ ${told(this.data.top, 3)} ${this.data.unit}`);
  }

  hover({ x, y }) {
    const k = this.boxes.findIndex(b => x >= b.x && x <= b.x + b.w && y >= b.y && y <= b.y + b.h);
    if (k < 0) return this.leave();
    const { data } = this, [sx, sy] = this.scales[k], held = (n, list) => Math.min(Math.max(n, 0), list.length - 2);
    this.cell = [held(place(data.x, sx.back(x)) - 1, data.x), held(place(data.y, sy.back(y)) - 1, data.y)];
    return this.point();
  }

  point() {
    const { data } = this, [i, j] = this.cell, n = i * (data.y.length - 1) + j;
    this.marks.replaceChildren();
    for (const k of [0, 1]) this.rect(this.marks, k, n, { class: "bin" });
    const [before, after] = this.values.map(list => (Number.isFinite(list[n]) ? told(list[n], 3) : "no data"));
    this.read.textContent = `${told(data.x[i], 3)} … ${told(data.x[i + 1], 3)} ${data.x_unit}, ${told(data.y[j], 3)} … ` +
      `${told(data.y[j + 1], 3)} ${data.y_unit}: before ${before}, after ${after} ${data.unit}`;
  }

  key({ key }) {
    const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] }[key];
    if (!move) return false;
    const most = [this.data.x.length - 2, this.data.y.length - 2];
    this.cell = this.cell.map((n, k) => Math.min(Math.max(n + move[k], 0), most[k]));
    this.point();
    return true;
  }
}

// -- the error over frequency --------------------------------------------------------------------------------------

class Spectrum extends OverFrequency {
  constructor(host, data) {
    super(host, data);
    this.f = unpacked(data.f);
    this.levels = data.levels.map(({ kind, name, y }) => ({ kind, name, y: unpacked(y).map(v => 10 ** v) }));
    this.size = unpacked(data.size);
    this.phase = unpacked(data.phase);
    this.k = 0;
  }

  paint() {
    const { data, f } = this, beside = this.width >= WIDE, left = 58, all = [0, f.length], ends = [f[0], f.at(-1)];
    const half = (this.width - left * 2 - 20) / 2, w = this.width - left - 10;
    this.boxes = (beside ? [[left, 22, half, 250], [2 * left + half + 10, 22, half, 105], [2 * left + half + 10, 167, half, 105]]
      : [[left, 22, w, 220], [left, 314, w, 110], [left, 464, w, 100]]).map(([x, y, w, h]) => ({ x, y, w, h }));
    const svg = this.sheet(this.boxes[2].y + this.boxes[2].h + 44);
    this.x = this.boxes.map(box => logarithmic(ends, box.x, box.x + box.w));
    const ranges = [extent(this.levels.map(level => level.y), ...all), padded(extent([this.size, [0]], ...all)),
      padded(extent([this.phase, [0]], ...all))];
    ranges[0] = [Math.max(ranges[0][0], data.bottom), ranges[0][1] * 1.3];
    this.boxes.forEach((box, k) => {
      const y = (k ? linear : logarithmic)(ranges[k], box.y + box.h, box.y), inside = clipped(svg, box);
      band(inside, box, this.x[k], data.region);
      axes(svg, box, this.x[k], y, { y: data.names[k], x: k === 1 ? "" : "frequency [Hz]" });
      const curves = clipped(svg, box);
      if (k === 0) for (const level of this.levels) line(curves, this.x[0], y, f, level.y, ...all, level.kind);
      else this.response(curves, this.x[k], y, k === 1 ? this.size : this.phase);
    });
    this.marks = make("g", {}, svg);
  }

  response(svg, x, y, values) {
    const known = [...values.keys()].filter(k => Number.isFinite(values[k]));
    make("line", { class: "zero", x1: x(this.f[0]), x2: x(this.f.at(-1)), y1: y(0), y2: y(0) }, svg);
    line(svg, x, y, known.map(k => this.f[k]), known.map(k => values[k]), 0, known.length, "input");
    for (const k of known) make("circle", { class: "dot input", cx: x(this.f[k]), cy: y(values[k]), r: 2.4 }, svg);
  }

  hover({ x, y }) {
    const k = this.boxes.findIndex(b => x >= b.x && x <= b.x + b.w && y >= b.y - 20 && y <= b.y + b.h + 10);
    if (k < 0) return this.leave();
    this.k = nearest(this.f, this.x[k].back(x));
    return this.point();
  }

  point() {
    const f = this.f[this.k], gap = Number.isFinite(this.size[this.k])
      ? `; measured over simulated ${told(this.size[this.k], 3)} dB, ${told(this.phase[this.k], 3)}°` : "";
    this.marks.replaceChildren();
    this.boxes.forEach((b, n) => make("line", { class: "cursor", x1: this.x[n](f), x2: this.x[n](f), y1: b.y,
      y2: b.y + b.h }, this.marks));
    const levels = this.levels.map(({ name, y }) => `${name} ${told(y[this.k], 3)}`).join(" · ");
    this.read.textContent = `${told(f, 3)} Hz · ${levels} ${this.data.unit}${gap}`;
  }
}

// -- the ladder of candidates --------------------------------------------------------------------------------------

class Ladder extends Chart {
  entries() { return []; }

  paint() {
    const { rungs, name } = this.data, beside = this.width >= WIDE;
    const left = beside ? Math.min(290, this.width * 0.36) : 6, row = beside ? 27 : 42;
    const box = { x: left, y: 4, w: this.width - left - (beside ? 190 : 150), h: rungs.length * row };
    const svg = this.sheet(box.h + 56), gains = rungs.map(({ gain }) => gain ?? 0);
    const x = linear([Math.min(0, ...gains), Math.max(...gains) > 0 ? Math.max(...gains) : 1], box.x, box.x + box.w);
    axes(svg, box, x, Object.assign(() => 0, { ticks: () => [] }), { y: "", x: name });
    rungs.forEach((rung, k) => {
      const y = box.y + row * (k + (beside ? 0.5 : 0.72)), kind = rung.chosen ? "chosen" : "other";
      make("text", beside ? { class: `rung end ${kind}`, x: left - 10, y: y + 4 }
        : { class: `rung ${kind}`, x: left, y: y - 9 }, svg, shortened(rung.name, (beside ? left : this.width) / 7));
      const end = x(rung.gain ?? 0), words = [rung.gain === null ? "not fitted" : told(rung.gain, 3), rung.scored];
      make("line", { class: `bar-line ${kind}`, x1: x(0), x2: end, y1: y, y2: y }, svg);
      make("circle", { class: `end-dot ${kind}`, cx: end, cy: y, r: rung.chosen ? 5 : 3.5 }, svg);
      make("text", { class: `number ${kind}`, x: Math.max(end, x(0)) + 10, y: y + 4 }, svg,
        words.filter(Boolean).join(" · "));
    });
  }
}

function shortened(text, most) {
  return text.length <= most ? text : `${text.slice(0, Math.floor(most) - 1)}…`;
}
