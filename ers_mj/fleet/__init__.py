"""Many servos diagnosed, one row each: resumable, here or on a cluster, the same table whatever ran it.

manifest (checked before the work) -> recordings read -> tasks (workers/) -> OUT/NAME/ as diagnose writes, and its row
-> batch.csv in the manifest's order, the page
"""
