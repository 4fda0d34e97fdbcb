"""Several runs of Cytosim as [[stage]] tables: what differs from one translated configuration to the next."""

import copy
import itertools

from ..runs.tables.stages import CHANGES, STAYS
from .document import EXACT, LEFT_OUT, NEAREST, Note, number_in

_REPEATED = ("linkers", "link", "wall", "tether", "pull", "nucleation", "monomers", "filament", "particles", "body")
_ABSENT = {
    "linkers": ("count", 0),
    "nucleation": ("total_rate", "0 1/s"),
    **{name: ("active", False) for name in ("link", "wall", "tether", "pull", "filament")},
}
"""What a table has while what it describes is not there."""
_WITHOUT = {"speed": "0 um/s", "unbinding_force": "1e+06 pN", "stall_force": "1e+06 pN", "rest_length": "0 um"}
_WITHOUT |= {"walks_backward": False, "same_filament": False, "propulsion": "0 pN", "side": "inside", "nodes": "all"}
_WITHOUT |= {"whole": True, "contacts": True}
"""Values that say the same as none."""
_NOT_COMPARED = ("duration", "longest", "name", "type", "seed", "platform")
_PLACES = ("position", "inside", "direction", "orientation", "nodes", "tangents", "file", "start", "height", "normal")
"""Where filaments begin, which is past in later runs."""
_NEEDS = "stages: {}"


def add_stages(document, later, runs, unbound, deleted, cuts):
    """Make a Document of the first run one of all.

    Parameters
    ----------
    document : Document
        Of the first run, changed in place.
    later : list of Document
        Of the runs that follow.
    runs : list of Settings
        Those of all runs.
    unbound : list of dict
        Of later runs: which unbound hands have taken their linkers away before, by names.
    deleted : list of dict
        Of later runs: how many filaments go before, None for all, by numbers of their tables.
    cuts : list of dict
        Of later runs: the planes that cut filaments before, by numbers of their tables.
    """
    stages = [_plain(own) for own in (document, *later)]
    simulation = document.tables_called("[simulation]")[0]
    durations = [own["simulation"][0]["duration"] for own in stages]
    simulation.entries = [entry for entry in simulation.entries if entry[0] != "duration"]
    known = {}
    for note in (note for own in (document, *later) for note in own.notes):
        known.setdefault((note.kind, note.text), note)
    for own in later:
        for note in own.notes:
            if known[note.kind, note.text] is note:
                document.note(note.kind, note.text, note.line, note.needs)
    _with_two_hands(stages, document)
    for name in _REPEATED:
        _complete(name, stages, document, later)
    _longest(stages, document)
    _name_all_held(stages, document)
    _give_diameters(stages, document)
    for number, (own, duration, run) in enumerate(zip(stages, durations, runs)):
        table = document.table("[[stage]]", run.line)
        table.add("name", f"run {number + 1}")
        table.add("duration", duration, Note(EXACT, f"run {number + 1}", run.line))
        if number:
            _add_changes(document, stages[number - 1], own, run.line, unbound[number - 1])
            for index, count in deleted[number - 1].items():
                _add_table(
                    document, f"[stage.filament.{index + 1}]", {"delete": {} if count is None else {"count": count}}
                )
            if cuts[number - 1] and document.tables_called("[box]"):
                document.note(LEFT_OUT, "planes that cut", run.line, _NEEDS.format("cuts in a periodic box"))
                cuts[number - 1].clear()
            for index, planes in cuts[number - 1].items():
                _add_table(document, f"[stage.filament.{index + 1}]", {"cut": planes})


def _plain(document):
    # Dicts by the names of tables: lists of them.
    found = {}
    for table in document.tables:
        parent, _, inner = table.header.strip("[]").partition(".")
        if inner:
            found[parent][-1][inner] = {key: value for key, value, _ in table.entries if key is not None}
            continue
        values = {key: copy.deepcopy(value) for key, value, _ in table.entries if key is not None}
        found.setdefault(table.header.strip("[]"), []).append(values)
    return found


def _same_as(name, table, place, others):
    # Which of others is of the same thing as a table: linkers by their names, others by their places; or None.
    if name == "linkers":
        return next((other for other in others if other.get("name") == table.get("name")), None)
    return others[place] if place < len(others) else None


def _complete(name, stages, document, later):
    # Every stage has the same tables: those that are not there in it, as such.
    order = []
    for own, source in zip(stages, (document, *later)):
        for place, table in enumerate(own.get(name, [])):
            if _same_as(name, table, place, [other for other, *_ in order]) is None:
                order.append((table, source.tables_called(f"[[{name}]]")[place], source))
    for number, own in enumerate(stages):
        there, complete = own.get(name, []), []
        for index, (table, source, whose) in enumerate(order):
            mine = _same_as(name, table, index, there)
            if mine is not None:
                complete.append(mine)
                continue
            absent = {**table, **dict([_ABSENT[name]])} if name in _ABSENT else dict(table)
            absent.pop("bound", None)
            if "contacts" not in own:
                absent.pop("contact_diameter", None)
            complete.append(absent)
            if number == 0:
                _write_absent(name, absent, source, whose, document)
        if complete:
            own[name] = complete


def _inner_tables(document, table):
    # Those behind a table that belong to it, such as [filament.growth].
    found = []
    for own in document.tables[next(i for i, one in enumerate(document.tables) if one is table) + 1 :]:
        if not own.header.startswith(f"[{table.header.strip('[]')}."):
            break
        found.append(own)
    return found


def _write_absent(name, values, source, later, document):
    # Behind the last table of its kind, or before [simulation], as TOML takes them in any order.
    table = copy.copy(source)
    notes = {key: note for key, _, note in source.entries if key is not None}
    inner = _inner_tables(later, source)
    names = [own.header.strip("[]").partition(".")[2] for own in inner]
    table.entries = [(key, value, notes.get(key)) for key, value in values.items() if key not in names]
    if name == "linkers" and "anchors" in values:
        table.comment(Note(NEAREST, "its anchors are there from the beginning", source.line))
    if name == "body":
        table.comment(Note(NEAREST, "it is there from the beginning", source.line))
    same = [index for index, other in enumerate(document.tables) if other.header == source.header]
    place = len(document.tables) - 1
    if same:
        place = same[-1] + 1 + len(_inner_tables(document, document.tables[same[-1]]))
    document.tables[place:place] = [table, *inner]


def _with_two_hands(stages, document):
    # Where hands differ in one stage, all say both.
    names = {table.get("name") for own in stages for table in own.get("linkers", []) if "hands" in table}
    for own in stages:
        for table in own.get("linkers", []):
            if table.get("name") in names and "hand" in table:
                hand = table.pop("hand")
                table["hands"] = [hand, dict(hand)]
    for table in document.tables_called("[[linkers]]"):
        if table.value("name") in names and table.value("hand") is not None:
            table.entries = [
                ("hands", [value, value], note) if key == "hand" else (key, value, note)
                for key, value, note in table.entries
            ]


def _longest(stages, document):
    # Of filaments that grow, the same in all stages.
    for name in ("filament", "nucleation"):
        for index, table in enumerate(document.tables_called(f"[[{name}]]")):
            growths = [own[name][index].get("growth") for own in stages if index < len(own.get(name, []))]
            lengths = [own["longest"] for own in growths if own is not None and "longest" in own]
            if not lengths:
                continue
            longest = max(lengths, key=number_in)
            if table.value("growth") is not None:
                table.value("growth")["longest"] = longest
            for inner in _inner_tables(document, table):
                inner.entries = [
                    (key, longest if key == "longest" else value, note) for key, value, note in inner.entries
                ]


def _name_all_held(stages, document):
    # A wall that holds some things in a stage says in all of them what it holds.
    walls = document.tables_called("[[wall]]")
    for index, table in enumerate(walls):
        if not any("holds" in own["wall"][index] for own in stages):
            continue
        for own in stages:
            names = [one["name"] for kind in ("filament", "body") for one in own.get(kind, [])]
            own["wall"][index].setdefault("holds", list(dict.fromkeys(names)))
        if table.value("holds") is None:
            table.add("holds", stages[0]["wall"][index]["holds"], Note(EXACT, "all"))


def _give_diameters(stages, document):
    # Contacts of bodies alone have one for fibers that come later; and fibers that have a contact_diameter in a stage
    # have one in all in which there is one for all.
    there = (own["contacts"][0] for own in stages if "contacts" in own)
    later = next((own["diameter"] for own in there if "diameter" in own), None)
    for table in document.tables_called("[contacts]"):
        if later is not None and table.value("diameter") is None:
            table.add("diameter", later, Note(EXACT, "of fibers that come later"))
            stages[0]["contacts"][0]["diameter"] = later
    for name in ("filament", "nucleation"):
        for index in range(len(stages[0].get(name, []))):
            if not any("contact_diameter" in own[name][index] for own in stages):
                continue
            for own in stages:
                diameter = own.get("contacts", [{}])[0].get("diameter")
                if diameter is not None:
                    own[name][index].setdefault("contact_diameter", diameter)


def _add_changes(document, before, after, line, unbound):
    for name in dict.fromkeys((*before, *after)):
        if name in ("title", "stage"):
            continue
        if name not in CHANGES:
            if before.get(name) != after.get(name):
                document.note(LEFT_OUT, f"another [{name}] in a later run", line, _NEEDS.format(name))
            continue
        pairs = list(zip(before.get(name, [{}]), after.get(name, [{}])))
        for index, (first, second) in enumerate(pairs):
            if name in ("contacts", "flow") and second == {}:
                change = {"active": False} if first and first.get("active", True) else {}
            elif first.get("shape") != second.get("shape"):
                change = {}
                _leave_out(document, f"another shape of {name}", line, "shape")
            else:
                change = _change(document, name, first, second, line)
            if name == "linkers":
                _count_bound(first, second, change)
                gone = unbound.get(second.get("name"), set()) | unbound.get("couple", set())
                if gone:
                    change["keep"] = "both hands bound" if len(gone) == 2 else "bound"
                    if len(gone) == 1:
                        text = f"{second['name']} that go if {', '.join(gone)} = 0: here if no hand is bound"
                        document.note(NEAREST, text, line)
            if change:
                _add_table(document, f"[stage.{name}.{index + 1}]" if name in _REPEATED else f"[stage.{name}]", change)


def _add_table(document, header, change):
    # To one of the same stage, if there is one.
    of_stage = list(itertools.takewhile(lambda own: own.header != "[[stage]]", reversed(document.tables)))
    table = next((own for own in of_stage if own.header == header), None) or document.table(header)
    for key, value in change.items():
        table.add(key, value)


def _count_bound(first, second, change):
    change.pop("bound", None)
    more = second.get("bound", 0) - first.get("bound", 0)
    if "count" in change and more > 0:
        change["bound"] = more


def _change(document, name, first, second, line):
    # Keys of a table that are others in the second one.
    change = {}
    for key in dict.fromkeys((*first, *second)):
        one, other = first.get(key), second.get(key)
        if one == other or key in _NOT_COMPARED or (name == "filament" and key in _PLACES):
            continue
        if key == "anchors" and one and other and len(one) == len(other):
            # Drawn anew, at random.
            continue
        if name in CHANGES and key not in CHANGES[name] or key in STAYS.get(name, ()):
            _leave_out(document, f"another {key} of {name}", line, key)
        elif key in ("stall_force", "walks_backward") and "speed" not in second:
            continue
        elif key == "contact_diameter" and key not in second:
            # Nothing touches anything then.
            continue
        elif key not in second:
            if key == "active":
                change[key] = True
            elif key in _WITHOUT:
                change[key] = _WITHOUT[key]
            else:
                _leave_out(document, f"no {key} of {name}", line, key)
        elif key == "active" or not isinstance(one, dict) or not isinstance(other, dict):
            change[key] = other
        else:
            inner = _change(document, key, one, other, line)
            if inner:
                change[key] = inner
    return change


def _leave_out(document, text, line, key):
    document.note(LEFT_OUT, f"{text} in a later run", line, _NEEDS.format(f"another {key}"))
