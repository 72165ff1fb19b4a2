"""What an effect promises to explain: to first order along a model's motion, and by simulated secants."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from servo import SPARSE, TRUTH, having, recorded, started

from ers_mj.effects import BY_NAME
from ers_mj.estimation.objective import run_of
from ers_mj.selection.secants import View, first_order, hopeful, promise, view_of
from ers_mj.servo.model import OBSERVER_RATE


def seen(model, traces) -> View:
    """What a model's run shows."""
    return view_of(run_of(model, traces, OBSERVER_RATE), traces, 1.0)[0]


def true_model(start):
    """The servo as it is, but for what is missing."""
    return replace(start.fit.model, values={**start.fit.model.values, **TRUTH})


@dataclass(frozen=True)
class Watched(View):
    """A view that notes the sizes at which it is asked for secants."""

    sizes: list = field(default_factory=list)

    def secant(self, effect, start):
        self.sizes.append(start[0])
        return super().secant(effect, start)


def test_a_small_wave_is_promised_by_a_large_start():
    """Cogging of 1 % of the friction: a start that is 30 times as large throws the rudder elsewhere, and tells only how
    small to try again.
    """
    cog = np.array([1.0, 2 * np.pi / 267, 1.3, np.inf, np.inf])
    start = started(recorded([("cogging", cog)], names=("multisine", "ramp")))
    view = seen(start.fit.model, start.traces)
    share, model = promise(view, BY_NAME["cogging"], np.array([30.0, cog[1], 0.0, np.inf, np.inf]), 1.0)
    A, _, phase = dict(model.effects)["cogging"][:3]
    assert share > 0.3 and abs(A * np.exp(1j * phase) - np.exp(1.3j)) < 0.3


@pytest.mark.parametrize("lost, size", [(0, np.inf), (0, np.nan), (2, 1e200)])
def test_a_tangent_that_runs_away_promises_nothing(pushed, monkeypatch, lost, size):
    """Beside a stiff bristle a law's tangent may leave all bounds: the start is passed over, and the other ones are
    compared.
    """
    model, effect = pushed.fit.model, BY_NAME["load_dependent_friction"]
    view = seen(model, pushed.traces)
    starts = [times * effect.starts(model.scales)[0] for times in (1.0, 1.1, 1.2, 1.3, 1.4)]
    changes = type(model).changes
    monkeypatch.setattr(
        type(model), "changes", lambda *a: changes(*a) + np.where(np.arange(len(starts)) == lost, size, 0.0)
    )
    told = first_order(view, effect, starts)
    shares = [share for share, _ in told]
    some = hopeful(effect, starts, told, 3)
    assert len(shares) == 5 and shares[lost] == 0.0 < np.min(np.delete(shares, lost))
    assert len(some) == 3 and all(start is not starts[lost] for start, _ in some)


def test_the_first_order_tells_the_size_at_which_a_secant_is_taken(pushed):
    """A drag of 20 times what acts, or half of it, is simulated once, at nearly the size that acts."""
    effect = BY_NAME["quadratic_drag"]
    acts = np.append(0.5, np.full(len(effect.parameters) - 1, np.inf))
    view = Watched(**vars(seen(true_model(pushed), recorded([("quadratic_drag", acts)], t=SPARSE))))
    for times in (0.5, 1.0, 20.0):
        start = np.append(times * acts[0], acts[1:])
        ((share, size),) = first_order(view, effect, [start])
        promised, found = promise(view, effect, start, size)
        assert share > 0.3 and promised > 0.3 and 0.5 < dict(found.effects)["quadratic_drag"][0] / acts[0] < 2.0
    assert len(view.sizes) == 3 and np.ptp(view.sizes) < 0.05 * np.mean(view.sizes)


def test_waves_are_told_apart_by_half_the_samples(pushed):
    """The shares of gusts from samples 2 ms apart are those from all, 1 ms apart."""
    effect = BY_NAME["periodic_gust"]
    gust = np.append([8.0, 3.1, 0.4], np.full(len(effect.parameters) - 3, np.inf))
    whole = seen(true_model(pushed), recorded([("periodic_gust", gust)]))
    sparse, starts = whole.sparse(), effect.starts(whole.place.scales)
    assert whole.traces[0].sample_time < 0.0015 < 0.0019 < sparse.traces[0].sample_time
    all_told, told = ([share for share, _ in first_order(some, effect, starts)] for some in (whole, sparse))
    assert np.argmax(told) == np.argmax(all_told) and np.max(np.abs(np.subtract(told, all_told))) < 0.1 * max(all_told)


def test_beside_a_shaft_the_starts_of_a_wave_are_chosen_along_the_motion_of_one_body(pushed):
    """A cog of a motor that a shaft of 20 Hz parts from the rudder: the start of the nearest period is among the few
    that are simulated.
    """
    period, shaft = 0.03, np.array([20.0, 0.1, 0.5, 0.2, np.inf])
    laws = [("shaft_compliance", shaft), ("cogging", np.array([12.0, period, 0.4, np.inf, np.inf]))]
    model = true_model(pushed).with_effect("shaft_compliance", shaft)
    view, effect = seen(model, recorded(laws)), BY_NAME["cogging"]
    starts = effect.starts(model.scales)
    chosen = [start[1] for start, _ in hopeful(effect, starts, first_order(view.sparse(), effect, starts), 3)]
    assert len(chosen) == 3 and min((start[1] for start in starts), key=lambda p: abs(1.0 / p - 1.0 / period)) in chosen


def test_what_bends_a_bristle_tells_no_size(pushed):
    """Its tangents may run away: laws with many starts are chosen by them, and simulated as they are."""
    bristle = having(pushed.fit, "presliding").model
    view = seen(bristle, pushed.traces)
    cog, torque = BY_NAME["cogging"], BY_NAME["bias_torque"]
    assert {size for _, size in first_order(view.sparse(), cog, cog.starts(bristle.scales))} == {1.0}
    assert first_order(view, torque, torque.starts(bristle.scales)) == []
