"""Which effects do the recordings ask for?

stepwise (the loop) -> candidates (a round): screening (secants, impulse_search) -> refits -> overlooked -> finishing
         -> comparison (what each has won, who leads; posterior: how probable) -> decisions/
         -> moves: drop, swap, pair, sweep
cross_validation -> confirmation (held out) -> confounders (laws without a name); whiteness: what is left by memory
bench: what a selection works on; budget: how far it goes
"""
