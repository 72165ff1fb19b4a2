"""`ers completion`: what a shell needs to complete commands, options and their values."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

SHELLS = ("bash", "zsh", "fish")
INSTALLED = {
    "bash": "ers completion bash > ~/.local/share/bash-completion/completions/ers",
    "zsh": "ers completion zsh >> ~/.zshrc",
    "fish": "ers completion fish > ~/.config/fish/completions/ers.fish",
}
Options = dict[str, tuple[str, ...]]  # --option -> its values, none where they are not a list


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "completion",
        help="print a script by which a shell completes commands and options",
        description="Print a completion script; no package is needed for it, and it does not start ers.",
        epilog="examples:\n" + "\n".join(f"  {line}" for line in INSTALLED.values()),
    )
    parser.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))
    parser.set_defaults(run=run, parsers=commands.choices)


def run(arguments: argparse.Namespace) -> int:
    """Print the script; 0."""
    found = {name: _options(parser) for name, parser in arguments.parsers.items()}
    print(_fish(found) if arguments.shell == "fish" else _bash(found, arguments.shell))
    return 0


def _options(parser: argparse.ArgumentParser) -> Options:
    return {
        option: tuple(map(str, action.choices or ()))
        for action in parser._actions
        for option in action.option_strings
        if option.startswith("--")
    }


def _bash(commands: Mapping[str, Options], shell: str) -> str:
    """For bash, and for zsh by its reading of bash's."""
    lines = ["autoload -U +X bashcompinit && bashcompinit"] if shell == "zsh" else []
    lines += ["_ers() {", '  local cur="${COMP_WORDS[COMP_CWORD]}" prev="${COMP_WORDS[COMP_CWORD-1]}" words=""']
    lines += ['  if [ "$COMP_CWORD" -eq 1 ]; then', f'    words="{" ".join(commands)} --help --version"', "  else"]
    lines += ['    case "${COMP_WORDS[1]}:$prev" in']
    for name, options in commands.items():
        lines += [f'      {name}:{o}) words="{" ".join(values)}" ;;' for o, values in options.items() if values]
    lines += ["      *)", '        case "$cur" in -*)', '          case "${COMP_WORDS[1]}" in']
    lines += [f'            {name}) words="{" ".join(options)}" ;;' for name, options in commands.items()]
    lines += ["          esac ;;", "        esac ;;", "    esac", "  fi"]
    lines += ['  COMPREPLY=($(compgen -W "$words" -- "$cur"))', "}", "complete -o default -F _ers ers"]
    return "\n".join(lines)


def _fish(commands: Mapping[str, Options]) -> str:
    """For fish."""
    lines = [f'complete -c ers -n __fish_use_subcommand -f -a "{" ".join(commands)}"']
    for name, options in commands.items():
        within = f'complete -c ers -n "__fish_seen_subcommand_from {name}"'
        for option, values in options.items():
            lines.append(f"{within} -l {option[2:]}" + (f' -x -a "{" ".join(values)}"' if values else ""))
    return "\n".join(lines)
