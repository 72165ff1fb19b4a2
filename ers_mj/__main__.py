"""``python -m ers_mj`` is ``ers``: signals are heeded from here on, before anything else is loaded."""

from ers_mj.processes.stopping import guarded


def main() -> int:
    """The command line; its exit code."""
    return guarded(_command)


def _command() -> int:
    from ers_mj.cli import main

    return main()


if __name__ == "__main__":
    raise SystemExit(main())
