// -- charts over time ----------------------------------------------------------------------------------------------

// What charts over time share: levels of detail, and one zoom for all of them.
class Timeline extends Chart {
  get hint() { return "Drag, or + and −, to zoom all recordings; double-click, or 0, for the whole."; }

  constructor(host, data) {
    super(host, data);
    this.levels = data.levels.map(level => this.unpack(level));
    const tools = html("div", { class: "tools" }, this.bar);
    if (data.worst) this.button(tools, "Worst span", () => zoom(data.worst));
    this.whole = this.button(tools, "Whole recording", () => zoom(null));
    this.drag();
  }

  button(parent, text, act) {
    const node = html("button", { type: "button" }, parent, text);
    node.addEventListener("click", act);
    return node;
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

  hover({ x }) {
    const left = this.boxes[0].x, right = left + this.boxes[0].w;
    this.cursor = this.x.back(Math.min(Math.max(x, left), right));
    this.point();
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
      const to = this.at(event).x, above = this.boxes[0], below = this.boxes.at(-1);
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
  for (const chart of charts) if (chart instanceof Timeline) chart.draw();
}
