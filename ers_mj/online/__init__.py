"""Parameters from a stream, while the servo runs.

horizon (how a stream is followed) -> window (its last seconds, fitted) -> moving_horizon (one estimate after another)
"""
