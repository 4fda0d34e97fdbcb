"""[[filament]]: filaments of one kind, how many, and where they begin."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...filaments.chain_type import ChainType
from ...filaments.growth import Growth, check_growth
from ...filaments.rest_bends import RestBends, check_rest_bends
from ...filaments.shapes import MINIMUM_RING
from ...kinetics.nucleation import Nucleation
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Either, Flag, Inline, Key, Listing, Quantity, Text, Whole, direction, point
from ..start_files import read_start
from ..table import ACTIVE, TableKind
from .deletion import CUT, CUT_EXAMPLE, DELETE, DELETE_EXAMPLE, Deletion, read_cuts, read_deletion
from .filament_types import MONOMER_LENGTHS, TYPE_KEYS, read_filament_type
from .growth import GROWTH, GROWTH_EXAMPLE, SEVERING_EXAMPLE, read_growth
from .shapes import REGION, REGION_EXAMPLE, Region

STARTS = ("equilibrium", "straight")
RESERVE = "reserve"
"""How filaments start that are not there yet."""
MOST_NODES = 10**7
"""Of a configuration: more than that would not fit into the memory of a computer of today."""

SHARED = ("planar", "propulsion", "height", "table", "contact_diameter")
"""What filaments that begin later have of a FilamentGroup of their table, beside their type and their growth."""

# Of the diameter of filaments. Steps would have to be divided again and again to resolve contacts of less.
_LEAST_DIAMETER = 0.1
_ORIENTATIONS = ("polar", "nematic")
_SEGMENTS = Whole(1, MOST_NODES, "64")
_FROM_NODES = (
    "segments",
    "count",
    "concentration",
    "monomer_concentration",
    "monomer_length",
    "start",
    "position",
    "direction",
    "orientation",
    "inside",
    "normal",
    "height",
)
_FROM_FILE = (*_FROM_NODES[:-1], "tangents")

_REST_BENDS_EXAMPLE = '{ angles = ["10 deg"], directions = ["0 deg"] }'
_REST_BENDS = TableKind(
    "rest_bends",
    (
        Key("angles", Listing(Quantity(units.ANGLE, "zero"), "angles", '["10 deg"]'), REQUIRED, "One, or one of each."),
        Key(
            "directions",
            Listing(Quantity(units.ANGLE, "any"), "angles", '["0 deg"]'),
            (0.0,),
            "Where to in the material frame; one, or one of each.",
        ),
    ),
    "By how much the joints of filaments with twist are bent at rest, see `RestBends`.",
    owner="rest_bends of [[filament]]",
)

CONTACT_KEYS = (
    Key(
        "contact_diameter",
        Quantity(units.LENGTH),
        None,
        "Distance of two axes at which these filaments touch, with [contacts], if it is not the diameter there.",
    ),
    Key("contacts", Flag("false"), True, "Whether others touch them, with [contacts]."),
)
"""Of a table that makes filaments of its own."""

FILAMENT = TableKind(
    "filament",
    (
        Key(
            "segments",
            Either(((list, Listing(_SEGMENTS, "whole numbers", "[8, 10, 12]")), (object, _SEGMENTS))),
            None,
            "How many segments a filament has; of a list, equal shares have each number, in the order of the list.",
        ),
        Key("count", Whole(1, MOST_NODES, "10"), None, "How many there are; 1 if not given."),
        Key(
            "concentration",
            Quantity(units.NUMBER_DENSITY),
            None,
            "In place of count: how many filaments there are in the volume of the box, or of inside.",
        ),
        Key(
            "monomer_concentration",
            Quantity(units.NUMBER_DENSITY),
            None,
            "In place of count: that of monomers (of actin, tubulin dimers, base pairs), all of them in filaments.",
        ),
        Key(
            "monomer_length",
            Quantity(units.LENGTH),
            None,
            "Length of a filament per monomer, for monomer_concentration: 2.73 nm of actin, 8/13 nm of microtubules, "
            "0.34 nm of DNA if not given.",
        ),
        Key(
            "start", Choice(STARTS), None, 'Their shape at first: "equilibrium" if not given, drawn from the exact one.'
        ),
        Key("position", point(), None, "Where the first node is, or the centre of a ring."),
        Key("direction", direction(), None, "Direction of the first segment; random if not given."),
        Key(
            "orientation",
            Choice(_ORIENTATIONS),
            "polar",
            'Whether all have the direction, or, "nematic", half of them the opposite one.',
        ),
        Key("inside", Inline(REGION, REGION_EXAMPLE), None, "A region in which filaments begin at random places."),
        Key(
            "clamped",
            Listing(Whole(-MOST_NODES, MOST_NODES, "0"), "node numbers", "[0]", 0),
            (),
            "Nodes that do not move; -1 is the last one. One alone is a hinge. Of straight segments, [0, 1] is a clamp "
            "at node 1: what is free is a segment shorter than the filament. For a clamp at its end take element = "
            '"beam".',
        ),
        Key(
            "clamped_tangents",
            Listing(Whole(-MOST_NODES, MOST_NODES, "0"), "node numbers", "[0]", 0),
            (),
            'Clamped nodes at which a filament of element = "beam" does not turn; one clamped alone is a hinge.',
        ),
        Key(
            "nodes",
            Listing(point(), "points", '[["0 nm", "0 nm", "0 nm"], ["1 um", "0 nm", "0 nm"]]', 2),
            None,
            "Where the nodes of one filament begin, in place of segments and all that places it.",
        ),
        Key(
            "tangents",
            Listing(direction(), "directions", "[[1, 0, 0], [1, 0, 0]]", 2),
            None,
            'With nodes and element = "beam": directions of the curve there; those of a smooth curve if not given.',
        ),
        Key("closed", Flag(), False, "A ring, which begins as a regular polygon, or as a circle of beam elements."),
        Key("normal", direction(), (0.0, 0.0, 1.0), "Normal of the plane of a ring."),
        Key("planar", Flag(), False, "The filament moves in a plane of constant z."),
        Key("height", Quantity(units.LENGTH, "any"), 0.0, "z of that plane, where no position is given."),
        Key(
            "propulsion",
            Quantity(units.FORCE, "any"),
            0.0,
            "Force that propels it: on each segment along its tangent, or on each beam element along its curve.",
        ),
        Key(
            "rest_bends",
            Inline(_REST_BENDS, _REST_BENDS_EXAMPLE),
            None,
            "By how much joints of filaments with twist are bent at rest: curved DNA.",
        ),
        Key(
            "growth",
            Inline(GROWTH, GROWTH_EXAMPLE),
            None,
            "Filaments gain and lose monomers of a [[monomers]] table at their ends: see below.",
        ),
        Key(
            "reserve",
            Whole(1, MOST_NODES, "100"),
            None,
            "How many places there are for parts of filaments that are cut, with growth = { severing_rate = ... }.",
        ),
        *CONTACT_KEYS,
        ACTIVE,
        Key("delete", Inline(DELETE, DELETE_EXAMPLE), None, "In a `[[stage]]`: filaments that go as it begins."),
        Key(
            "cut",
            Listing(Inline(CUT, CUT_EXAMPLE), "tables", f"[{CUT_EXAMPLE}]"),
            None,
            "In a `[[stage]]`: planes that cut filaments as it begins, with growth = { severing_rate = ... }.",
        ),
        Key("file", Text('"start.npz"'), None, "Start from a file: see below."),
        Key("topology", Text('"topology.cif"'), None, "Topology of a file that is a trajectory."),
        Key("frame", Whole(-(10**12), 10**12, "-1"), None, "Which frame of a trajectory; the last one if not given."),
        Key(
            "filaments",
            Listing(Whole(0, None, "0"), "numbers of filaments", "[0, 1]"),
            None,
            "Those of the file, counted from 0; all of this type if not given.",
        ),
        *TYPE_KEYS,
    ),
    "Filaments of one kind. There is one such table at least, or a `[[nucleation]]`.",
    repeated=True,
)


@dataclass(frozen=True)
class FilamentGroup:
    """Filaments of one [[filament]] table that have as many segments, or that are not there yet; lengths in nm.

    ``table`` is the number of the table, from 1, or of that whose type and growth they share, and zero without one;
    ``own_path`` that of the table that reserves places, if it is not that one, and ``nucleation`` how filaments begin.
    ``disturbed`` is what makes them no free chains, in words: links, walls and so on; ``tension`` that of their ends in
    kJ/(mol nm), with its direction, if nothing else is. ``positions`` are those of a file, or given ones, for each
    filament, and ``control_points`` those of beam elements or None. Those that grow have ``spare_nodes`` each;
    ``on_body`` says whether bodies hold them, which know where they are. Without a ``contact_diameter`` nothing touches
    them.
    """

    type: ChainType
    segments: int
    count: int
    start: str
    position: tuple | None
    direction: tuple | None
    clamped: tuple
    orientation: str = "polar"
    inside: Region | None = None
    closed: bool = False
    normal: tuple = (0.0, 0.0, 1.0)
    planar: bool = False
    height: float = 0.0
    propulsion: float = 0.0
    table: int = 1
    disturbed: tuple = ()
    tension: tuple | None = None
    positions: tuple | None = dataclasses.field(default=None, compare=False, repr=False)
    control_points: tuple | None = dataclasses.field(default=None, compare=False, repr=False)
    clamped_tangents: tuple = ()
    growth: Growth | None = dataclasses.field(default=None, compare=False)
    spare_nodes: int = 0
    own_path: tuple = ()
    active: bool = True
    delete: Deletion | None = None
    cuts: tuple = ()
    nucleation: Nucleation | None = dataclasses.field(default=None, compare=False)
    on_body: bool = False
    contact_diameter: float | None = None
    rest_bends: RestBends | None = None

    @property
    def path(self):
        """Of its table: ("filament", 0) is the first one."""
        return self.own_path or ("filament", self.table - 1)

    @property
    def label(self):
        """What messages call its table."""
        name, index = self.path
        return f"[[{name}]] number {index + 1}"

    @property
    def is_reserve(self):
        """Whether its filaments are not there at first."""
        return self.start == RESERVE

    @property
    def nodes(self):
        """Nodes of each filament."""
        return self.segments + (not self.closed)

    @property
    def joints(self):
        """Bends of each filament: joints, or beam elements, which bend themselves."""
        return self.type.segment_kind.bends(self.segments, self.closed)

    @property
    def linked(self):
        """Whether linkers bind to them."""
        return "linkers" in self.disturbed


def read_filaments(entries, table, solvent, box, folder, monomers, contacts):
    """The FilamentGroups of a [[filament]] table, one for each length, for MonomerGroups.

    The number of the table is counted from 1; files are named from the folder. ``contacts`` are the Entries of
    [contacts], or None.
    """
    kind = read_filament_type(entries, solvent)
    _check_element(entries, kind)
    if "file" in entries:
        groups = _from_file(entries, kind, box, folder)
    else:
        groups = _from_nodes(entries, kind) if "nodes" in entries else _placed(entries, kind, box)
    growth = None if entries["growth"] is None else read_growth(entries["growth"], monomers)
    own = {"planar": True} if entries["planar"] else {}
    common = {key: entries[key] for key in ("propulsion", "height", "active")} | {"table": table}
    common["contact_diameter"] = read_contact_diameter(entries, kind, contacts)
    if entries["delete"] is not None:
        common["delete"] = read_deletion(entries["delete"])
    common["cuts"] = read_cuts(entries["cut"])
    if common["cuts"] and (growth is None or growth.severing is None):
        raise entries.at("cut").error(f"needs filaments that may be cut: give them growth = {SEVERING_EXAMPLE}")
    if common["cuts"] and box is not None:
        raise entries.at("cut").error("would not cut the images of filaments in a periodic box: leave [box] out.")
    if growth is not None and not entries["active"]:
        raise entries.at("active").error("is false, but these filaments grow: let them begin by [[nucleation]].")
    if growth is None:
        entries.refuse(("reserve",), f"belongs to filaments that are cut: add growth = {SEVERING_EXAMPLE}")
    finished = []
    for group in groups:
        with entries.naming():
            label = entries.label.rstrip(":")
            given = entries["clamped"], entries["clamped_tangents"]
            clamped, tangents = kind.segment_kind.clamps(*given, group.nodes, label)
            kind.segment_friction(solvent.viscosity, solvent.temperature, group.segments)
        spare = 0
        if growth is not None:
            spare = _spare_nodes(entries, growth, kind, group.segments, group.closed, clamped)
        bends = _rest_bends(entries, kind, group)
        held = {"clamped": clamped, "clamped_tangents": tangents, "rest_bends": bends}
        finished.append(dataclasses.replace(group, **held, growth=growth, spare_nodes=spare, **own, **common))
    return finished


def _rest_bends(entries, kind, group):
    if entries["rest_bends"] is None:
        return None
    own, label = entries["rest_bends"], entries.label.rstrip(":")
    with entries.naming():
        angles, directions = (own[key][0] if len(own[key]) == 1 else own[key] for key in ("angles", "directions"))
        bends = RestBends(angles, directions)
        check_rest_bends(bends, kind, group.joints, bool(entries["planar"]), entries["growth"] is not None, label)
    return bends


def read_contact_diameter(entries, kind, contacts):
    """The distance in nm at which filaments of a ChainType that a table makes touch, or None if nothing touches them.

    ``contacts`` are the Entries of [contacts], or None.
    """
    if contacts is None or entries["contacts"] is False:
        return None
    own = entries if "contact_diameter" in entries else contacts
    key = "contact_diameter" if own is entries else "diameter"
    own.require(key)
    if own[key] < _LEAST_DIAMETER * kind.diameter:
        raise own.at(key).error(
            f"is {own[key]:g} nm, but filaments are {kind.diameter:g} nm thick ({entries.label.rstrip(':')}): they "
            "touch at their diameter, or further apart."
        )
    return own[key]


def reserve_group(entries, kind, growth, count, **others):
    """The FilamentGroup of a table for filaments of a type that are not there yet: a count of places."""
    nodes = _spare_nodes(entries, growth, kind)
    return FilamentGroup(
        kind, 1, count, RESERVE, None, None, (), growth=growth, spare_nodes=max(0, nodes - 2), **others
    )


def read_reserve(entries, groups):
    """The FilamentGroup of a [[filament]] table that reserves places, of its other groups; None if it has none."""
    if entries["reserve"] is None:
        return None
    first = groups[0]
    own = {key: getattr(first, key) for key in SHARED}
    return reserve_group(entries, first.type, first.growth, entries["reserve"], **own)


def _spare_nodes(entries, growth, kind, segments=None, closed=False, clamped=()):
    # All nodes of one that has no segments yet.
    label = entries.label.rstrip(":")
    if kind.segment_kind.straight:
        try:
            growth.monomers_per_segment(kind)
        except InputError:
            length = growth.monomers.length
            near = max(2, round(kind.segment_length / length)) * length
            raise entries.error(
                f"grows by {length:g} nm with a monomer, and its segments are {kind.segment_length:g} nm long: "
                f'they must be a whole number of monomers, as with segment_length = "{near:.12g} nm"'
            ) from None
    with entries.naming():
        return check_growth(growth, kind, segments, closed, clamped, label)


def _check_element(entries, kind):
    # What beam elements alone have.
    if kind.segment_kind.straight:
        entries.refuse(("tangents", "clamped_tangents"), 'belongs to element = "beam".')


def _from_nodes(entries, kind):
    entries.refuse(_FROM_NODES, "cannot be with nodes, which say it.")
    entries.refuse(("topology", "frame", "filaments"), "belongs to a file.")
    nodes, closed = np.array(entries["nodes"]), entries["closed"]
    label = entries.label.rstrip(":")
    if closed and len(nodes) < MINIMUM_RING:
        raise entries.at("nodes").error(f"must be at least {MINIMUM_RING} of a ring, but are {len(nodes)}.")
    if entries["planar"] and np.any(nodes[:, 2] != nodes[0, 2]):
        raise entries.at("nodes").error("must have one z, because this filament is planar.")
    _check_lengths(entries, "nodes", kind, nodes, closed, None)
    with entries.naming():
        tangents = None if entries["tangents"] is None else np.array(entries["tangents"])
        controls = kind.segment_kind.control_points(kind, nodes, label, tangents, closed=closed)
    if entries["planar"] and controls is not None and np.any(controls[:, 2] != nodes[0, 2]):
        raise entries.at("tangents").error("must lie in the xy plane, because this filament is planar.")
    yield FilamentGroup(
        kind,
        len(nodes) - (not closed),
        1,
        "nodes",
        None,
        None,
        (),
        closed=closed,
        positions=(nodes,),
        control_points=(controls,),
    )


def _placed(entries, kind, box):
    entries.refuse(("topology", "frame", "filaments"), "belongs to a file.")
    entries.refuse(("tangents",), "belongs to nodes.")
    entries.require("segments")
    entries.only_one("count", "concentration", "monomer_concentration")
    entries.only_one("position", "inside")
    region = None if entries["inside"] is None else Region(entries["inside"])
    if "orientation" in entries and "direction" not in entries:
        raise entries.at("orientation").error("needs a direction: add a line such as direction = [1, 0, 0]")
    if entries["closed"]:
        entries.refuse(("start", "direction", "orientation"), "cannot be with closed: rings begin as regular polygons.")
    else:
        entries.refuse(("normal",), "belongs to closed = true.")
    _check_plane(entries)
    lengths = entries["segments"] if isinstance(entries["segments"], tuple) else (entries["segments"],)
    if entries["closed"] and min(lengths) < MINIMUM_RING:
        raise entries.at("segments").error(f"must be at least {MINIMUM_RING} in a ring, but is {min(lengths)}.")
    count = _count(entries, kind, lengths, region, box)
    shares = {}
    for number, length in enumerate(lengths):
        shares[length] = shares.get(length, 0) + (count - number + len(lengths) - 1) // len(lengths)
    for length, share in shares.items():
        if share:
            yield FilamentGroup(
                kind,
                length,
                share,
                "ring" if entries["closed"] else entries["start"] or "equilibrium",
                entries["position"],
                entries["direction"],
                (),
                entries["orientation"],
                region,
                entries["closed"],
                entries["normal"],
            )


def _check_plane(entries):
    if not entries["planar"]:
        entries.refuse(("height",), "belongs to planar = true.")
        return
    if "position" in entries:
        entries.refuse(("height",), "cannot be with a position.")
    if entries["direction"] is not None and entries["direction"][2] != 0.0:
        raise entries.at("direction").error("must lie in the xy plane, because these filaments are planar.")
    if entries["closed"] and entries["normal"][:2] != (0.0, 0.0):
        raise entries.at("normal").error("must be along z, because these filaments are planar.")


def _count(entries, kind, lengths, region, box):
    monomers = _monomers(entries, kind, lengths)
    key = "concentration" if monomers is None else "monomer_concentration"
    if key not in entries:
        return entries["count"] or 1
    if region is None and box is None:
        raise entries.at(key).error(f"needs a volume: add a [box], or inside = {REGION_EXAMPLE}")
    volume = float(np.prod(box)) if region is None else region.volume
    exact = entries[key] * volume / (monomers or 1.0)
    if not 0.5 < exact < MOST_NODES + 0.5:
        of_monomers = "" if monomers is None else f" of {monomers:.4g} monomers each"
        raise entries.at(key).error(
            f"makes {exact:.4g} filaments{of_monomers} in a volume of {1e-9 * volume:.4g} um^3: choose it so that "
            f"there are some, and no more than {MOST_NODES}."
        )
    return round(exact)


def _monomers(entries, kind, lengths):
    # Of a filament on average, None if their concentration is not given.
    if "monomer_concentration" not in entries:
        entries.refuse(("monomer_length",), "belongs to monomer_concentration.")
        return None
    each = entries["monomer_length"] or MONOMER_LENGTHS.get(entries["type"])
    if each is None:
        raise entries.at("monomer_concentration").error(
            'needs the length of a monomer of this type: add a line such as monomer_length = "2.7 nm"'
        )
    return float(np.mean([kind.segment_lengths(own, entries["closed"]).sum() for own in lengths])) / each


def _from_file(entries, kind, box, folder):
    entries.refuse(_FROM_FILE, "cannot be with a file, which says it.")
    chains = read_start(
        folder,
        entries.at("file"),
        entries["file"],
        entries["topology"],
        entries["frame"],
        entries["filaments"],
        kind.name,
    )
    shapes = {}
    for nodes, closed, controls in chains:
        closed = closed or entries["closed"]
        whole = _whole(nodes, box)
        _check_lengths(entries, "file", kind, whole, closed, box)
        shapes.setdefault((len(nodes) - (not closed), closed), []).append(
            (whole, _control_points(entries, kind, nodes, whole, controls, box, closed))
        )
    for (segments, closed), starts in shapes.items():
        if segments < (MINIMUM_RING if closed else 1):
            raise entries.at("file").error(f"has a filament of {segments} segments.")
        positions, control_points = zip(*starts)
        yield FilamentGroup(
            kind,
            segments,
            len(positions),
            "file",
            None,
            None,
            (),
            closed=closed,
            positions=positions,
            control_points=control_points,
        )


def _control_points(entries, kind, nodes, whole, controls, box, closed):
    # Those of a file next to whole nodes; of a smooth curve where it has none.
    if controls is None:
        return kind.segment_kind.control_points(kind, whole, entries.label.rstrip(":"), closed=closed)
    if kind.segment_kind.straight:
        raise entries.at("file").error('has beam elements: write element = "beam".')
    vectors = controls - nodes
    return whole + (vectors if box is None else vectors - np.round(vectors / box) * box)


def _whole(nodes, box):
    # Each node at the image that is nearest to the one before it.
    if box is None:
        return nodes
    jumps = np.round(np.diff(nodes, axis=0) / box)
    return nodes - np.concatenate([np.zeros((1, 3)), np.cumsum(jumps, axis=0)]) * box


def _check_lengths(entries, key, kind, nodes, closed, box):
    vectors = np.diff(nodes, axis=0, append=nodes[:1]) if closed else np.diff(nodes, axis=0)
    lengths = np.linalg.norm(vectors, axis=1)
    if len(lengths) and not (0.5 * kind.segment_length < lengths.min() and lengths.max() < 2.0 * kind.segment_length):
        what, whose = ("has segments of", "those") if key == "file" else ("are apart by", "segments")
        raise entries.at(key).error(
            f"{what} {lengths.min():.4g} to {lengths.max():.4g} nm, but {whose} of {kind.name} are of "
            f"{kind.segment_length:g} nm: change segment_length, or "
            + ("the file (lengths in arrays are in nm)." if key == "file" else "the nodes.")
        )
