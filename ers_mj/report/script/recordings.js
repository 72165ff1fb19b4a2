// -- recordings as they were read ---------------------------------------------------------------------------------

// Output and input over time, with what is faulty shaded.
class Recorded extends Timeline {
  entries() { return this.data.shaded.length ? [["shade", "faults"]] : []; }

  unpack(level) { return { t: unpacked(level[0].t), each: level.map(({ t, y }) => ({ t: unpacked(t), y: unpacked(y) })) }; }

  paint() {
    const left = 58, w = this.width - left - 10, high = this.width >= WIDE ? 150 : 120, { view, level } = this;
    this.boxes = level.each.map((_, k) => ({ x: left, y: 22 + k * (high + 30), w, h: high }));
    const svg = this.sheet(this.boxes.at(-1).y + high + 44), last = this.boxes.length - 1;
    this.x = linear(view, left, left + w);
    this.y = level.each.map(({ t, y }, k) => {
      const range = [Math.max(place(t, view[0]) - 1, 0), Math.min(place(t, view[1]) + 2, t.length)];
      const box = this.boxes[k], scale = linear(padded(extent([y], ...range)), box.y + box.h, box.y);
      const { name, kind, held } = this.data.panels[k], inside = clipped(svg, box);
      for (const span of this.data.shaded) band(inside, box, this.x, span);
      axes(svg, box, this.x, scale, { y: name, x: k === last ? "time [s]" : "" });
      line(clipped(svg, box), this.x, scale, t, y, ...range, kind, held);
      return scale;
    });
    this.marks = make("g", {}, svg);
    this.whole.disabled = !state.view;
  }

  hover({ x }) {
    const { x: left, w } = this.boxes[0];
    this.cursor = this.x.back(Math.min(Math.max(x, left), left + w));
    this.point();
  }

  point() {
    const above = this.boxes[0], below = this.boxes.at(-1), h = this.x(this.cursor);
    this.marks.replaceChildren();
    make("line", { class: "cursor", x1: h, x2: h, y1: above.y, y2: below.y + below.h }, this.marks);
    const values = this.level.each.map(({ t, y }, k) => {
      const { held, name, unit } = this.data.panels[k];
      const at = held ? Math.max(place(t, this.cursor + 1e-12) - 1, 0) : nearest(t, this.cursor);
      return `${name.split(" [")[0]} ${told(y[at])} ${unit}`;
    });
    this.read.textContent = `${told(this.cursor)} s · ${values.join(" · ")}`;
  }
}

// Shares of the time over output, speed and input.
class Coverage extends Chart {
  entries() { return []; }

  paint() {
    const { panels } = this.data, beside = this.width >= WIDE, left = 46, gap = 16, h = 130;
    const w = beside ? (this.width - left - 10 - gap * (panels.length - 1)) / panels.length : this.width - left - 10;
    const top = Math.max(...panels.flatMap(({ share }) => share)), svg = this.sheet(beside ? 22 + h + 44 : panels.length * (h + 70));
    panels.forEach(({ name, edges, share }, k) => {
      const box = { x: left + (beside ? k * (w + gap) : 0), y: 22 + (beside ? 0 : k * (h + 70)), w, h };
      const x = linear([edges[0], edges.at(-1)], box.x, box.x + w), y = linear([0, 1.05 * top], box.y + h, box.y);
      axes(svg, box, x, beside && k ? Object.assign(() => 0, { ticks: () => [] }) : y,
        { y: beside && k ? "" : "time [%]", x: name });
      share.forEach((part, n) => make("rect", { class: "share", x: x(edges[n]), y: y(part),
        width: Math.max(x(edges[n + 1]) - x(edges[n]) - 1, 0.5), height: y(0) - y(part) }, svg));
    });
  }
}

// Power densities of output and input over their peaks.
class Power extends OverFrequency {
  constructor(host, data) {
    super(host, data);
    this.f = unpacked(data.f).map(v => 10 ** v);
    this.levels = data.levels.map(({ kind, name, y }) => ({ kind, name, y: unpacked(y) }));
    this.k = 0;
  }

  paint() {
    const { f } = this, left = 58, all = [0, f.length];
    this.box = { x: left, y: 22, w: this.width - left - 10, h: this.width >= WIDE ? 200 : 170 };
    const { box } = this, svg = this.sheet(box.y + box.h + 44);
    this.x = logarithmic([f[0], f.at(-1)], box.x, box.x + box.w);
    const y = linear(padded(extent(this.levels.map(level => level.y), ...all)), box.y + box.h, box.y);
    axes(svg, box, this.x, y, { y: "power over its peak [dB]", x: "frequency [Hz]" });
    for (const level of this.levels) line(clipped(svg, box), this.x, y, f, level.y, ...all, level.kind);
    this.marks = make("g", {}, svg);
  }

  hover({ x }) {
    this.k = nearest(this.f, this.x.back(Math.min(Math.max(x, this.box.x), this.box.x + this.box.w)));
    this.point();
  }

  point() {
    const f = this.f[this.k], h = this.x(f), { y, h: high } = this.box;
    this.marks.replaceChildren();
    make("line", { class: "cursor", x1: h, x2: h, y1: y, y2: y + high }, this.marks);
    this.read.textContent = `${told(f, 3)} Hz · ${this.levels.map(level => `${level.name} ${told(level.y[this.k], 3)} dB`).join(" · ")}`;
  }
}
