"""Figure 8: chirp from 1 to 20 Hz on Eq. (5), response and error: `python analysis/paper_figures/figure_08.py`."""

from drawing import curves, table, trials

if __name__ == "__main__":
    found = trials(["chirp"], on_bench=False)
    curves(found, "figure_08")
    table(found)
