"""What is known of a servo: its datasheet, its model, and recordings simulated with known truth.

datasheet (a file; model_file writes one) -> simulation (effects in a reader's units, columns of a recording); free
(what may be fitted) -> model (a structure with values, and what it predicts of a recording)
"""
