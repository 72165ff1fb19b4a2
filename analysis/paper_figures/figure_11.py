"""Figure 11: Case 1, the square wave, on the MuJoCo plant (captioned "step" in the paper): `python
analysis/paper_figures/figure_11.py`.
"""

from drawing import curves, table, trials

if __name__ == "__main__":
    found = trials(["square"], on_bench=True)
    curves(found, "figure_11")
    table(found)
