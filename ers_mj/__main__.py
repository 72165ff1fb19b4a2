"""``python -m ers_mj`` is ``ers``."""

from ers_mj.cli import main

raise SystemExit(main())
