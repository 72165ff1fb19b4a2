// -- traces --------------------------------------------------------------------------------------------------------

class Trace extends Chart {
  get hint() { return "Drag, or + and −, to zoom all recordings; double-click, or 0, for the whole."; }

  constructor(host, data) {
    super(host, data);
    this.levels = data.levels.map(level => this.unpack(level));
    const tools = html("div", { class: "tools" }, this.bar);
    if (data.worst) this.button(tools, "Worst span", () => zoom(data.worst));
    this.whole = this.button(tools, "Whole recording", () => zoom(null));
    this.drag();
  }

  entries() {
    const out = [["measured", "measured"], ["before", "before"], ["after", "after"]];
    return this.data.shaded.length ? [...out, ["shade", "where it fails"]] : out;
  }

  button(parent, text, act) {
    const node = html("button", { type: "button" }, parent, text);
    node.addEventListener("click", act);
    return node;
  }

  unpack(level) {
    const each = set => ({ before: unpacked(set.before), after: unpacked(set.after),
      without: set.without.map(series => series && unpacked(series)) });
    return { t: unpacked(level.t), measured: unpacked(level.measured), output: each(level.output),
      residual: each(level.residual), u: { t: unpacked(level.u.t), y: unpacked(level.u.y) } };
  }

  // The curve that stands for "after": of all effects, without one, or without any, which is before.
  chosen(set) {
    return state.off === "all" ? set.before : state.off === "none" ? set.after : set.without[state.off] || set.after;
  }

  get span() { const t = this.levels[0].t; return [t[0], t[t.length - 1]]; }

  get view() {
    const [first, last] = this.span, [begin, end] = state.view || this.span;
    return end > first && begin < last ? [Math.max(begin, first), Math.min(end, last)] : [first, last];
  }

  get level() {
    const [begin, end] = this.view;
    return this.levels.findLast(({ t }) => t[0] <= begin && t[t.length - 1] >= end) || this.levels[0];
  }

  paint() {
    const left = 52, w = this.width - left - 10, tall = this.width >= WIDE ? 230 : 190;
    const boxes = [[22, tall], [tall + 52, 96], [tall + 178, 76]].map(([y, h]) => ({ x: left, y, w, h }));
    const svg = this.sheet(tall + 178 + 76 + 44), { level, view } = this;
    this.x = linear(view, left, left + w);
    this.range = [Math.max(place(level.t, view[0]) - 1, 0), Math.min(place(level.t, view[1]) + 2, level.t.length)];
    this.y = this.scales(boxes, level);
    const names = [this.data.output.name, this.data.residual.name, this.data.input.name];
    boxes.forEach((box, k) => {
      const inside = clipped(svg, box);
      if (k < 2) for (const span of this.data.shaded) band(inside, box, this.x, span);
      if (k === 1) this.noise(inside, box);
      axes(svg, box, this.x, this.y[k], { y: names[k], x: k === 2 ? "time [s]" : "" });
      this.lines(clipped(svg, box), k, level);
    });
    this.boxes = boxes;
    this.marks = make("g", {}, svg);
    this.whole.disabled = !state.view;
  }

  scales(boxes, level) {
    const { output, residual } = level, drawn = set => [set.before, this.chosen(set)];
    const u = level.u, from = Math.max(place(u.t, this.view[0]) - 1, 0), to = place(u.t, this.view[1]) + 1;
    const fit = (lists, always) => {
      const [low, high] = extent(lists, ...this.range), [least, most] = extent(always, ...this.range);
      const room = most - least; // a curve that runs away is cut off
      return padded([Math.max(low, least - room), Math.min(high, most + room)]);
    };
    const ranges = [fit([level.measured, ...drawn(output)], [level.measured, output.before, output.after]),
      fit(drawn(residual), [residual.before, residual.after]), padded(extent([u.y], from, Math.min(to, u.t.length)))];
    this.steps = [from, Math.min(to, u.t.length)];
    return boxes.map((box, k) => linear(ranges[k], box.y + box.h, box.y));
  }

  noise(svg, box) {
    const half = this.data.residual.band, y = this.y[1];
    if (!(half > 0)) return;
    const top = Math.max(y(half), box.y), bottom = Math.min(y(-half), box.y + box.h);
    if (bottom > top) make("rect", { class: "noise", x: box.x, y: top, width: box.w, height: bottom - top }, svg);
  }

  lines(svg, k, level) {
    const draw = (Y, kind) => line(svg, this.x, this.y[k], level.t, Y, ...this.range, kind);
    if (k === 2) return line(svg, this.x, this.y[2], level.u.t, level.u.y, ...this.steps, "input", true);
    if (k === 0) draw(level.measured, "measured");
    const set = k ? level.residual : level.output;
    draw(set.before, "before");
    return draw(this.chosen(set), "after");
  }

  hover({ x }) {
    const left = this.boxes[0].x, right = left + this.boxes[0].w;
    this.cursor = this.x.back(Math.min(Math.max(x, left), right));
    this.point();
  }

  point() {
    const { level } = this, k = nearest(level.t, this.cursor), { output, residual, input } = this.data;
    const u = level.u, at = Math.max(place(u.t, this.cursor + 1e-12) - 1, 0);
    const values = [level.measured, level.output.before, this.chosen(level.output)].map(list => list[k]);
    this.marks.replaceChildren();
    const [above, , below] = this.boxes, h = this.x(level.t[k]);
    make("line", { class: "cursor", x1: h, x2: h, y1: above.y, y2: below.y + below.h }, this.marks);
    values.forEach((v, n) => Number.isFinite(v) && make("circle",
      { class: `dot ${["measured", "before", "after"][n]}`, cx: h, cy: this.y[0](v), r: 3.5 }, this.marks));
    const off = told(this.chosen(level.residual)[k], 3), was = told(level.residual.before[k], 3);
    this.read.textContent = `${told(level.t[k])} s · measured ${told(values[0])} · before ${told(values[1])}` +
      ` · after ${told(values[2])} ${output.unit} · residual ${was} → ${off} ${residual.unit}` +
      ` · input ${told(u.y[at])} ${input.unit}`;
  }

  drag() {
    let from = null;
    this.plot.addEventListener("pointerdown", event => {
      if (event.button !== 0) return;
      from = this.at(event).x;
      this.plot.setPointerCapture(event.pointerId);
    });
    this.plot.addEventListener("pointermove", event => {
      if (from === null) return;
      const to = this.at(event).x, [above, , below] = this.boxes;
      make("rect", { class: "chosen-span", x: Math.min(from, to), y: above.y, width: Math.abs(to - from),
        height: below.y + below.h - above.y }, this.marks);
    });
    this.plot.addEventListener("pointerup", event => {
      if (from === null) return;
      const ends = [from, this.at(event).x].sort((a, b) => a - b).map(pixel => this.x.back(pixel));
      const moved = Math.abs(this.at(event).x - from);
      from = null;
      if (moved > 8) zoom(this.held(ends));
    });
    this.plot.addEventListener("pointercancel", () => { from = null; this.leave(); });
    this.plot.addEventListener("dblclick", () => zoom(null));
  }

  // Ends within the recording, so far apart that something is left to see.
  held([begin, end]) {
    const [first, last] = this.span, least = (last - first) / 2000, middle = (begin + end) / 2;
    const half = Math.max(end - begin, least) / 2;
    return [Math.max(middle - half, first), Math.min(middle + half, last)];
  }

  key({ key, shiftKey }) {
    const [begin, end] = this.view, step = (end - begin) * (shiftKey ? 0.1 : 0.01);
    const middle = this.cursor >= begin && this.cursor <= end ? this.cursor : (begin + end) / 2;
    const way = { ArrowLeft: -1, ArrowRight: 1 }[key], factor = { "+": 0.5, "=": 0.5, "-": 2 }[key];
    if (way) {
      this.cursor = Math.min(Math.max(middle + way * step, begin), end);
      this.point();
    } else if (factor) {
      const wanted = [middle - (middle - begin) * factor, middle + (end - middle) * factor];
      zoom(wanted[1] - wanted[0] >= this.span[1] - this.span[0] ? null : this.held(wanted));
    } else if (key === "0" || key === "Escape") zoom(null);
    return way || factor || key === "0";
  }
}

function zoom(view) {
  state.view = view;
  for (const chart of charts) if (chart instanceof Trace) chart.draw();
}
