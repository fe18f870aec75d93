"""Everything of the benchmark that was chosen, in one frozen object: sizes, rigs, population, bench, protocol."""

from dataclasses import dataclass, field

from prb3r.proof.settings.bench import Imperfections
from prb3r.proof.settings.population import Foreign, Labels, Population
from prb3r.proof.settings.protocol import Protocol
from prb3r.proof.settings.real import RealRigs
from prb3r.proof.settings.rigs import Cameras, Manipulators, Programs
from prb3r.proof.settings.sizes import Sizes


@dataclass(frozen=True)
class ProofSettings:
    """What a run of the benchmark consists of; the ranges of the effects stand in their records."""

    sizes: Sizes = field(default_factory=Sizes)
    manipulators: Manipulators = field(default_factory=Manipulators)
    programs: Programs = field(default_factory=Programs)
    cameras: Cameras = field(default_factory=Cameras)
    population: Population = field(default_factory=Population)
    labels: Labels = field(default_factory=Labels)
    foreign: Foreign = field(default_factory=Foreign)
    imperfections: Imperfections = field(default_factory=Imperfections)
    real: RealRigs = field(default_factory=RealRigs)
    protocol: Protocol = field(default_factory=Protocol)


SETTINGS = ProofSettings()
