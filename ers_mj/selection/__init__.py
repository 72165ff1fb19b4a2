"""Which effects do the recordings ask for?"""
