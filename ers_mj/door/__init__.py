"""What Python calls, and the command line behind it: one function a job, results that show and save themselves.

reading (recordings in) -> diagnosing, identifying, simulating, validating (a job and its result each) -> model (what
comes out, for other tools; losses: what they cannot carry)
known: a servo in whatever form it is given; together: what recordings of one call must have in common; results: what
all results can; saving: files, whole or not at all
"""
