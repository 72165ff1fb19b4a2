"""The proof: servos with concealed effects, recorded in MuJoCo, diagnosed blind, scored.

    plant (numbers) -> laws; concealed/ -> catalogue -> sampling -> quick -> servo, waves -> sizing -> strength, forms
    -> mechanism -> recorder -> case | real -> sealing -> asking -> conduct; parameters -> scoring

What makes the cases shares no law with the package: it imports nothing from `ers_mj.effects`, nor anything that does.
"""
