"""A model where it is used: one file a target, with a sentence for each thing that the target cannot carry.

portable (a model as plain numbers and text) and stepping (the scheme, in Python; translation: in C) serve what runs
code; base says what a target is, targets lists them, and with each what it loses
"""
