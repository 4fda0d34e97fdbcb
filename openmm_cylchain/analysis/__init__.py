"""Analysis of runs, which ``load`` reads, and of trajectories in mdtraj; ``statistics`` has errors of series."""

from ..couplings.contact_frames import ContactFrame
from ..couplings.crosslink_records import CrosslinkFrame
from ..filaments.spare_nodes import count_nodes
from ..filaments.topology_nodes import filament_nodes, ring_filaments
from ..output.read_tables import read_growth
from . import statistics
from .bending import (
    TangentCorrelation,
    bending_drift,
    bending_mode_amplitudes,
    joint_cosines,
    persistence_length,
    tangent_correlation,
)
from .crossings import CrossingCounter, Crossings, find_crossings
from .diffusion import MeanSquareDisplacement, mean_square_displacement
from .filament_shapes import (
    centers_of_mass,
    contour_lengths,
    end_to_end_vectors,
    filament_curves,
    node_positions,
    radii_of_gyration,
    segment_lengths,
    tangents,
)
from .linking import linking_number, writhe
from .loops import ContactProbability, contact_counts, contact_probability, loop_lengths, write_cooler
from .moduli import RelaxationModulus, relaxation_modulus
from .networks import contact_map, contraction, filament_distances, find_bundles, mesh_size
from .order import director, order_parameter, order_tensor
from .run_filaments import RunFilament, RunParticles
from .run_loading import load
from .runs import Run, RunStage
from .stress import Stress, stress

__all__ = [
    "ContactFrame",
    "ContactProbability",
    "CrosslinkFrame",
    "CrossingCounter",
    "Crossings",
    "MeanSquareDisplacement",
    "RelaxationModulus",
    "Run",
    "RunFilament",
    "RunParticles",
    "RunStage",
    "Stress",
    "TangentCorrelation",
    "bending_drift",
    "bending_mode_amplitudes",
    "centers_of_mass",
    "contact_counts",
    "contact_map",
    "contact_probability",
    "contour_lengths",
    "contraction",
    "count_nodes",
    "director",
    "end_to_end_vectors",
    "filament_distances",
    "filament_curves",
    "filament_nodes",
    "find_bundles",
    "find_crossings",
    "joint_cosines",
    "linking_number",
    "load",
    "loop_lengths",
    "mean_square_displacement",
    "mesh_size",
    "node_positions",
    "order_parameter",
    "order_tensor",
    "persistence_length",
    "radii_of_gyration",
    "read_growth",
    "relaxation_modulus",
    "ring_filaments",
    "segment_lengths",
    "statistics",
    "stress",
    "tangent_correlation",
    "tangents",
    "write_cooler",
    "writhe",
]
