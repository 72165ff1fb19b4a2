"""What tests of several files share: baselines of the small servo of servo.py, refitted once."""

import numpy as np
import pytest
from servo import SPARSE, TRUTH, recorded, started


@pytest.fixture(scope="session")
def pushed():
    """A servo that a torque of 0.05 % of its friction pushes."""
    return started(recorded([("bias_torque", np.array([0.06]))]))


@pytest.fixture(scope="session")
def plain():
    """A servo without missing physics."""
    return started(recorded())


@pytest.fixture(scope="session")
def delayed():
    """A servo whose drive delays and sleeps: (its baseline, its laws by name)."""
    truth = {"drive_dead_zone": np.array([0.95, np.inf, np.inf]), "input_delay": np.array([0.0157])}
    values = {**TRUTH, "c_2": 85.0}
    return started(recorded(list(truth.items()), values=values, t=SPARSE), values), truth


@pytest.fixture
def columns() -> dict[str, np.ndarray]:
    """A swinging servo of 400 rows at 1 kHz."""
    rng = np.random.default_rng(1)
    t = np.arange(400) * 1e-3
    u = 5 * np.sin(40 * t) + 0.1 * rng.normal(size=400)
    theta = 0.26 + 0.1 * np.sin(40 * t - 0.5) + 1e-4 * rng.normal(size=400)
    return {"t_s": t, "u_V": u, "theta_rad": theta}
