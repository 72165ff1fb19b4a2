"""Figure 15: settling time, overshoot and steady-state error under Cases 1 and 2: `python
analysis/paper_figures/figure_15.py`.

A ramp has no jump from which to settle: its settling time is that to within 2 % of its amplitude.
"""

import math

from drawing import bars, table, trials

MEASURES = (
    ("settling time [ms]", "settling_time_s", 1e3),
    ("overshoot [%]", "overshoot_pct", 1.0),
    ("steady-state error [°]", "steady_state_error_rad", math.degrees(1.0)),
)

if __name__ == "__main__":
    for letter, case in (("a", "square"), ("b", "ramp")):
        found = trials([case], on_bench=True)
        values = lambda key, factor: {
            t.controller: None if getattr(t.measures, key) is None else factor * getattr(t.measures, key)
            for t in found  # noqa: B023
        }
        bars([(label, values(key, factor)) for label, key, factor in MEASURES], f"figure_15{letter}")
        table(found)
