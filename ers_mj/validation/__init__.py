"""The reduced model against the mechanical plant."""
