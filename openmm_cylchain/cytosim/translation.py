"""From a configuration of Cytosim to a configuration of a run: a Document, and what it says was done."""

import re
from pathlib import Path

import numpy as np

from ..errors import InputError
from .bodies import KINDS as BODY_KINDS
from .bodies import add_bodies
from .bundles import add_bundles
from .document import LEFT_OUT, NEAREST, Document, point
from .drawing import Draw
from .filaments import add_filaments
from .growth import add_monomers
from .linkers import add_linkers
from .nucleation import add_event
from .script import New, count_of, read_script
from .settings import Settings
from .simulation import (
    add_box,
    add_contacts,
    add_simulation,
    add_solvent,
    thermal_energy,
)
from .spaces import make_space
from .stages import add_stages
from .walls import add_walls

_BODIES = {
    "nucleus": "bodies: nuclei",
    "fake": "bodies: spindles (fake)",
    "organizer": "bodies: organizers",
    "field": "fields",
}
_DENSITY = ("binding_rate", "unbinding_rate", "aging_rate", "aging", "aging_limit", "unit", "cut_fiber", "flux_speed")
_NEEDS = {
    **{("fiber", f"density_{key}"): "densities along filaments" for key in _DENSITY},
    ("fiber", "density"): "densities along filaments",
    ("fiber", "squeeze"): "forces towards a plane",
    ("fiber", "field"): "fields",
    ("fiber", "glue"): "surfaces: glue",
}
"""What keys need that nothing here asks for, by the kind of what has them."""
_DYNAMIC = ("dynamic_ellipse", "dynamic_sphere")
_WITH_EVERY_LENGTH = ("rectangle", "square", "periodic", "strip", "semi_periodic", "ellipse", "dice")
_SEED = 1


class Translation:
    """What is known while a Script is translated into its ``document``.

    ``start_files`` are arrays of positions in nm by the names of files, which lie beside the configuration.
    """

    def __init__(self, script, title, stem, dimensions=None, folder=".", duration=None):
        self._folder = folder
        self.script, self.document, self._stem = script, Document(title), stem
        self.generator = np.random.default_rng(_SEED)
        self.thermal_energy = thermal_energy(script.simul)
        self.viscosity = script.simul.number("viscosity", default=1.0)
        self.nucleated = []
        # How many filaments and tables of bodies there are when what is translated is created; None for all.
        self.bodies, self.there = [], None
        # Places on filaments of linkers that begin there, by the names of singles and couples.
        self.attached = {}
        self.growings, self.made, self.filament_count, self.start_files = [], [], 0, {}
        # The numbers of the tables of each New of fibers; and all of their tables, each with the Property.
        self.tables_of_fibers, self.tables_by_fiber = [], []
        self._spaces, self._type_names = {}, {}
        self.dimensions = self._find_dimensions(dimensions)
        self.steps = max(1, script.steps)
        self.duration = script.duration if duration is None else duration
        self._path = stem, dimensions, folder

    def left_out(self, text, line, needs):
        """Note what is left out, and what it needs."""
        self.document.note(LEFT_OUT, text, line, needs)

    def space(self, name=None):
        """The Space of a name, or the first one; None if there is none, or its shape is not known here."""
        if name is None:
            return next(iter(self._spaces.values()), None)
        return self._spaces.get(name, None)

    def draw_in(self, space, line):
        """The Draw of places in a Space or none, for what stands in a line."""
        return Draw(space, self.dimensions, self.generator, line)

    def shape_name(self, name=None):
        """What Cytosim calls the shape of a space."""
        names = [name] if name is not None else [new.name for new in self.script.created if new.kind == "space"]
        own = self.script.properties.get(names[0]) if names else None
        return "?" if own is None else own.settings.text("shape", "geometry", default="?")

    def type_name(self, name):
        """The name of the type of filaments of a fiber: up to five letters or digits, each of one fiber."""
        if name not in self._type_names:
            letters = re.sub(r"[^A-Za-z0-9]", "", name)[:5] or "F"
            number, own = 1, letters
            while own in self._type_names.values():
                number += 1
                own = f"{letters[: 5 - len(str(number))]}{number}"
            self._type_names[name] = own
        return self._type_names[name]

    def fibers_made(self):
        """Properties of the fibers that are there."""
        names = dict.fromkeys([*(own.name for own in self.made), *self.nucleated])
        return [self.script.properties[name] for name in names]

    def find_filament(self, text):
        """The filament that an attachment names, such as actin1, fiber2 or last; None if there is none."""
        words = re.fullmatch(r"(last|first|[A-Za-z]\w*?)\s*([:~]?)\s*(-?\s*\d+)?", (text or "").strip())
        made = self.made if self.there is None else self.made[: self.there[0]]
        if words is None or not made:
            return None
        name, number = words[1], int((words[3] or "0").replace(" ", ""))
        if name == "last":
            index = len(made) - 1 + (number if number <= 0 else -number)
        elif name == "first":
            index = number
        else:
            if words[3] is None:
                return None
            if name != "fiber":
                made = [own for own in made if own.name == name]
            # name~1 is the last one, as name0 is.
            number = 1 - number if words[2] == "~" else number
            index = number - 1 if number > 0 else len(made) - 1 + number
        return made[index] if 0 <= index < len(made) else None

    def start_file(self, positions):
        """Keep an array of positions in nm as a file, and return its name."""
        name = f"{self._stem}_{len(self.start_files) + 1}.npy"
        self.start_files[name] = positions
        return name

    def _find_dimensions(self, dimensions):
        given = self.script.simul.number("dim", "dimension")
        if given is not None and given not in (1.0, 2.0, 3.0):
            raise self.script.simul.mistake("dim", "must be 2 or 3.")
        if dimensions is not None:
            return dimensions
        if given is not None:
            if given == 1.0:
                self.left_out("dim = 1", self.script.simul.line_of("dim"), "one dimension")
            return 2 if given <= 2.0 else 3
        found = 2 if any(map(self._is_flat, self.script.created)) else 3
        self.document.note(
            NEAREST,
            f"{found} dimensions, since the file does not say for which Cytosim was built: --dimensions {5 - found} "
            "for the other",
        )
        return found

    def _is_flat(self, new):
        # Whether a space that is created has two dimensions: a circle, or one that has two lengths.
        if new.kind != "space":
            return False
        settings = self.script.named(new.name, "space", new.line).settings
        shape = settings.text("shape", default="")
        two = any(len(own.values("length")) == 2 and "bottom" not in own for own in (settings, new.settings))
        return shape == "circle" or (two and shape in _WITH_EVERY_LENGTH)

    def translate(self):
        """Write all of the document, with a stage for each run."""
        for line, text in self.script.choices:
            self.document.note(NEAREST, text, line)
        for line, text, needs in self.script.stages:
            self.left_out(text, line, needs)
        self._translate_run()
        if self.script.later:
            stem, dimensions, folder = self._path
            later, deleted, cuts = [], [], []
            for script in self.script.later:
                own = Translation(script, self.document.title, stem, dimensions, folder, self.duration)
                own._translate_run()
                later.append(own.document)
                deleted.append(_deletions(script, own.tables_of_fibers))
                cuts.append(_cuts(script, own.tables_of_fibers))
                # Those of filaments that come later.
                self.start_files.update({**own.start_files, **self.start_files})
                self.made = max(self.made, own.made, key=len)
            unbound = [own.unbound for own in self.script.later]
            runs = [own.run for own in (self.script, *self.script.later)]
            add_stages(self.document, later, runs, unbound, deleted, cuts)

    def _translate_run(self):
        # What is there when a run begins.
        add_solvent(self)
        self._add_spaces()
        add_box(self)
        linked = []
        for new in self.script.created:
            if new.kind == "fiber":
                before = len(self.document.tables_called("[[filament]]"))
                add_filaments(self, new)
                self.tables_of_fibers.append(range(before, len(self.document.tables_called("[[filament]]"))))
            elif new.kind in ("single", "couple"):
                linked.append((new, len(self.made), len(self.bodies)))
            elif new.kind == "event":
                add_event(self, new)
            elif new.kind in BODY_KINDS:
                add_bodies(self, new)
            elif new.kind == "bundle":
                add_bundles(self, new)
            elif new.kind in _BODIES:
                new.settings.take_rest()
                if count_of(new, self.space()):
                    self.left_out(f"{new.kind} {new.name}", new.line, _BODIES[new.kind])
        self._add_event_of_run()
        add_linkers(self, linked)
        add_monomers(self, self.growings)
        add_contacts(self)
        add_walls(self)
        add_simulation(self)
        self._note_unused()

    def _add_event_of_run(self):
        # event = RATE, ( CODE )
        run = self.script.run
        if run is None or "event" not in run:
            return
        line = run.line_of("event")
        rate, code = run.text("event"), run.text(("event", 1), default="")
        settings = Settings("event of run", line)
        settings.set("rate", [rate], line)
        settings.set("code", [code], line)
        add_event(self, New(1, "event", "event", settings, line))

    def _add_spaces(self):
        for new in self.script.created:
            if new.kind != "space":
                continue
            own = self.script.named(new.name, "space", new.line)
            shape = own.settings.text("shape", "geometry", default="")
            still = shape.removeprefix("dynamic_") if shape in _DYNAMIC else shape
            space = make_space(still, [new.settings, own.settings], self.dimensions, self._folder)
            if space is not None and still != shape:
                own.settings.take_rest()
                self.left_out(f"forces on {new.name}, which keeps its shape", new.line, f"spaces: {shape}")
            if space is not None and space.thin:
                self.document.note(NEAREST, f"{new.name} has a thickness of 0.2 nm, and none in Cytosim", new.line)
            if new.name not in self._spaces:
                self._spaces[new.name] = space
            if space is None:
                new.settings.take_rest()
                self.left_out(f"the space {new.name} of the shape {shape}", new.line, f"spaces: {shape}")

    def _note_unused(self):
        made = [own.name for own in self.fibers_made()]
        every = []
        for own in self.script.properties.values():
            if own.kind not in (*_BODIES, *BODY_KINDS) and (own.kind != "fiber" or own.name in made):
                every.append((own.settings, own.kind))
        bodies = {own.property for own in self.bodies}
        every += [(own.settings, own.kind) for own in self.script.properties.values() if own.name in bodies]
        every += [(new.settings, f"new {new.kind}") for new in self.script.created]
        every += [(self.script.simul, "simul")]
        if self.script.run is not None:
            every.append((self.script.run, "run"))
        for settings, kind in every:
            self.note_unused(settings, kind)

    def note_unused(self, settings, kind):
        """Note keys of Settings that nothing here has asked for."""
        for key, values, line in settings.unused():
            text = f"{key} = {', '.join(values)}"[:80]
            self.left_out(f"{text} of {settings.label}", line, _NEEDS.get((kind, key), f"{kind}: {key}"))

    def check(self):
        """Raise InputError if there is nothing that a run has."""
        if not (self.made or self.bodies or self.document.tables_called("[[nucleation]]")):
            missing = ", ".join(self.document.missing)
            raise InputError(
                "there are neither fibers nor bodies in it, and a run of ours has some"
                + (f". It would need: {missing}." if missing else ".")
            )


def _deletions(script, tables):
    # By numbers of [[filament]] tables: how many go as the run begins, None for all.
    found = {}
    for number, count in script.deleted:
        own = tables[number]
        for place, table in enumerate(own):
            share = None if count is None else (count + len(own) - 1 - place) // len(own)
            found[table] = None if share is None or found.get(table, 0) is None else found.get(table, 0) + share
    return {table: count for table, count in found.items() if count != 0}


def _cuts(script, tables):
    # By numbers of [[filament]] tables: the planes that cut as the run begins, n.x + a = 0.
    found = {}
    for numbers, settings in script.cuts:
        normal = np.array(settings.vector("plane", default=(1.0, 0.0, 0.0)))
        if not normal.any():
            raise settings.mistake("plane", "must have a normal that is not zero.")
        point_on = -settings.number(("plane", 1), default=0.0) * normal / (normal @ normal)
        for number in numbers:
            for table in tables[number]:
                found.setdefault(table, []).append({"point": point(point_on), "normal": normal.tolist()})
    return found


def translate(path, stem, dimensions=None, given=None):
    """The Translation of a file of Cytosim.

    Parameters
    ----------
    path : str or Path
    stem : str
        How names of files begin that lie beside the configuration.
    dimensions : {2, 3}, optional
        Those of the file, or of the shape of its space, if not given.
    given : dict, optional
        Values of names in templates.

    Raises
    ------
    InputError
        If it is no such file, with the line, or has nothing that we can say.
    """
    try:
        translation = Translation(read_script(path, given), Path(path).name, stem, dimensions, Path(path).parent)
        translation.translate()
        translation.check()
    except InputError as error:
        separator = ", " if str(error).startswith("line ") else ": "
        raise InputError(f"{path}{separator}{error}") from None
    return translation
