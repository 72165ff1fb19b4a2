"""The change of a motion that sticks and slips. Where the mode changes inside a sample:

slip ends        the speed's change ends with it, the angle's stays
slip begins      the force balance is zero there: nothing jumps
w passes zero    b is stretched by the accelerations' ratio, after over before
theta_0 crossed  the preload's jump strikes earlier or later: b loses 2 c_1 (a - d theta_0) / |w|
caught at theta_0    the angle follows it, from when the preload can stop the rudder within a sample
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.forces import derivative, extra
from ers_mj.plants.kernel.laws import remember
from ers_mj.plants.kernel.maps import MAPS
from ers_mj.plants.kernel.modes import sign
from ers_mj.plants.kernel.state import READ, READ_BOOL, TABLE, C, F, L, Mode, N, State, X, types

# times the motion's extent and largest speed by which a unit of change may move it: beyond, stick and slip only fork
# otherwise
MOST = 10.0
CORNER = 1e-12  # [output unit] within which a rudder at rest is held in the corner


class Change(NamedTuple):
    """Of angle, speed and drive acceleration, per unit."""

    a: float
    b: float
    d: float


CHANGE = types.NamedUniTuple(F, 3, Change)


@inline
def along_path(path, k):
    """The motion's state at a sample."""
    return State(path[k, 0], path[k, 1], path[k, 2], path[k, 0], 0.0)


@inline
def limits(path):
    """(MOST times the extent, MOST times the largest speed) of a motion."""
    low = high = path[0, 0]
    fastest = 0.0
    for k in range(path.shape[0]):
        low, high, fastest = min(low, path[k, 0]), max(high, path[k, 0]), max(fastest, abs(path[k, 1]))
    return MOST * (high - low), MOST * fastest


@inline
def within(x, most):
    return min(max(x, -most), most)


@inline
def side_of(c, theta):
    """Side of theta_0, 0 without a preload."""
    return 0.0 if c.c_1 <= 0 else float(sign(theta - c.theta_0))


@inline
def is_cornered(c, x):
    """Whether the preload holds a rudder at rest."""
    return x.w == 0.0 and c.c_1 > 0 and abs(x.theta - c.theta_0) < CORNER


@inline
def part_before(c, theta, theta_1, side, side_1):
    """Share of a sample before theta_0 is crossed."""
    if side_1 != side and theta_1 != theta:
        return min(max((c.theta_0 - theta) / (theta_1 - theta), 0.0), 1.0)
    return 1.0


@inline
def pull_change(c, dc, u, du, x, x_1, h):
    """Change of what pulls at the current of a closed circuit over a sample."""
    pull = dc.b * u + c.b * du - dc.a_emf * (x_1.theta - x.theta) / h
    return pull - dc.tau_e * (x_1.j - x.j) / h if c.tau_e > 0 else pull


@inline
def charged(d, pull, tau, h):
    """The change of the drive acceleration of a body at rest h later."""
    return pull + (d - pull) * math.exp(-h / tau) if tau > 0 else 0.0


@inline
def struck(c, dc, a, b, w_mean, h):
    """(a, b) after theta_0 was crossed at this mean speed."""
    passing = abs(w_mean)
    if passing > 2.0 * c.c_1 * h:
        return a, b - 2.0 * c.c_1 * (a - dc.theta_0) / passing
    return dc.theta_0, 0.0


@unit(F(C, F, X, N, N, F, F, F, F))
def _acceleration(c, t, x, s, side, drive, tau, a_emf, load):
    """Acceleration of a slipping rudder in the state x."""
    bias = c.bias
    c.bias = bias + load
    a = derivative(c, t, x, Mode(s, side, 0, 0, 0), drive, tau, a_emf).w
    c.bias = bias
    return a


@unit(F(C, C, C, L, F, F, F, X, N, F))
def _direct(c, dc, c_2, laws, scale, load, t, x, s, side):
    """What the changed model adds to the force on a rudder that slips in direction s, per unit of the change."""
    a_mech, level = (dc.a_mech_plus, dc.c_2_plus) if s > 0 else (dc.a_mech_minus, dc.c_2_minus)
    force = dc.bias + dc.a_1 * (c.theta_0 - x.theta) + c.a_1 * dc.theta_0 - dc.c_1 * side - a_mech * x.w - s * level
    if laws:
        force += (extra(c_2, load, t, x, s) - extra(c, load, t, x, s)) * scale
    return force


@unit(types.Tuple((F, F, N))(C, F, F, X, X, F, F, F, F, F, F, F))
def _mode_changes(c, t, t_1, x, x_1, h, drive, tau, a_emf, load, side, side_1):
    """(share of the sample in which the body slips, ratio of the accelerations after and before a reversal, slip)."""
    s, s_1 = sign(x.w), sign(x_1.w)
    if s == 0:
        forward = _acceleration(c, t_1, x_1, s_1, int(side_1), drive, tau, a_emf, load)
        return min(1.0, 2.0 * x_1.w / (forward * h)) if forward * x_1.w > 0 else 1.0, 1.0, s_1
    if s_1 == s:
        return 1.0, 1.0, s
    before = _acceleration(c, t, x, s, int(side), drive, tau, a_emf, load)
    share = min(1.0, -x.w / (before * h)) if before * x.w < 0 else 1.0
    if s_1 == 0:
        return share, 1.0, s
    after = _acceleration(c, t_1, x_1, s_1, int(side_1), drive, tau, a_emf, load)
    ratio = min(max(after / before, 0.0), 1.0) if before != 0.0 else 1.0
    return 1.0, ratio, s if share > 0.5 else s_1


@inline
def _mapped(e, n, i, v, pull, f_0, f_1):
    return (
        e[n, i, 0] * v.a + e[n, i, 1] * v.b + e[n, i, 2] * v.d + e[n, i, 6] * pull + e[n, i, 8] * f_0 + e[n, i, 9] * f_1
    )


@inline
def _fed_back(slopes, k, v):
    """What the laws make of a change."""
    return slopes[k, 0] * v.a + slopes[k, 1] * v.b + slopes[k, 2] * v.d


@inline
def _slipped(maps, n, slopes, k, v, pull, force, force_1, same, times):
    """The change a sample after v, under forces that go from one to the other and what laws make of it."""
    back = back_1 = _fed_back(slopes, k, v)
    z = v
    for _ in range(times):
        f_0, f_1 = force + back, force_1 + back_1 - force - back
        z = Change(
            _mapped(maps, n, 0, v, pull, f_0, f_1),
            _mapped(maps, n, 1, v, pull, f_0, f_1),
            _mapped(maps, n, 2, v, pull, f_0, f_1),
        )
        back_1 = _fed_back(slopes, k + 1, z) if same else back
    return z


@inline
def _after(c, dc, v, z, x, x_1, side, side_1, share, ratio, h):
    """The change z at a sample's end, which began with v, after what its change of mode does to it."""
    a, b = z.a, z.b
    if share < 1.0:
        a, b = v.a + share * (a - v.a), v.b + share * (b - v.b)
    b *= ratio
    if sign(x_1.w) == 0:
        b = 0.0
    if side_1 != side and side * side_1 < 0.0 and sign(x.w) == sign(x_1.w):
        a, b = struck(c, dc, a, b, 0.5 * abs(x.w + x_1.w), h)
    return a, b


@inline
def _corrected(c, dc, x, a, dy, gain):
    """The change of the angle once an observer has moved it towards dy; of theta_0 in the corner."""
    return dc.theta_0 if is_cornered(c, x) else a + gain * (dy - a)


@inline
def _add_laws(c, dc, differ):
    """Whether what laws add to the force changes with the model."""
    return c.inertias > 0 or c.frictions > 0 and (dc.c_2_plus != 0.0 or dc.c_2_minus != 0.0) or differ


@inline
def _times(c):
    """How often a sample is gone over: again where laws make something of the change."""
    return 2 if c.torques + c.frictions > 0 else 1


class Known(NamedTuple):
    """A force at the end of a sample, the next one's number, and the slip that it was taken for."""

    force: float
    at: int
    towards: int


@unit(types.void(READ, READ, READ, READ_BOOL, READ, READ, READ, TABLE, MAPS, TABLE, F, N, C, C, C, L, F, TABLE))
def along(t, u, du, enable, load, y, dy, path, maps, slopes, gain, every, c, c_2, dc, differ, scale, out):
    """See tangents.tangent; ``dc`` is the change of c per unit."""
    h, n = t[1] - t[0], t.size
    laws, times = _add_laws(c, dc, differ), _times(c)
    known = Known(0.0, -1, 0)
    most, fastest = limits(path)
    a = b = d = 0.0
    due = 0 if gain > 0.0 else n  # the sample at which the observer looks next
    for k in range(n):
        out[k, 0], out[k, 1], out[k, 2] = a, b, d
        if k == n - 1:
            break
        x, x_1 = along_path(path, k), along_path(path, k + 1)
        remember(c, x.theta, x.w, x.j, x.theta, x.w, h)
        remember(c_2, x.theta, x.w, x.j, x.theta, x.w, h)
        side, side_1 = side_of(c, x.theta), side_of(c, x_1.theta)
        a = _corrected(c, dc, x, a, dy[k], gain if k == due and y[k] == y[k] else 0.0)
        due += every if k == due else 0
        drive = pull = tau = a_emf = 0.0
        if enable[k]:
            drive, tau, a_emf = c.b * u[k], c.tau_e, c.a_emf
            pull = pull_change(c, dc, u[k], du[k], x, x_1, h)
        else:
            d = 0.0
        if x.w == 0.0 and x_1.w == 0.0:
            b, d = 0.0, charged(d, pull, tau, h)
            continue
        share, ratio, m = _mode_changes(c, t[k], t[k + 1], x, x_1, h, drive, tau, a_emf, load[k], side, side_1)
        passed = part_before(c, x.theta, x_1.theta, side, side_1)
        mean = side * passed + side_1 * (1.0 - passed)
        force = known.force
        if known.at != k or known.towards != m or mean != side:
            force = _direct(c, dc, c_2, laws, scale, load[k], t[k], x, m, mean)
        force_1 = _direct(c, dc, c_2, laws, scale, load[k], t[k + 1], x_1, m, mean)
        if mean == side_1:
            known = Known(force_1, k + 1, m)
        v, same = Change(a, b, d), sign(x_1.w) == m
        z = _slipped(maps, (0 if enable[k] else 3) + m + 1, slopes, k, v, pull, force, force_1, same, times)
        a, b = _after(c, dc, v, z, x, x_1, side, side_1, share, ratio, h)
        a, b, d = within(a, most), within(b, fastest), z.d
