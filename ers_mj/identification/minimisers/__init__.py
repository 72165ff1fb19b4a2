"""The minimisers: one a file, each on the interface of base.py."""

from ers_mj.identification.minimisers.base import Minimiser, Minimum
from ers_mj.identification.minimisers.cma import CMA
from ers_mj.identification.minimisers.de import DE
from ers_mj.identification.minimisers.ga import GA
from ers_mj.identification.minimisers.iga import IGA
from ers_mj.identification.minimisers.iga_rotated import RotatedIGA
from ers_mj.identification.minimisers.ls import LS
from ers_mj.identification.minimisers.pso import PSO

MINIMISERS: dict[str, Minimiser] = {m.name: m for m in (LS(), IGA(), RotatedIGA(), GA(), PSO(), CMA(), DE())}

__all__ = ["MINIMISERS", "LS", "Minimiser", "Minimum"]
