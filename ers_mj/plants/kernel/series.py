"""The flow of a mode as polynomials in time, made once and asked for many instants: what events are located on. What
laws add enters as a parabola in time.

A span is cut into pieces of about one time constant, each of which has its Taylor series, to machine precision; they
lie in the plant's record.
"""

from __future__ import annotations

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.flow import NONE, balance, is_linear, is_small, parabola, steps_of, term_after
from ers_mj.plants.kernel.forces import TRIPLE, beside
from ers_mj.plants.kernel.state import MOST_PIECES, MOST_TERMS, C, F, L, M, State, X, is_parted, with_drive


@inline
def _put(c, at, v):
    c.terms[at], c.terms[at + 1], c.terms[at + 2], c.terms[at + 3], c.terms[at + 4] = (
        v.theta,
        v.w,
        v.j,
        v.theta_m,
        v.w_m,
    )


@unit(L(C, X, M, F, F, F, F, TRIPLE, TRIPLE))
def _expand(c, x, m, drive, tau, a_emf, span, f, r):
    """Expand the flow from x over a span [s] under the forces f and r (see flow.linear); False where that takes more
    pieces than it has.
    """
    b = balance(c, m, tau)
    n = steps_of(c, b, tau, a_emf, span)
    if n > MOST_PIECES:
        return False
    c.pieces, h = n, span / n
    for i in range(n):
        at, v = i * MOST_TERMS * 5, x
        _put(c, at, v)
        for k in range(1, MOST_TERMS):
            v = term_after(c, m, b, v, h, k, i, n, a_emf, drive, 1.0, f, r)
            x = State(x.theta + v.theta, x.w + v.w, x.j + v.j, x.theta_m + v.theta_m, x.w_m + v.w_m)
            c.counts[i] = k
            _put(c, at + 5 * k, v)
            if k > 3 and is_small(v, x):
                break
    return True


@inline
def expanded(c, drive, tau, a_emf, share):
    """The state at a share of the span that was expanded."""
    i = min(int(share * c.pieces), c.pieces - 1)
    s, at = share * c.pieces - i, i * MOST_TERMS * 5
    theta = w = j = theta_m = w_m = 0.0
    for k in range(c.counts[i], -1, -1):
        of = at + 5 * k
        theta, w, j = theta * s + c.terms[of], w * s + c.terms[of + 1], j * s + c.terms[of + 2]
        if c.two_body > 0:
            theta_m, w_m = theta_m * s + c.terms[of + 3], w_m * s + c.terms[of + 4]
    if c.two_body <= 0:
        theta_m, w_m = c.terms[at + 3], c.terms[at + 4]
    return with_drive(c, State(theta, w, j, theta_m, w_m), drive, tau, a_emf)


@unit(L(C, F, X, M, F, F, F, F))
def _expand_driven(c, t, x, m, drive, tau, a_emf, span):
    """The same under what laws add: parabolas through its begin, middle and end."""
    f, _, r = beside(c, 0.0, t, x, m)
    if not _expand(c, x, m, drive, tau, a_emf, span, (f, 0.0, 0.0), (r, 0.0, 0.0)):
        return False
    f_m, _, r_m = beside(c, 0.0, t + 0.5 * span, expanded(c, drive, tau, a_emf, 0.5), m)
    _expand(c, x, m, drive, tau, a_emf, span, (f, 2.0 * (f_m - f), 0.0), (r, 2.0 * (r_m - r), 0.0))
    f_e, _, r_e = beside(c, 0.0, t + span, expanded(c, drive, tau, a_emf, 1.0), m)
    return _expand(c, x, m, drive, tau, a_emf, span, parabola(f, f_m, f_e), parabola(r, r_m, r_e))


@inline
def expand(c, t, x, m, drive, tau, a_emf, span):
    """Expand the flow from x over a span [s]; False where there is no expansion of it: of one body under laws, which
    may be stiffer than parabolas bear, of a bristle that bends, of a shaft that hardens, which is as stiff as it is
    twisted.
    """
    if is_linear(c, m):
        return _expand(c, x, m, drive, tau, a_emf, span, NONE, NONE)
    return is_parted(c) and c.harden <= 0 and _expand_driven(c, t, x, m, drive, tau, a_emf, span)
