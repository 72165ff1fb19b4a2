// -- traces --------------------------------------------------------------------------------------------------------

class Trace extends Timeline {
  entries() {
    const out = [["measured", "measured"], ["before", "before"], ["after", "after"]];
    return this.data.shaded.length ? [...out, ["shade", "where it fails"]] : out;
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
}
