"""Which forces of a System are those of chains, and which couple chains."""

from typing import Any

import openmm

from ..engine_choice import load_plugin


def is_coupling(force: openmm.Force) -> bool:
    """Whether a force is a CylinderChainCoupling of the plugin: links, contacts, walls, linkers."""
    plugin: Any = load_plugin()
    return plugin is not None and plugin.CylinderChainCoupling.isinstance(force)


def is_chain_force(force: openmm.Force) -> bool:
    """Whether a force is one that an engine adds for filaments by themselves."""
    return force.getName().startswith("CylinderChain") and not is_coupling(force)
