"""The linear flow of a mode as polynomials in time, made once and asked for many instants: what events are located on.

A span is cut into pieces of about one time constant, each of which has its Taylor series, to machine precision; they
lie in the plant's record.
"""

from __future__ import annotations

from ers_mj.plants.compiled import inline, unit
from ers_mj.plants.flow import balance, is_small, next_term, steps_of
from ers_mj.plants.state import MOST_PIECES, MOST_TERMS, C, F, L, M, State, X, with_drive


@inline
def _put(c, at, v):
    c.terms[at], c.terms[at + 1], c.terms[at + 2], c.terms[at + 3], c.terms[at + 4] = (
        v.theta,
        v.w,
        v.j,
        v.theta_m,
        v.w_m,
    )


@unit(L(C, X, M, F, F, F, F))
def expand(c, x, m, drive, tau, a_emf, span):
    """Expand the flow from x over a span [s]; False where that takes more pieces than it has."""
    b = balance(c, m, 0.0, 0.0)
    n = steps_of(c, b, tau, a_emf, span)
    if n > MOST_PIECES:
        return False
    c.pieces, h = n, span / n
    for i in range(n):
        at, v = i * MOST_TERMS * 5, x
        _put(c, at, v)
        for k in range(1, MOST_TERMS):
            v = next_term(c, m, b, v, drive, tau, a_emf, h / k, 1.0 if k == 1 else 0.0)
            x = State(x.theta + v.theta, x.w + v.w, x.j + v.j, x.theta_m + v.theta_m, x.w_m + v.w_m)
            c.counts[i] = k
            _put(c, at + 5 * k, v)
            if k > 2 and is_small(v, x):
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
        theta_m, w_m = theta_m * s + c.terms[of + 3], w_m * s + c.terms[of + 4]
    return with_drive(c, State(theta, w, j, theta_m, w_m), drive, tau, a_emf)
