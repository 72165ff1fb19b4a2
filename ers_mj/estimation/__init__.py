"""Parameters from recordings, by simulating them.

objective (the block cost C) -> jacobian -> descent (at one tau) -> fit (from afar, out of local minima)
initial_guess, scales -> search; initial_state -> baseline (what every diagnosis begins with)
intervals; known_model (of a datasheet)
"""
