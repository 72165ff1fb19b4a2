"""Figure 7: step of 10 deg on Eq. (5), response and error: `python analysis/paper_figures/figure_07.py`."""

from drawing import curves, table, trials

if __name__ == "__main__":
    found = trials(["step"], on_bench=False)
    curves(found, "figure_07", until=0.25)
    table(found)
