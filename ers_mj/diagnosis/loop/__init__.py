"""The same job for a servo that is told a position: pipeline -> case -> document (state, rows, advice)."""
