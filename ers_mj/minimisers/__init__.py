"""The minimisers: one a file, each on the interface of base.py."""

from ers_mj.minimisers.base import Minimiser, Minimum
from ers_mj.minimisers.cma import CMA
from ers_mj.minimisers.de import DE
from ers_mj.minimisers.ga import GA
from ers_mj.minimisers.iga import IGA
from ers_mj.minimisers.iga_rotated import RotatedIGA
from ers_mj.minimisers.ls import LS
from ers_mj.minimisers.pso import PSO

MINIMISERS: dict[str, Minimiser] = {m.name: m for m in (LS(), IGA(), RotatedIGA(), GA(), PSO(), CMA(), DE())}

__all__ = ["MINIMISERS", "LS", "Minimiser", "Minimum"]
