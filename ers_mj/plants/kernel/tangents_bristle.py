"""The change of a motion on a bristle, which has no instants of stick and slip: its friction is a force that bends,
stiff while it holds, and its change is one more state, stepped implicitly.
"""

from __future__ import annotations

import math

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.forces import bristle_level, extra
from ers_mj.plants.kernel.laws import remember
from ers_mj.plants.kernel.state import READ, READ_BOOL, TABLE, C, F, N, State, X, types
from ers_mj.plants.kernel.tangents_slip import (
    along_path,
    charged,
    is_cornered,
    limits,
    part_before,
    pull_change,
    side_of,
    struck,
    within,
)

# of a sample, at which the forces of a bristle's step are taken: beyond the middle, so that what is stiff dies out
AHEAD = 0.6


@inline
def _fading(c, w):
    """The damping of a bristle at a speed, per total inertia."""
    return c.d_bristle * math.exp(-((w / c.fade) ** 2))


@inline
def _unbent(c, left, way):
    """What is left of a bristle's share of its level to bend, which was ``left``, after a way counted in the
    displacement of its whole bend.
    """
    if c.dahl == 1.0 or left <= 0.0:
        return left * math.exp(-way)
    power = 1.0 - c.dahl
    return max(left**power - power * way, 0.0) ** (1.0 / power)


@unit(types.UniTuple(F, 4)(C, C, C, X, F, F, F, F))
def _bent(c, c_2, dc, x, z, way, scale, h):
    """(bend of the bristle after a way, bend per way, rate [1/s] at which a change of the bend dies out, at which it
    grows), where it was z.
    """
    s, k = 1 if way > 0 else -1, c.k_bristle
    level, level_2 = bristle_level(c, x, float(s)), bristle_level(c_2, x, float(s))
    unbent = _unbent(c, 1.0 - s * k * z / level, k * abs(way) / level)
    z_1 = s * level / k * (1.0 - unbent)
    bends = (z_1 - z) / way if abs(way) > 0.0 else 1.0
    z_mean = 0.5 * (z + z_1)
    left = 1.0 - s * k * z_mean / level
    lets_go = abs(way) / h * k / level * (1.0 if c.dahl == 1.0 else c.dahl * abs(left) ** (c.dahl - 1.0))
    grows = lets_go * z_mean * ((level_2 - level) * scale / level - dc.k_bristle / k)
    if dc.dahl != 0.0 and left > 0.0:
        grows += dc.dahl * way / h * left**c.dahl * math.log(left)
    return z_1, bends, lets_go, grows


@unit(F(C, C, C, X, N, F, F, F, F, F, F, F))
def _direct(c, c_2, dc, x, s, mean_side, z, z_1, t, load, scale, h):
    """What the changed model adds to the force on the rudder, per unit of the change, in the middle of a sample."""
    force = (
        dc.bias
        + dc.a_1 * (c.theta_0 - x.theta)
        + c.a_1 * dc.theta_0
        - dc.c_1 * mean_side
        - (dc.a_mech_plus if s > 0 else dc.a_mech_minus) * x.w
        - dc.k_bristle * (0.5 * (z + z_1))
        - (_fading(c_2, x.w) - _fading(c, x.w)) * scale * (z_1 - z) / h
    )
    if c.torques + c.frictions > 0 or c_2.torques + c_2.frictions > 0:
        force += (extra(c_2, load, t + 0.5 * h, x, s) - extra(c, load, t + 0.5 * h, x, s)) * scale
    return force


@inline
def _drawn(d, pull, rate, emf, part):
    """(change of the drive in a step's part that does not hang on the speed's, its slope by that)."""
    if rate <= 0:
        return pull, -emf
    return (d + part / rate * pull) / (1.0 + part / rate), -part / rate * emf / (1.0 + part / rate)


@unit(types.UniTuple(F, 4)(C, TABLE, N, X, F, F, F, F, F, F, F, F, F, F, F, N, F))
def _stepped(c, slopes, i, x, a, b, d, bent, pull, rate, emf, force, bends, lets_go, grows, s, h):
    """(a, b, d, bent) a sample later, by a step that is implicit at AHEAD of it."""
    part, k = AHEAD * h, c.k_bristle
    viscous, damping = c.a_mech_plus if s > 0 else c.a_mech_minus, _fading(c, x.w)
    bent_0, per_speed = (bent + part * grows) / (1.0 + part * lets_go), part * bends / (1.0 + part * lets_go)
    drawn, back = _drawn(d, pull, rate, emf, part)
    spring, share = c.a_1 - slopes[i, 0], 1.0 + slopes[i, 2]
    b_m = (b / part + force - spring * a + share * drawn - k * bent_0 - damping * (bent_0 - bent) / part) / (
        1.0 / part + spring * part + viscous - slopes[i, 1] - share * back + k * per_speed + damping * per_speed / part
    )
    d = drawn + back * b_m if rate <= 0 else d + (drawn + back * b_m - d) / AHEAD
    return a + h * b_m, b + (b_m - b) / AHEAD, d, bent + (bent_0 + per_speed * b_m - bent) / AHEAD


@inline
def _corrected(c, x, y, dy, a, gain):
    """(change of the angle, jump of the angle) by the observer: less the nearer the corner is."""
    jump = gain * (y - x.theta)
    near = min(abs(x.theta - c.theta_0) / max(2.0 * abs(jump), 1e-300), 1.0) if c.c_1 > 0 else 1.0
    return a + gain * near * (dy - a), jump * near


@inline
def _middle(x, x_1):
    theta = 0.5 * (x.theta + x_1.theta)
    return State(theta, 0.5 * (x.w + x_1.w), 0.5 * (x.j + x_1.j), theta, 0.0)


@unit(types.void(READ, READ, READ, READ_BOOL, READ, READ, READ, TABLE, TABLE, F, N, C, C, C, F, TABLE))
def along_bristle(t, u, du, enable, load, y, dy, path, slopes, gain, every, c, c_2, dc, scale, out):
    """See tangents.tangent; the bend z along the path and its change bent are integrated here."""
    n, h = t.size, t[1] - t[0]
    most, fastest = limits(path)
    full = 0.5 * (c.c_2_plus + c.c_2_minus) / c.k_bristle
    z = min(max(path[0, 1] / math.sqrt(c.k_bristle), -full), full)
    a = b = d = bent = 0.0
    for i in range(n):
        out[i, 0], out[i, 1], out[i, 2] = a, b, d
        if i == n - 1:
            break
        x, x_1 = along_path(path, i), along_path(path, i + 1)
        remember(c, x.theta, x.w, x.j, x.theta, x.w, h)
        remember(c_2, x.theta, x.w, x.j, x.theta, x.w, h)
        side, side_1, jump = side_of(c, x.theta), side_of(c, x_1.theta), 0.0
        rate = emf = pull = 0.0
        if enable[i]:
            rate, emf = c.tau_e, c.a_emf
            pull = pull_change(c, dc, u[i], du[i], x, x_1, h)
        if is_cornered(c, x):
            a, b = dc.theta_0, 0.0
            if x_1.w == 0.0:
                d = charged(d, pull, rate, h)
                continue
        elif gain > 0.0 and i % every == 0 and y[i] == y[i]:
            a, jump = _corrected(c, x, y[i], dy[i], a, gain)
        way, middle = x_1.theta - x.theta - jump, _middle(x, x_1)
        s = 1 if way > 0 else -1
        z_1, bends, lets_go, grows = _bent(c, c_2, dc, middle, z, way, scale, h)
        passed = part_before(c, x.theta, x_1.theta, side, side_1)
        mean = side * passed + side_1 * (1.0 - passed)
        force = _direct(c, c_2, dc, middle, s, mean, z, z_1, t[i], load[i], scale, h)
        a, b, d, bent = _stepped(
            c, slopes, i, middle, a, b, d, bent, pull, rate, emf, force, bends, lets_go, grows, s, h
        )
        if side_1 != side and side * side_1 < 0.0:
            a, b = struck(c, dc, a, b, 0.5 * abs(x.w + x_1.w), h)
        a, b, z = within(a, most), within(b, fastest), z_1
