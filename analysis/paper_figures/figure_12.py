"""Figure 12: Case 2, the ramp, on the MuJoCo plant (captioned "step" in the paper; its speed is constant, not its
acceleration): `python analysis/paper_figures/figure_12.py`.
"""

from drawing import curves, table, trials

if __name__ == "__main__":
    found = trials(["ramp"], on_bench=True)
    curves(found, "figure_12")
    table(found)
