"""Closed forms to hold simulations against: chain statistics, forces, energies and free diffusion.

Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360. Arguments are ``openmm.unit``
quantities or plain numbers in OpenMM's units; results are plain numbers or arrays in OpenMM's units (nm,
ps, kJ/mol). Every function raises InputError for values that are not finite, have the wrong unit or lie
outside the stated range. Functions of the discrete chain are exact for the model that is simulated, at
any stiffness, and those of beam elements but for products of strains and bends; the others belong to the
continuous wormlike chain (WLC).
"""

from ..bead_spring.equilibrium import (
    bead_spring_bending_energies,
    bead_spring_bond_correlations,
    bead_spring_mean_lengths,
    bead_spring_mean_square_distances_from_center,
    bead_spring_mean_square_end_to_end,
    bead_spring_mean_square_lengths,
    bead_spring_mean_square_radius_of_gyration,
    bead_spring_mode_variances,
    bead_spring_persistence_length,
    bead_spring_stretching_energies,
)
from ..bead_spring.modes import bead_spring_mode_rates
from .beam_elements import (
    beam_bending_energy_mean,
    beam_mean_square_end_to_end,
    beam_persistence_length,
    beam_stretching_energy_mean,
    beam_tangent_correlation,
)
from .calibrated_chain import calibrated_up_to_force
from .discrete_chain import (
    chain_bending_mode_variance,
    chain_mean_energies,
    chain_mean_square_end_to_end,
    chain_mean_square_radius_of_gyration,
    chain_persistence_length,
    chain_planar_bending_mode_variance,
    chain_tangent_correlation,
    mean_joint_cosine,
)
from .energies import bending_energy_mean, bending_energy_variance, stretching_energy_mean, stretching_energy_variance
from .force_extension import (
    chain_extension,
    crossover_force,
    effective_spring_constant,
    limiting_spring_constant,
    linear_force,
    long_chain_extension,
    marko_siggia_extension,
    marko_siggia_force,
    marko_siggia_spring_constant,
    wlc_relative_extension,
    wlc_share_of_force,
)
from .free_segment import (
    free_segment_mean_square_displacement,
    long_time_mean_square_displacement,
    mean_orientation,
    short_time_mean_square_displacement,
)
from .twisted_chain import (
    TwistedChain,
    chain_mean_turn_cosine,
    chain_twist_variance,
    critical_torque,
    ring_buckling_turns,
    twisted_chain,
)
from .wormlike_chain import (
    bending_mode_variance,
    clamped_angle_variance,
    clamped_deflection_variance,
    wlc_j_factor,
    wlc_mean_square_end_to_end,
    wlc_tangent_correlation,
)

__all__ = [
    "TwistedChain",
    "bead_spring_bending_energies",
    "bead_spring_bond_correlations",
    "bead_spring_mean_lengths",
    "bead_spring_mean_square_distances_from_center",
    "bead_spring_mean_square_end_to_end",
    "bead_spring_mean_square_lengths",
    "bead_spring_mean_square_radius_of_gyration",
    "bead_spring_mode_rates",
    "bead_spring_mode_variances",
    "bead_spring_persistence_length",
    "bead_spring_stretching_energies",
    "beam_bending_energy_mean",
    "beam_mean_square_end_to_end",
    "beam_persistence_length",
    "beam_stretching_energy_mean",
    "beam_tangent_correlation",
    "bending_energy_mean",
    "bending_energy_variance",
    "bending_mode_variance",
    "calibrated_up_to_force",
    "chain_bending_mode_variance",
    "chain_extension",
    "chain_mean_energies",
    "chain_mean_square_end_to_end",
    "chain_mean_square_radius_of_gyration",
    "chain_mean_turn_cosine",
    "chain_persistence_length",
    "chain_planar_bending_mode_variance",
    "chain_tangent_correlation",
    "chain_twist_variance",
    "clamped_angle_variance",
    "clamped_deflection_variance",
    "critical_torque",
    "crossover_force",
    "effective_spring_constant",
    "free_segment_mean_square_displacement",
    "limiting_spring_constant",
    "linear_force",
    "long_chain_extension",
    "long_time_mean_square_displacement",
    "marko_siggia_extension",
    "marko_siggia_force",
    "marko_siggia_spring_constant",
    "mean_joint_cosine",
    "mean_orientation",
    "ring_buckling_turns",
    "short_time_mean_square_displacement",
    "stretching_energy_mean",
    "stretching_energy_variance",
    "twisted_chain",
    "wlc_j_factor",
    "wlc_mean_square_end_to_end",
    "wlc_relative_extension",
    "wlc_share_of_force",
    "wlc_tangent_correlation",
]
