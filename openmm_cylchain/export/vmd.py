"""A run as a script for VMD: thick bonds and colors, linkers, crosslinks, the box, walls and a clock."""

from pathlib import Path

import numpy as np

from ..analysis.runs import Run
from ..mechanics.geometry import unrolled
from ..output.files import check_path, write_atomically
from ..rendering.colors import WALL_COLOR, filament_colors, linker_colors, particle_colors
from ..units.text import time_unit
from .drawn import thickness, visible_diameter, walls

_ANGSTROM = 10.0
_FIRST_COLOR = 17  # Those before have a meaning of their own in VMD.

_PROCEDURES = """
proc draw_frame {args} {
    global molecule times time_unit links link_colors link_radius corner walls wall_color \\
        curves curve_colors curve_radii
    set frame [molinfo $molecule get frame]
    graphics $molecule delete all
    graphics $molecule color black
    graphics $molecule text $corner "[lindex $times $frame] $time_unit" size 1.2
    graphics $molecule color $wall_color
    foreach line $walls {
        foreach first [lrange $line 0 end-1] second [lrange $line 1 end] {
            graphics $molecule line $first $second width 2
        }
    }
    foreach color $curve_colors radius $curve_radii lines [lindex $curves $frame] {
        graphics $molecule color $color
        foreach line $lines {
            foreach first [lrange $line 0 end-1] second [lrange $line 1 end] {
                graphics $molecule cylinder $first $second radius $radius resolution 12
                graphics $molecule sphere $second radius $radius resolution 12
            }
        }
    }
    foreach color $link_colors lines [lindex $links $frame] {
        graphics $molecule color $color
        foreach {first second} $lines {
            graphics $molecule cylinder $first $second radius $link_radius resolution 8
            graphics $molecule sphere $first radius [expr {1.6 * $link_radius}] resolution 8
            graphics $molecule sphere $second radius [expr {1.6 * $link_radius}] resolution 8
        }
    }
}
trace add variable vmd_frame($molecule) write draw_frame
draw_frame
display resetview
"""


def write_vmd(run: Run, path: str | Path) -> None:
    """Write a script that opens a run in VMD: ``vmd -e FILE``.

    It loads ``topology.psf`` and ``trajectory.dcd`` from the directory of the run, which must stay where it is. Bonds
    are as thick as filaments, or as can be seen. Linkers that join two places, crosslinks, lines on walls,
    curves of beam elements and filaments that come and go are drawn for each frame, and the time, which VMD does not
    read from DCD files.

    Parameters
    ----------
    run : Run
        See ``analysis.load``.
    path : str or Path
        Ends in ``.tcl``.
    """
    path = check_path(path, ".tcl")
    directory = run.path.resolve()
    extent = float(np.linalg.norm(np.ptp(run.points(-1), axis=0)))
    name, length = time_unit(float(run.times[-1]))
    lines = [
        f"set molecule [mol new {_word(directory / 'topology.psf')} type psf waitfor all]",
        f"mol addfile {_word(directory / 'trajectory.dcd')} type dcd last {len(run) - 1} waitfor all molid $molecule",
        f"mol rename $molecule {_word(run.title or run.path.name)}",
        "mol delrep 0 $molecule",
        "color Display Background white",
        "display projection Perspective",
    ]
    # Licorice knows the radius of bonds. Those of beam elements are chords, and those of filaments that are not there
    # now are dots: curves are drawn in their place.
    widest, passing = max((own.diameter for own in run.filaments), default=0.0), run.passing
    curves: dict[int, tuple[float, list[int]]] = {}
    for number, (kind, color) in enumerate(filament_colors(run).items()):
        diameter = max(own.diameter for own in run.filaments if own.label == kind)
        radius = _ANGSTROM * 0.5 * max(diameter, 0.006 * extent * diameter / widest)
        members = [i for i, own in enumerate(run.filaments) if own.label == kind]
        drawn = [i for i in members if run.filaments[i].pieces > 1 or i in passing]
        lines.append(_color(_FIRST_COLOR + number, color))
        if drawn:
            curves[_FIRST_COLOR + number] = radius, drawn
        if len(drawn) == len(members):
            continue
        hidden = " ".join(str(node) for i in drawn for own in _particles(run.filaments[i]) for node in own)
        selection = (
            f"resname {_word(run.filaments[members[0]].type.name)}{f' and not index {hidden}' if hidden else ''}"
        )
        if run.filaments[members[0]].load:
            straight = (run.filaments[i].nodes for i in members if i not in drawn)
            selection = f"index {' '.join(str(node) for nodes in straight for node in nodes)}"
        lines += [
            f"mol representation Licorice {radius:.6g} 12 12",
            f"mol selection {{{selection}}}",
            f"mol color ColorID {_FIRST_COLOR + number}",
            "mol material AOChalky",
            "mol addrep $molecule",
        ]
    first = _FIRST_COLOR + len(filament_colors(run))
    lines += [_color(first + kind, color) for kind, color in enumerate(linker_colors(run))]
    particle_color = first + len(run.spring_names) + 1
    for number, (name, color) in enumerate(particle_colors(run).items()):
        groups = [group for group in run.particles if group.name == name]
        lines.append(_color(particle_color + number, color))
        for each in groups:
            selection = f"index {' '.join(map(str, each.indices))}"
            radius = _ANGSTROM * 0.5 * visible_diameter(run, each)
            lines += [
                f"set particles [atomselect $molecule {_word(selection)}]",
                f"$particles set radius {radius:.6g}",
                "$particles delete",
                "mol representation VDW 1.0 16",
                f"mol selection {{{selection}}}",
                f"mol color ColorID {particle_color + number}",
                "mol material AOChalky",
                "mol addrep $molecule",
            ]
    if run.box is not None:
        edges = " ".join(f"{_ANGSTROM * edge:.8g}" for edge in np.diag(run.box))
        lines += ["package require pbctools", f"pbc set {{{edges}}} -all -molid $molecule", "pbc box -molid $molecule"]
    wall_color = first + len(run.spring_names)
    lines.append(_color(wall_color, WALL_COLOR))
    outlines = " ".join("{" + " ".join(map(_point, line)) + "}" for line in walls(run))
    times = " ".join(f"{time / length:.6g}" for time in run.times)
    colors = " ".join(str(first + kind) for kind in range(len(run.spring_names)))
    corner = _ANGSTROM * run.points(-1).max(axis=0)
    lines += [
        f"set times {{{times}}}",
        f"set time_unit {name}",
        f"set curve_colors {{{' '.join(map(str, curves))}}}",
        f"set curve_radii {{{' '.join(f'{radius:.6g}' for radius, _ in curves.values())}}}",
        "set curves {}",
        *(f"lappend curves {{{_curves(run, frame, curves)}}}" for frame in range(len(run) if curves else 0)),
        f"set link_colors {{{colors}}}",
        f"set link_radius {_ANGSTROM * 0.5 * max(0.5 * thickness(run), 0.003 * extent):.6g}",
        f"set wall_color {wall_color}",
        f"set walls {{{outlines}}}",
        f"set corner {_point(corner / _ANGSTROM)}",
        "set links {}",
        *(f"lappend links {{{_links(run, frame)}}}" for frame in range(len(run))),
    ]
    write_atomically(path, ("\n".join(lines) + "\n" + _PROCEDURES).encode())


def _particles(own):
    return own.nodes.tolist(), own.control_points.tolist()


def _curves(run, frame, curves):
    drawn = [unrolled(points) if own.ring else points for own, points in zip(run.filaments, run.curves(frame))]
    kinds = []
    for _, members in curves.values():
        kinds.append("{" + " ".join("{" + " ".join(map(_point, drawn[i])) + "}" for i in members) + "}")
    return " ".join(kinds)


def _links(run, frame):
    kinds = []
    for kind in range(len(run.spring_names)):
        ends, _ = run.springs(frame, kind)
        kinds.append("{" + " ".join(_point(place) for place in ends.reshape(-1, 3)) + "}")
    return " ".join(kinds)


def _point(place):
    return "{" + " ".join(f"{_ANGSTROM * x:.7g}" for x in place) + "}"


def _color(number, color):
    parts = " ".join(f"{int(color[i : i + 2], 16) / 255:.4f}" for i in (1, 3, 5))
    return f"color change rgb {number} {parts}"


def _word(text):
    # As one word of Tcl, whatever is in it.
    quoted = "".join(f"\\{letter}" if letter in '\\"$[]{} ;\t' else letter for letter in str(text))
    return quoted.replace("\n", " ") or "{}"
