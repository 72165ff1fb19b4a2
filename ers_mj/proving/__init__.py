"""The proof: servos with concealed effects, recorded in MuJoCo, diagnosed blind, scored.

    catalogue, laws -> quick, servo -> sizing -> mechanism -> recorder -> case -> sealing -> asking -> scoring

What makes the cases shares no law with the package: it imports nothing from `ers_mj.effects`, nor anything that does.
"""
