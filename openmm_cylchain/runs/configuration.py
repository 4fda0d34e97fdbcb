"""The configuration of a run: a TOML file with units, read into frozen dataclasses and checked.

``TABLES`` are its kinds of tables; each has a module in ``tables``, whose list of keys says how they are read, what the
reference and the JSON schema say of them, and what is wrong. Every mistake is a ConfigurationError that names the line,
the table and the key, and says what to do.
"""

import dataclasses
import re
from dataclasses import dataclass
from pathlib import Path

from ..engine_choice import choose_engine
from ..errors import InputError
from ..filaments.twist import has_twist
from ..kinetics.binding_force import BINDING_FORCE_NAME
from ..mechanics.flow import Flow
from .initial_state import recommended_step
from .keys import ConfigurationError, Place, Text
from .stages import read_stages
from .start_files import digest_of, find_start_file
from .table import ACTIVE, UnknownKeyError
from .tables.barriers import BARRIER, check_barriers, read_barrier
from .tables.bodies import BODY, read_body, with_bodies
from .tables.couplings import (
    CONTACTS,
    END_FRAME,
    LINK,
    PULL,
    TETHER,
    Contacts,
    read_contacts,
    read_end_frame,
    read_link,
    read_pull,
    read_tether,
)
from .tables.filament import FILAMENT, MOST_NODES, read_filaments, read_reserve
from .tables.filament_types import PRESETS as PRESETS
from .tables.growth import GROWTH, check_with_others
from .tables.joints import JOINT, read_joint
from .tables.linkers import HAND, LINKERS, binds_to, read_linkers
from .tables.monomers import MONOMERS, check_names, read_monomers
from .tables.nucleation import BRANCHING, NUCLEATION, check_places, read_branching, read_nucleation
from .tables.particles import PARTICLES, read_particles
from .tables.simulation import SIMULATION, SimulationSettings, read_seed, read_simulation
from .tables.solvent import BOX, FLOW, SOLVENT, Solvent, read_flow, read_solvent
from .tables.stages import STAGE
from .tables.walls import WALL, check_walls, read_walls
from .toml_lines import lines_of, read_toml

TABLES = (
    SOLVENT,
    BOX,
    FLOW,
    FILAMENT,
    MONOMERS,
    NUCLEATION,
    BRANCHING,
    PARTICLES,
    BODY,
    LINKERS,
    BARRIER,
    LINK,
    JOINT,
    TETHER,
    PULL,
    END_FRAME,
    CONTACTS,
    WALL,
    SIMULATION,
)
"""All kinds of tables, in the order of the reference."""

# Where a key that a table lacks may belong to, in this order.
_OWNERS = (
    SOLVENT,
    SIMULATION,
    FILAMENT,
    GROWTH,
    MONOMERS,
    NUCLEATION,
    BRANCHING,
    LINKERS,
    HAND,
    BARRIER,
    BOX,
    FLOW,
    PARTICLES,
    BODY,
    LINK,
    JOINT,
    TETHER,
    PULL,
    END_FRAME,
    CONTACTS,
    WALL,
)


@dataclass(frozen=True)
class Configuration:
    """Everything that a run needs.

    ``text`` is the file that it was read from, ``box`` the edges of a box in nm, ``tables`` what was read from each
    table by its name, ``start_files`` the digests of files that filaments start from by their paths, ``lines`` where
    entries stand, ``path`` the name of its file, empty if it has none. Where there are ``stages``, all else is that of
    the first one, but for the steps, which are those of all.
    """

    title: str
    solvent: Solvent
    filaments: tuple
    simulation: SimulationSettings
    text: str = dataclasses.field(compare=False, repr=False)
    box: tuple | None = None
    linkers: tuple = ()
    flow: Flow | None = None
    particles: tuple = ()
    contacts: Contacts | None = None
    walls: tuple = ()
    tethers: tuple = ()
    pulls: tuple = ()
    links: tuple = ()
    joints: tuple = ()
    barriers: tuple = ()
    bodies: tuple = ()
    end_frames: tuple = ()
    monomers: tuple = dataclasses.field(default=(), compare=False)
    tables: dict = dataclasses.field(default_factory=dict, compare=False, repr=False)
    start_files: dict = dataclasses.field(default_factory=dict, compare=False)
    lines: dict = dataclasses.field(default_factory=dict, compare=False, repr=False)
    path: str = dataclasses.field(default="", compare=False, repr=False)
    stages: tuple = dataclasses.field(default=(), compare=False, repr=False)

    @property
    def contacts_of_filaments(self):
        """Whether there are contacts that filaments may feel."""
        return any(group.contact_diameter is not None for group in self.filaments)

    @property
    def relaxes(self):
        """Whether what overlaps comes apart before a run begins."""
        return self.contacts is not None and self.contacts.relax


def read_configuration(path):
    """Read and check a configuration file: a Configuration.

    InputError for a file that cannot be read, is not TOML, or describes no run.
    """
    path = Path(path)
    try:
        # In bytes: reading as text would turn line ends into those of the platform.
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise InputError(f"The configuration {path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"The configuration {path} is not UTF-8 text: save it as UTF-8.") from None
    try:
        return _in_file(parse_configuration(text, path.parent), str(path))
    except InputError as error:
        separator = ", " if str(error).startswith("line ") else ": "
        raise InputError(f"{path}{separator}{error}") from None


def _in_file(configuration, path):
    # What stages share, they share still.
    known = {id(own.configuration): own.configuration for own in configuration.stages}
    named = {key: dataclasses.replace(own, path=path) for key, own in known.items()}
    stages = [dataclasses.replace(own, configuration=named[id(own.configuration)]) for own in configuration.stages]
    return dataclasses.replace(configuration, path=path, stages=tuple(stages))


def parse_configuration(text, folder="."):
    """Read and check the text of a configuration, whose files are named from a folder; see ``read_configuration``."""
    text_of_lines = text.replace("\r\n", "\n")
    entries = read_toml(text_of_lines)
    return configuration_of(entries, text, folder, lines_of(text_of_lines, entries))


def configuration_of(entries, text, folder, lines):
    """Check the tables of a configuration.

    Parameters
    ----------
    entries : dict
        What tomllib made of its text.
    text : str
        What a run keeps.
    folder : str or Path
        From which files are named.
    lines : dict
        Where entries stand, see ``lines_of``.

    Raises
    ------
    ConfigurationError
    """
    try:
        if STAGE.name in entries:
            found = _staged(entries, lambda raw: _configuration(raw, text, Path(folder), lines))
        else:
            found = _configuration(entries, text, Path(folder), lines)
        for own in found.tables["filament"]:
            own.refuse(("delete", "cut"), "belongs to a [[stage]] behind the first one: write [stage.filament] there.")
        return found
    except UnknownKeyError as error:
        raise error.with_suggestion(_OWNERS).with_line(lines) from None
    except ConfigurationError as error:
        raise error.with_line(lines) from None


def _staged(raw, read):
    stages = read_stages(raw, TABLES, read)
    first = stages[0].configuration
    steps = sum(own.configuration.simulation.steps for own in stages)
    return dataclasses.replace(first, stages=stages, simulation=dataclasses.replace(first.simulation, steps=steps))


def _configuration(raw, text, folder, lines):
    tables = _read_tables(raw)
    if CONTACTS.name not in raw:
        _refuse_contact_diameters(tables)
    title = Text().read(raw.get("title", ""), Place("title", ("title",)))
    (solvent,) = map(read_solvent, tables["solvent"])
    box = tables["box"][0]["edges"] if tables["box"] else None
    (settings,) = tables["simulation"]
    walls = tuple(wall for own in tables["wall"] for wall in read_walls(own))
    monomers = tuple(read_monomers(own, box, walls) for own in tables["monomers"])
    check_names(tables["monomers"], monomers)
    groups = _filaments(tables, solvent, box, folder, monomers)
    if not groups:
        _refuse_without_filaments(tables)
    seed = read_seed(settings)
    bodies = tuple(read_body(own, tables, groups, box, seed) for own in tables["body"])
    check_walls(tables["wall"], walls, groups, bodies, [own["name"] for own in tables["particles"]])
    groups = with_bodies(groups, bodies)
    linkers = tuple(read_linkers(own, groups, box, seed, walls, bodies) for own in tables["linkers"])
    check_barriers(tables["barrier"], linkers)
    configuration = Configuration(
        title,
        solvent,
        groups,
        None,
        text,
        box,
        linkers,
        *([read_flow(own) for own in tables["flow"]] or (None,)),
        tuple(read_particles(own, solvent, box) for own in tables["particles"]),
        *([read_contacts(own) for own in tables["contacts"]] or (None,)),
        walls,
        tuple(read_tether(own, groups) for own in tables["tether"]),
        tuple(read_pull(own, groups) for own in tables["pull"]),
        tuple(read_link(own, groups, bodies) for own in tables["link"]),
        tuple(read_joint(own, groups) for own in tables["joint"]),
        tuple(barrier for own in tables["barrier"] for barrier in read_barrier(own, groups)),
        bodies,
        tuple(read_end_frame(own, groups, bodies) for own in tables["end_frame"]),
        monomers,
        tables,
        dict(_start_files(tables["filament"], folder)),
        lines,
    )
    _check_engine(settings, configuration)
    check_with_others(tables, configuration, settings)
    configuration = dataclasses.replace(configuration, filaments=_disturbed(configuration))
    with settings.naming():
        simulation = read_simulation(
            settings, lambda scheme, engine: recommended_step(configuration, scheme, engine, seed).step
        )
    return dataclasses.replace(configuration, simulation=simulation)


def _read_tables(raw):
    # Entries of all tables: a list for each kind.
    known = ("title", *(kind.name for kind in TABLES), STAGE.name)
    for name in raw:
        if name not in known:
            raise UnknownKeyError(Place("the configuration", ()), name, known)
    tables = {}
    for kind in TABLES:
        found = raw.get(kind.name, [] if kind.repeated or not kind.required else {})
        if kind.repeated:
            if not isinstance(found, list) or not all(isinstance(own, dict) for own in found):
                raise ConfigurationError(
                    f"{kind.name!r} must be a list of tables: write {kind.header} with two brackets before each.",
                    (kind.name,),
                )
            places = (
                Place(f"{kind.header} number {number}:", (kind.name, number - 1)) for number in range(1, len(found) + 1)
            )
            tables[kind.name] = [kind.read(own, place) for own, place in zip(found, places)]
        elif found == [] and kind.name not in raw:
            tables[kind.name] = []
        else:
            if not isinstance(found, dict):
                raise ConfigurationError(
                    f"{kind.name!r} must be a table: write {kind.header} once, with its keys below it.", (kind.name,)
                )
            tables[kind.name] = [kind.read(found, Place(kind.header, (kind.name,)))]
        if ACTIVE.name in kind.names and kind is not FILAMENT:
            tables[kind.name] = [own for own in tables[kind.name] if own[ACTIVE.name]]
    if not (tables["filament"] or tables["nucleation"] or tables["body"]):
        raise InputError("There is no [[filament]] table: add one for every kind of filament, or a [[body]].")
    return tables


def _refuse_contact_diameters(tables):
    for name in (FILAMENT.name, NUCLEATION.name, BRANCHING.name):
        for entries in tables[name]:
            entries.refuse(
                ("contact_diameter",), "belongs to [contacts]: add that table, with active = false if it comes later."
            )


def _refuse_without_filaments(tables):
    # What names a filament is refused by its number.
    random = [entries for entries in tables["link"] if "within" in entries]
    for entries in (*tables["linkers"], *random):
        raise entries.error("is about filaments, but there is no [[filament]] table: leave it out, or add one.")


def _filaments(tables, solvent, box, folder, monomers):
    groups, reserves = [], []
    (contacts,) = tables["contacts"] or (None,)
    for number, entries in enumerate(tables["filament"], start=1):
        own = read_filaments(entries, number, solvent, box, folder, monomers, contacts)
        groups += own
        _check_nodes(entries, groups)
        reserves.append((entries, own))
    # Behind all that are there at first, so that these keep their numbers.
    for entries, own in reserves:
        groups += filter(None, [read_reserve(entries, own)])
        _check_nodes(entries, groups)
    for entries in tables["nucleation"]:
        groups.append(read_nucleation(entries, groups, solvent, box, monomers, contacts))
        _check_nodes(entries, groups)
    for entries in tables["branching"]:
        groups.append(read_branching(entries, groups, solvent, monomers, contacts))
        _check_nodes(entries, groups)
    check_places(tables, groups)
    return tuple(groups)


def _check_nodes(entries, groups):
    nodes = sum(group.count * (group.nodes + group.spare_nodes) for group in groups)
    if nodes > MOST_NODES:
        raise entries.error(f"makes {nodes:.3g} nodes: there can be {MOST_NODES:.0e} in all.")


def _start_files(tables, folder):
    for entries in tables:
        for name in ("file", "topology"):
            if name in entries:
                path = find_start_file(folder, entries[name])
                yield path, digest_of(path)


def _check_engine(settings, configuration):
    # What the portable engine does not have.
    with settings.naming():
        if choose_engine(settings["engine"]) == "compiled":
            return
    for header, there in (
        ("[[linkers]]", configuration.linkers),
        ("[contacts]", configuration.contacts),
        ("[[body]]", configuration.bodies),
        ("[[end_frame]]", configuration.end_frames),
    ):
        if there:
            raise settings.at("engine").error(f'has no {header}: leave it out, or write "compiled".')
    for entries in configuration.tables["wall"]:
        for key, usual in (("distance", 0.0), ("side", "inside"), ("nodes", "all")):
            if entries[key] != usual:
                raise entries.at(key).error("needs the compiled engine: leave it out.")


def _disturbed(configuration):
    # Filament groups with what makes them no free chains in equilibrium.
    tethered = {}
    for tether in configuration.tethers:
        for number in tether.filaments:
            tethered[number] = tethered.get(number, 0) + 1
    moving = {number for tether in configuration.tethers if tether.velocity for number in tether.filaments}
    pulled = {number for pull in configuration.pulls for number in pull.filaments}
    framed = {number for frame in configuration.end_frames for number in frame.filaments}
    linked = {place["filament"] for link in configuration.links for place in link.between or ()}
    joined = {place["filament"] for joint in configuration.joints for place in joint.between}
    groups, first = [], 0
    for group in configuration.filaments:
        numbers = set(range(first, first + group.count))
        first += group.count
        reasons = {
            "linkers": binds_to(group, configuration.linkers),
            "links": bool(linked & numbers) or any(link.between is None for link in configuration.links),
            "joints": bool(joined & numbers),
            "bodies": group.on_body,
            "contacts": group.contact_diameter is not None,
            "walls": any(wall.holds(group.type) for wall in configuration.walls),
            "forces": bool(pulled & numbers),
            "frames": bool(framed & numbers) or (group.closed and has_twist(group.type)),
            "tethers": bool(moving & numbers)
            or any(tethered.get(number, 0) + bool(group.clamped) > 1 for number in numbers),
            "flow": configuration.flow is not None and not configuration.flow.is_at_rest,
            "propulsion": group.propulsion != 0.0,
            "growth": group.growth is not None,
            "rest_bends": group.rest_bends is not None,
        }
        disturbed = tuple(name for name, there in reasons.items() if there)
        tension = _tension_of(numbers, configuration.pulls) if disturbed == ("forces",) else None
        groups.append(dataclasses.replace(group, disturbed=disturbed, tension=tension))
    return tuple(groups)


def _tension_of(numbers, pulls):
    # That of all filaments of a group, if it is the only force on them.
    found = [pull for pull in pulls if numbers & set(pull.filaments)]
    if len(found) > 1 or found[0].tension is None or not numbers <= set(found[0].filaments):
        return None
    return found[0].tension, found[0].direction


def changed_keys(first, second):
    """Names of the tables and keys in which two configurations differ, apart from their text."""
    names = [] if first.title == second.title else ["title"]
    for kind in TABLES:
        one, other = first.tables[kind.name], second.tables[kind.name]
        if len(one) != len(other):
            names.append(f"the number of {kind.header} tables" if kind.repeated else kind.header)
            continue
        for before, after in zip(one, other):
            names += [f"{before.label} {key}" for key in kind.names if before.values[key] != after.values[key]]
    if [own.name for own in first.stages] != [own.name for own in second.stages]:
        names.append("the names or the number of its stages")
    for one, other in zip(first.stages, second.stages):
        found = [] if one.configuration.simulation.steps == other.configuration.simulation.steps else ["its duration"]
        found += changed_keys(one.configuration, other.configuration)
        names += [f"{key} in stage {one.name!r}" for key in found if key not in names]
    if list(first.start_files.values()) != list(second.start_files.values()):
        names.append("the content of a file to start from")
    return names


def linker_labels(configuration):
    """A name for each [[linkers]] table, distinct if there are several."""
    names = [own.kind.name for own in configuration.linkers]
    return [
        name if names.count(name) == 1 else f"{name} (table {number})" for number, name in enumerate(names, start=1)
    ]


def named_bound(configuration, name):
    """The name of a bound on the step of a configuration, with the labels of its linkers."""
    match = re.fullmatch(rf"{BINDING_FORCE_NAME}: type (\d+), (.*)", name)
    return name if match is None else f"{linker_labels(configuration)[int(match[1])]}: {match[2]}"
