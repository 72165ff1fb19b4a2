"""Parameters from a stream."""
