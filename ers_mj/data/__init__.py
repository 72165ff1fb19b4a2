"""Recordings: read, checked, locked, and prepared for a fit.

tables (CSV, Parquet) -> columns (which is what) -> sensor_faults (what an instrument shows) -> checks (refused, told)
-> recording; streaming (the same as it arrives) -> quantisation (a coarse converter) -> prepared (traces, as a fit
sees them) -> excitation (inputs to ask for), frequency_response
"""
