"""Many tasks on many workers: processes of this machine, or those of a Dask cluster that is there already.

tasks (a function and what it takes) -> crew (here | cluster) -> what each came to, as it comes, each exactly once

Whoever hands out tasks gets the same values from either crew: a task depends on what it takes alone.
"""
