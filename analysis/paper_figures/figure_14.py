"""Figure 14: energy under Case 1, the integral of u i, most of it holding current: `python
analysis/paper_figures/figure_14.py`.
"""

import math

from drawing import bars, table, trials

if __name__ == "__main__":
    found = trials(["square"], on_bench=True)
    bars(
        [
            ("energy of Case 1 [J]", {t.controller: t.measures.energy_J for t in found}),
            ("RMS error bought with it [°]", {t.controller: math.degrees(t.measures.rmse_rad) for t in found}),
        ],
        "figure_14",
    )
    table(found)
