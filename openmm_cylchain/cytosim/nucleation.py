"""Events that create fibers at a rate, as [[nucleation]]."""

import math

from .document import EXACT, NEAREST, Note, quantity
from .grammar import read_commands
from .places import Draw, fixed_direction, region_of

_EVENTS = "events during a run"
_WITHOUT_EFFECT = ("report", "write", "export", "save", "mark")
_MOST_PLACES = 2000
_SPHERE_OR_BOX = ("sphere", "box")


def add_event(translation, new):
    """Add the event of a New: fibers that begin, or a note of what is left out."""
    options = new.settings
    block = options.block("code")
    commands = [] if block is None else read_commands(block.text, block.line)
    for key in ("rate", "delay", "time", "code", "activity", "recurrent"):
        options.values(key)
    effective = [own for own in commands if own.verb not in _WITHOUT_EFFECT and "display" not in own.words]
    if effective:
        words = " ".join((effective[0].verb, *effective[0].words))
        translation.left_out(f"event: {words}", new.line, _EVENTS)


__all__ = ["EXACT", "NEAREST", "Draw", "Note", "add_event", "fixed_direction", "math", "quantity", "region_of"]
