"""The effects as a page: `python analysis/catalogue.py` writes docs/effects.md from ers_mj/effects."""

import inspect
import re
from pathlib import Path

from ers_mj.effects import BY_NAME, EFFECTS, EQUIVALENT, Effect
from ers_mj.servo.simulation import unit_of

PAGE = Path(__file__).resolve().parents[1] / "docs" / "effects.md"
HEAD = """# Effects

<!-- written by `python analysis/catalogue.py`: edit the effect's own file -->

What `ers diagnose` can name, in the order in which a signal travels. A law is given as the term it adds to Eq. (6),
theta in output units; `ers simulate --effect NAME:key=value,...` puts it into a servo. [A new effect](extending.md) is
one file.
"""
NAMELESS = """## Laws that are never named

These are confounders: each is tried in the place of what is named. Where one explains more, the verdict is
`unexplained`, with the law under `suspects`.
"""
TABLED = """## What stays unknown

Tables without a shape of their own, fitted beside the answer where a mismatch is left, and kept where held-out data
asks for them (`[[remainder]]` in model.toml). They are neither named nor tried in the place of anything.
"""
CLASSES = """## Scored as one

Recordings of angle and voltage cannot always separate these; the answer lists what it could not exclude, and the
[proof](proof.md) counts each group as one class.

{groups}
"""


def catalogue() -> str:
    """The whole page."""
    parts, named = [HEAD], [effect for effect in EFFECTS if effect.named]
    for subsystem in dict.fromkeys(family(effect) for effect in named):
        parts += [f"## {subsystem}\n", *(entry(effect) for effect in named if family(effect) == subsystem)]
    parts += [NAMELESS, *(entry(effect) for effect in EFFECTS if not (effect.named or effect.tabled))]
    parts += [TABLED, *(entry(effect) for effect in EFFECTS if effect.tabled)]
    groups = "\n".join(f"- {', '.join(f'`{name}`' for name in sorted(group))}" for group in EQUIVALENT)
    return "\n".join([*parts, CLASSES.format(groups=groups)])


def family(effect: Effect) -> str:
    """Its base class as a heading."""
    return type(effect).__mro__[1].__name__


def entry(effect: Effect) -> str:
    """One effect: what it is, its law, its numbers, its twin in MuJoCo, what tells it from its neighbours."""
    source = inspect.getmodule(type(effect))
    rows = [
        f"| `{p.name}` | {unit_of(p.kind) or '-'} | {_linked(p.meaning)} |" for p in effect.parameters if not p.recorded
    ]
    return "\n".join(
        [
            f"### {effect.name}\n",
            f"{' '.join(source.__doc__.split())}\n",
            f"**Law.** {_linked(' '.join(inspect.getdoc(type(effect)).split()))}\n",
            "| parameter | unit | meaning |",
            "|---|---|---|",
            *rows,
            "",
            f"**In MuJoCo.** {effect.mjcf.replace('none: ', 'no element; ')}.\n",
            f"**Told apart.** {_linked(effect.apart)}.\n",
        ]
    )


def _linked(text: str) -> str:
    """Names of effects as links; what Markdown would take for emphasis or a link as it is written."""
    text = re.sub(r"``(.+?)``", r"`\1`", text).replace("|", "\\|").replace("*", "\\*").replace("<", "&lt;")
    return re.sub(r"\b[a-z]+_[a-z_]+\b", lambda m: f"[{m[0]}](#{m[0]})" if m[0] in BY_NAME else m[0], text)


if __name__ == "__main__":
    PAGE.write_text(catalogue(), encoding="utf-8")
    print(f"written {PAGE.relative_to(PAGE.parents[1])}")
