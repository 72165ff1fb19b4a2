"""Two diagnoses beside each other: what differs between them beyond chance.

diagnosis.json, twice -> documents (read, refused where they cannot be compared) -> differences (a test each) -> chance
(all tests together)
"""
