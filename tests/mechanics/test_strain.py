"""Strain and stress of the plates against beam theory."""

from pathlib import Path

import numpy as np
import pytest
from prototype import ELASTICA, cantilever

from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.mechanics.strain import peak_strain, plate_strain
from prb3r.model.manipulator import load_manipulator

ROOT = Path(__file__).parents[2]


def test_a_tip_force_strains_the_root_by_force_times_lever():
    """One straight beam under a small tip force: M = F (l - s), strain = M c / EI, largest at the root."""
    chain = cantilever(1, ELASTICA)
    stiffness, fibre, force = float(chain.stiffness[0, 0] * chain.arc[0] / chain.plate.stiffness[0]), 4e-4, 1e-3
    found = solve_chain(chain, loads(chain, np.zeros((1, 0)), tip=(0.0, force)))
    strain = plate_strain(found, np.array([stiffness]), np.array([fibre]))[0, 0]
    along = np.concatenate([[0.0], (np.polynomial.legendre.leggauss(len(chain.plate.stiffness))[0] + 1) / 2, [1.0]])
    length = chain.arc[0]
    assert strain == pytest.approx(force * length * (1 - along) * fibre / stiffness, abs=1e-6 * strain[0])
    assert peak_strain(found, np.array([stiffness]), np.array([fibre]))[0, 0] == pytest.approx(strain[0])


def test_plates_of_the_prototype_carry_tension_times_lever():
    """A single cable bends every plate by about T d; stress = M (h / 2) / I, here 10 kg on cable 1 without friction."""
    manipulator = load_manipulator(ROOT / "studies/manipulators/two-segment.toml")
    manipulator = manipulator.model_copy(update={"model": "elastica"})
    chain = manipulator.chain()._replace(friction=np.zeros((14, 4)))
    found = solve_chain(chain, loads(chain, [[97.85, 0, 0, 0]]))
    stress = 187e9 * peak_strain(found, manipulator.bending_stiffness, manipulator.outer_fibre)
    inertia = 0.03 * 0.0008**3 / 12
    assert stress[0] == pytest.approx(97.85 * 0.0255 * 0.0004 / inertia * np.ones(14), rel=0.04)
