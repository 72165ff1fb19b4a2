"""Numerical methods that know nothing of servos."""
