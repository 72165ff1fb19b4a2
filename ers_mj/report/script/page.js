// -- effects on and off --------------------------------------------------------------------------------------------

function switches() {
  const group = document.getElementById("switches");
  if (!group) return;
  const boxes = [...group.querySelectorAll("input[data-effect]")], all = group.querySelector("input[data-all]");
  const said = group.querySelector("output");
  const put = off => {
    state.off = off;
    boxes.forEach((box, k) => { box.checked = off === "none" || (off !== "all" && k !== off); });
    if (all) all.checked = off === "none";
    said.textContent = DATA.switched[off === "all" || off === "none" ? off : `${off}`];
    for (const chart of charts) if (chart instanceof Trace) chart.draw();
  };
  boxes.forEach((box, k) => box.addEventListener("change", () => put(box.checked ? "none" : k)));
  all?.addEventListener("change", () => put(all.checked ? "none" : "all"));
  group.hidden = false;
  put("none");
}

// -- the page ------------------------------------------------------------------------------------------------------

const KINDS = { trace: Trace, map: HeatMap, spectrum: Spectrum, ladder: Ladder,
  recorded: Recorded, coverage: Coverage, power: Power };
for (const host of document.querySelectorAll("figure[data-chart]")) {
  const data = DATA.charts[host.dataset.chart];
  const chart = new KINDS[data.kind](host, data);
  charts.push(chart);
  chart.draw();
}
switches();

let opened = [];
addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open])")];
  for (const one of opened) one.open = true;
  state.width = PRINTED;
  for (const chart of charts) chart.draw();
});
addEventListener("afterprint", () => {
  for (const one of opened) one.open = false;
  state.width = 0;
  for (const chart of charts) chart.draw();
});
