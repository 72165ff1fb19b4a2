"""Control laws in a loop, and what they are worth.

references, controllers/ -> closed_loop -> metrics -> trial (all combinations) -> monte_carlo (on many servos),
paper_claims;  gains (of the finite-time law);  frequency/ (the same loops over frequency)
"""
