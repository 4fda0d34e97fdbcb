"""Two crosslinked filaments and a particle."""

import openmm
from openmm import app

from openmm_cylchain import Crosslinks, Filaments
from support.equilibrium_cases import CASES
from support.solvent import TEMPERATURE, VISCOSITY


def crosslinked_filaments(engine, stock=False, **options):
    """Two filaments and a particle; a link between nodes, one between attachment points, one to the particle."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    kind = CASES["kratky-porod"].type
    topology, system = app.Topology(), openmm.System()
    topology.addAtom("P", None, topology.addResidue("PRT", topology.addChain()))
    system.addParticle(1.0)
    for y in (0, 30):
        filaments.add_straight(kind, 4, [0, y, 0], [1, 0, 0])
    for number in (0, 1):
        filaments.add_attachment(number, arc_length=150)
    positions = filaments.add_to(topology, system, [[200.0, 60.0, 0.0]])
    attached = filaments.attachment_indices
    nodes = filaments.node_indices
    pairs = [(nodes[0][4], nodes[1][4]), (attached[0], attached[1]), (0, nodes[1][2])]
    pairs = [(int(first), int(second)) for first, second in pairs]
    if stock:
        links = openmm.HarmonicBondForce()
        for pair in pairs:
            links.addBond(*pair, 10.0, 0.02)
        system.addForce(links)
    else:
        links = Crosslinks(0.02, 10.0)
        links.set_pairs(None, pairs)
        links.add_to(system)
    integrator = filaments.create_integrator(
        system, 1e4, particle_friction=1e6, scheme="midpoint", random_seed=3, **options
    )
    return links, system, positions, integrator
