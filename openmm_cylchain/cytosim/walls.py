"""What confines fibers and bodies as [[wall]] tables."""

from typing import NamedTuple

from .document import EXACT, NEAREST, Note, quantity
from .settings import OFF

_OF_FIBERS = {
    "inside": ("inside", "all"),
    "1": ("inside", "all"),
    "outside": ("outside", "all"),
    "2": ("outside", "all"),
    "on": ("surface", "all"),
    "surface": ("surface", "all"),
    "plus_end": ("surface", "last"),
    "minus_end": ("surface", "first"),
    "both_ends": ("surface", "ends"),
    "plus_out": ("outside", "last"),
    "minus_out": ("outside", "first"),
}
_OF_BODIES = {
    "inside": ("inside", "all"),
    "1": ("inside", "all"),
    "all_inside": ("inside", "all"),
    "outside": ("outside", "all"),
    "on": ("surface", "all"),
    "surface": ("surface", "all"),
    "point": ("surface", "first"),
    "point_inside": ("inside", "first"),
}
"""Modes of confine as side and nodes of a wall."""
_WHOLE = "all_inside"
"""The mode in which bodies are confined with their spheres: in others, with their centres."""
_ONE_FACE = ("sphere", "cylinder", "capsule", "torus", "ellipsoid")


class _Confinement(NamedTuple):
    space: str | None
    stiffness: float
    side: str
    nodes: str


def add_walls(translation):
    """The [[wall]] tables of what confines fibers and bodies."""
    found, every = {}, []
    for fiber in translation.fibers_made():
        every.append(fiber.name)
        for key in ("confine", "confine2"):
            for own in _of_fiber(translation, fiber, key):
                found.setdefault((own, None), {})[fiber.name] = fiber.settings.line_of(key)
    for body in dict.fromkeys((own.name, own.property) for own in translation.bodies):
        name, settings = body[0], translation.script.properties[body[1]].settings
        every.append(name)
        for own in _of_body(translation, name, settings):
            whole = settings.text("confine") == _WHOLE
            # The first bodies say it of the wall of fibers.
            if (own, None) in found:
                found[own, whole] = found.pop((own, None))
            found.setdefault((own, whole), {})[name] = settings.line_of("confine")
    for (own, whole), held in found.items():
        _add_wall(translation, own, whole, held, every)


def _of_fiber(translation, fiber, key):
    settings = fiber.settings
    mode, line = settings.text(key), settings.line_of(key)
    settings.values(f"{key}_stiffness")
    if mode in OFF:
        return
    stiffness = settings.number((key, 1), f"{key}_stiffness", default=0.0)
    space = settings.confining_space(key)
    if mode == "in_out":
        # A surface, and on the side on which it is stiffer a wall.
        beyond = settings.number((key, 2), default=stiffness)
        space = settings.text((key, 3), f"{key}_spec", f"{key}_space")
        sides = {"surface": min(stiffness, beyond), "inside": beyond - stiffness, "outside": stiffness - beyond}
        yield from (_Confinement(space, own, side, "all") for side, own in sides.items() if own > 0.0)
        return
    if mode not in _OF_FIBERS:
        translation.left_out(f"{key} = {mode} of {fiber.name}", line, f"surfaces: confine = {mode}")
        return
    if stiffness <= 0.0:
        translation.document.note(EXACT, f"{key} of {fiber.name} has no stiffness", line)
        return
    side, nodes = _OF_FIBERS[mode]
    if nodes != "all" and settings.text("activity", default="none") != "none":
        translation.left_out(f"{key} = {mode} of {fiber.name}, which grows", line, "surfaces: ends that grow")
        return
    yield _Confinement(space, stiffness, side, nodes)


def _of_body(translation, name, settings):
    mode, line = settings.text("confine"), settings.line_of("confine")
    stiffness = settings.number(("confine", 1), "confine_stiffness", default=0.0)
    space = settings.confining_space()
    if mode in OFF or stiffness == 0.0:
        return
    if mode not in _OF_BODIES:
        translation.left_out(f"confine = {mode} of {name}", line, f"surfaces: confine = {mode}")
        return
    yield _Confinement(space, stiffness, *_OF_BODIES[mode])


def _add_wall(translation, own, whole, held, every):
    line = next(iter(held.values()))
    space = translation.space(own.space)
    if space is None or space.walls is None:
        shape = translation.shape_name(own.space)
        translation.left_out(f"the wall of the shape {shape}", line, f"walls: {shape}")
        return
    if space.thin and own.side == "surface":
        # Within it is on it.
        own = own._replace(side="inside")
    curved = [wall for wall in space.walls if wall["shape"] in _ONE_FACE]
    if own.side != "inside" and len(curved) != 1:
        what = "what is on the surface" if own.side == "surface" else "what is outside"
        translation.left_out(f"{what} of a {space.shape}", line, f"surfaces: {own.side} of a {space.shape}")
        return
    for wall in curved if own.side == "outside" else space.walls:
        side = own.side if wall in curved else "inside"
        table = translation.document.table("[[wall]]", line)
        for key, value in wall.items():
            table.add(key, value, Note(EXACT, f"confine, {own.stiffness:g}" if key == "shape" else "", line))
        table.add("stiffness", quantity(own.stiffness, "pN/um"), Note(EXACT, "of each node"))
        if wall["shape"] == "prism" or space.shape == "bicylinder":
            table.comment(Note(NEAREST, "what is beyond a corner is pushed by both sides, each by its own distance"))
        if side != "inside":
            table.add("side", side)
            if side == "outside" and len(space.walls) > 1:
                table.comment(Note(NEAREST, "as if it had no ends"))
        elif own.side == "surface":
            table.comment(Note(NEAREST, "its ends keep inside what Cytosim holds on them where they are nearest"))
        if whole is False and own.side != "surface":
            table.add("whole", False, Note(EXACT, "as the centres of bodies are in Cytosim"))
        if own.nodes != "all":
            table.add("nodes", own.nodes)
        if len(held) < len(every):
            names = [translation.type_name(name) for name in held]
            table.add("holds", names, Note(EXACT, f"of {', '.join(held)} alone"))
