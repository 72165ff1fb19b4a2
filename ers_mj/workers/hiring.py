"""Which workers a command gets."""

from __future__ import annotations

from ers_mj.workers.base import Crew
from ers_mj.workers.here import Here


def crew(jobs: int, address: str | None = None) -> Crew:
    """Processes here, or the workers of a cluster.

    Raises:
        InputError: the cluster cannot be used.
        MissingPackage: a cluster is asked for and dask is not installed.
    """
    if address is None:
        return Here(jobs)
    from ers_mj.workers.cluster import Cluster

    return Cluster(address)
