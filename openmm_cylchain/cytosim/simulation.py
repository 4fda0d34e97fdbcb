"""simul and run as [solvent], [box], [contacts] and [simulation]."""

import math

from ..errors import InputError
from .document import EXACT, LEFT_OUT, NEAREST, Note, quantity
from .settings import OFF

_BOLTZMANN = 1.380649e-5
"""In pN um/K."""
_COLDEST = 1e-3
_USUAL_FRAMES, _USUAL_FRAMES_OF_STAGE = 100, 10
_MOST_STEPS_PER_FRAME = 10**7
STILL = 1e8
"""In pN s/um^2: a viscosity in which fibers stand still."""
_NOT_SOLVED = ("off", "0")


def thermal_energy(simul):
    """kT in pN um."""
    kelvin = simul.number("temperature")
    energy = simul.number("kT", "thermal_energy", default=0.0042 if kelvin is None else _BOLTZMANN * kelvin)
    if not 0.0 <= energy < math.inf:
        raise simul.mistake("kT", "must not be negative.")
    return energy


def add_solvent(translation):
    """The [solvent] table."""
    simul, energy = translation.script.simul, translation.thermal_energy
    table = translation.document.table("[solvent]", simul.line)
    temperature = energy / _BOLTZMANN
    if temperature < _COLDEST:
        table.add("temperature", quantity(_COLDEST, "K"), Note(NEAREST, "kT = 0", simul.line_of("kT")))
    else:
        table.add("temperature", quantity(temperature, "K"), Note(EXACT, f"kT = {energy:g} pN um", simul.line_of("kT")))
    if not 0.0 < translation.viscosity < math.inf:
        raise simul.mistake("viscosity", "must be positive.")
    viscosity, note = translation.viscosity, Note(EXACT, "that is Pa s", simul.line_of("viscosity"))
    run = translation.script.run
    if run is not None and run.text("solve", default="on") in _NOT_SOLVED:
        note = Note(NEAREST, f"solve = off: fibers stand still in it, and not in {viscosity:g}", run.line_of("solve"))
        viscosity = max(viscosity, STILL)
    table.add("viscosity", quantity(viscosity, "pN*s/um^2"), note)
    flow = simul.vector("flow")
    if flow is not None and any(flow):
        table = translation.document.table("[flow]", simul.line_of("flow"))
        table.add("velocity", [quantity(own, "um/s") for own in flow], Note(EXACT, "flow"))


def contact_diameter(translation, fiber):
    """The distance in um at which fibers of a Property touch each other, or None if nothing touches them."""
    settings = fiber.settings
    if translation.script.simul.text("steric") in OFF or settings.text("steric") in OFF:
        return None
    return max(0.0, 2.0 * settings.number(("steric", 1), "steric_radius", default=0.0)) or None


def add_contacts(translation):
    """The [contacts] table, if fibers or bodies touch each other, and what tables of fibers say of it."""
    simul, fibers = translation.script.simul, translation.fibers_made()
    diameters = {fiber.name: contact_diameter(translation, fiber) for fiber in fibers}
    for fiber in fibers:
        extra = fiber.settings.number(("steric", 2), "steric_range", default=0.0)
        pull = simul.number(("steric", 2), "steric_stiff_pull", default=0.0)
        if diameters[fiber.name] and extra > 0.0 and pull > 0.0:
            line = fiber.settings.line_of("steric")
            translation.left_out(f"the attraction of {fiber.name} beyond contact", line, "contacts that attract")
    bodies = [own for own in translation.bodies if own.steric is not None]
    touching = [name for name, own in diameters.items() if own is not None]
    largest = max((diameters[name] for name in touching), default=None)
    if largest is None and not bodies:
        return
    table = translation.document.table("[contacts]", simul.line_of("steric"))
    if largest is not None:
        table.add("diameter", quantity(largest, "um"), Note(EXACT, "twice the radius of steric"))
    for of_fibers, fiber in translation.tables_by_fiber:
        own, line = diameters.get(fiber.name), fiber.settings.line_of("steric")
        if own is None:
            of_fibers.add("contacts", False, Note(EXACT, "steric is off", line))
        elif own != largest:
            of_fibers.add("contact_diameter", quantity(own, "um"), Note(EXACT, "twice the radius of steric", line))
    stiffness = simul.number(("steric", 1), "steric_stiff_push", default=0.0)
    if stiffness > 0.0:
        note = Note(NEAREST, "of each crossing; Cytosim's is of vertices") if touching else Note(EXACT, "")
        table.add("stiffness", quantity(stiffness, "pN/um"), note)
    names = dict.fromkeys([*touching, *(own.property for own in bodies)])
    keys = {name: translation.script.properties[name].settings.text("steric") for name in names}
    if len(set(keys.values())) > 1:
        text = f"keys of steric, of which all touch all: {', '.join(f'{name} {key}' for name, key in keys.items())}"
        table.comment(Note(LEFT_OUT, text, simul.line_of("steric"), "contacts between some of those that have some"))


def add_box(translation):
    """The [box] of a periodic space."""
    space = translation.space()
    if space is None or not space.edges:
        return
    known = [edge for edge in space.edges if edge]
    edges = [edge or max(4.0 * half, min(known)) for edge, half in zip(space.edges, space.half)]
    table = translation.document.table("[box]")
    note = Note(EXACT, f"space of the shape {space.shape}; of an edge that does not repeat, any length")
    table.add("edges", [quantity(edge, "um") for edge in edges], note)


def add_simulation(translation):
    """The [simulation] table."""
    script, simul = translation.script, translation.script.simul
    table = translation.document.table("[simulation]", None if script.run is None else script.run.line)
    steps, run = translation.steps, script.run
    table.add(
        "time_step",
        quantity(script.time_step, "s"),
        Note(EXACT, "see openmm-cylchain timestep", simul.line_of("time_step")),
    )
    frames = script.frames
    usual = _USUAL_FRAMES if steps * script.time_step == translation.duration else _USUAL_FRAMES_OF_STAGE
    per_frame = max(1, math.ceil(steps / (frames if frames > 0 else usual)))
    if per_frame > _MOST_STEPS_PER_FRAME:
        raise InputError(f"{steps} steps are too many for {frames} frames.")
    whole = per_frame * math.ceil(steps / per_frame)
    exact = whole == steps and run is not None
    text = f"{steps} steps" if run is not None else "there is no run"
    table.add("duration", quantity(whole * script.time_step, "s"), Note(EXACT if exact else NEAREST, text))
    table.add(
        "report_interval",
        quantity(per_frame * script.time_step, "s"),
        Note(EXACT if exact and frames else NEAREST, f"nb_frames = {frames}"),
    )
    seed = simul.number("random_seed", default=0.0)
    table.add("seed", int(seed) if 0 < seed < 2**31 else 1)
    table.add("platform", "CPU")
    if run is not None:
        _read_run(translation, run)


def _read_run(translation, run):
    for key in ("nb_steps", "duration", "time", "nb_frames"):
        run.values(key)
    mode = run.text("solve", default="on")
    if mode not in (*_NOT_SOLVED, "on", "auto", "1"):
        translation.left_out(f"solve = {mode}", run.line_of("solve"), f"solve = {mode}")
