"""Figure 13: Case 3, the chirp, on the MuJoCo plant: `python analysis/paper_figures/figure_13.py`."""

from drawing import curves, table, trials

if __name__ == "__main__":
    found = trials(["chirp"], on_bench=True)
    curves(found, "figure_13")
    table(found)
