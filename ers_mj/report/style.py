"""How figures look: the colours, the widths and what matplotlib is told, alike on every page. What a colour is on a
dark page stands in figures.css.
"""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.colors import LinearSegmentedColormap


@dataclass(frozen=True)
class Style:
    """The colours of what is drawn, and its sizes.

    Attributes:
        measured, before, after: of the three curves that every page compares; ``after`` is what is right or chosen.
        shade: of a region that is marked, as where a model fails.
        grid, ink, faint: of lines behind, of words, and of lines that only guide.
        distortion: of what no linear model explains.
        wide, narrow: of a figure for a desktop and for a phone [in].
        strong: share of the scale of :data:`HEAT` from which numbers upon it are white.
        on_strong, on_weak: of numbers upon a cell of :data:`HEAT`, alike on light and dark pages.
    """

    measured: str = "#a3afbc"
    before: str = "#d9762b"
    after: str = "#0b7a75"
    shade: str = "#f3c64e"
    grid: str = "#e6e9ee"
    ink: str = "#3b4654"
    faint: str = "#8b95a3"
    distortion: str = "#a83a1e"
    wide: float = 9.8
    narrow: float = 4.5
    strong: float = 0.55
    on_strong: str = "#fdfdfd"
    on_weak: str = "#333e4b"

    @property
    def settings(self) -> dict[str, object]:
        """What matplotlib is told, for its `rc_context`."""
        return {
            "svg.fonttype": "none",
            "savefig.facecolor": "none",
            "axes.facecolor": "none",
            "text.color": self.ink,
            "font.family": "sans-serif",
            "font.size": 9.5,
            "axes.edgecolor": "#c3cad3",
            "axes.labelcolor": self.ink,
            "xtick.color": self.ink,
            "ytick.color": self.ink,
            "axes.grid": True,
            "grid.color": self.grid,
            "axes.axisbelow": True,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "lines.linewidth": 1.3,
            "legend.frameon": False,
            "path.simplify": True,
            "svg.hashsalt": "ers",
            "axes.titlesize": 10,
            "axes.titlelocation": "left",
        }

    def on_heat(self, share: float) -> str:
        """The colour of a number on a cell at this share of the scale."""
        return self.on_strong if share > self.strong else self.on_weak


STYLE = Style()
HEAT = LinearSegmentedColormap.from_list("heat", ["#f4f6f8", "#f6d9a8", "#e2893a", "#a83a1e", "#4c1512"], N=32)
