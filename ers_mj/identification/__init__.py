"""Identification, `ers identify`: parameters from recordings, and which these can tell.

unknowns (what is searched) -> structure (what can be told) -> misfit (Eq. 13), rollouts (the same in MuJoCo)
-> finding (the search, by one of minimisers/) -> precision (how surely) -> rows -> answer (model, sentence);
estimate is all of it
"""
