"""The plant in motion, to be looked at.

model_file, replay, looped (what moves how) -> rendering (pictures) -> frames (for a report), window (the live viewer)
"""
