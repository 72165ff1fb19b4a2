"""Recordings: read, checked, locked, and prepared for a fit.

formats/ (files to tables) -> tables -> units, expressions, mapping (what a person says of the columns) -> columns
(which is what) -> sensor_faults (what an instrument shows) -> checks (refused, told) -> consistency/ (data before
physics) -> recording -> inspection (before anything is fitted); streaming (the same as it arrives) -> quantisation (a
coarse converter) -> channels -> prepared (traces, as a fit sees them) -> excitation (inputs to ask for),
frequency_response
"""
