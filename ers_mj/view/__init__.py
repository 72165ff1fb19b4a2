"""The plant in motion."""
