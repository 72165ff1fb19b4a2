"""What tests of several files share."""

import numpy as np
import pytest
from servo import recorded, started


@pytest.fixture(scope="session")
def pushed():
    """The refitted baseline of a servo that a torque of 0.05 % of its friction pushes."""
    return started(recorded([("bias_torque", np.array([0.06]))]))
