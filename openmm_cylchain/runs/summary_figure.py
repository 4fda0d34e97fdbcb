"""The figure of a run: conformations, energies, tangent correlation and joint angles against theory."""

import io

import numpy as np
import scipy
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .. import theory
from ..analysis.bending import joint_cosines, tangent_correlation
from ..analysis.filament_shapes import segment_lengths
from ..analysis.statistics import mean_with_error
from ..filaments.straight_segments import STRAIGHT_SEGMENTS
from ..output.colors import FILAMENT_COLORS, colors_of_filaments, spring_colors
from ..output.files import write_atomically
from ..output.linker_records import LINKER_RECORD
from ..output.read_tables import read_reports, read_table
from ..output.record_file import read_records
from ..output.run_tables import MILLISECOND
from ..units.quantities import PICONEWTON, thermal_energy
from ..units.text import time_unit
from .configuration import linker_labels
from .conformations import Conformations
from .description import loads_of_filaments
from .figure_style import FONT_SIZE, legend, legend_below, length_unit
from .growth_panels import draw_growth
from .stage_summary import mark_stages
from .summary import (
    extensions,
    group_labels,
    group_members,
    has_exact_extension,
    is_in_equilibrium,
    members_in_all_frames,
)

_COLOURS = (*FILAMENT_COLORS, "#CC79A7", "#000000")
_EXACT_COLOUR = "0.25"  # Of a line that is that of several kinds of filaments.
_STRETCHING_COLOUR, _BENDING_COLOUR = "#D55E00", "#0072B2"
_LEAST_ANGLE = 1e-9


def write_figure(configuration, directory, trajectory, network):
    """Draw the figure of a run into its directory as PNG.

    See ``summary.load_trajectory``; ``network`` is its Course, or None.
    """
    # Titles and names are of users: "$" is no mathematics in them.
    with rc_context({"text.parse_math": False}):
        image = _draw(configuration, directory, trajectory, network)
    write_atomically(directory.figure, image)


def _draw(configuration, directory, trajectory, network):
    has_forces = bool(configuration.walls or configuration.contacts_of_filaments)
    grow = [group.growth is not None for group in configuration.filaments]
    # They have a row of their own, unless there is nothing to compare beside them.
    own_row = any(grow) and (network is not None or not all(grow))
    rows = 2 + own_row + bool(configuration.linkers) + has_forces
    figure = Figure(figsize=(12, 4.75 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    figure.get_layout_engine().set(w_pad=0.12, h_pad=0.12, hspace=0.03, wspace=0.03)
    axes = figure.subplots(rows, 2)
    if configuration.title:
        figure.suptitle(configuration.title, fontsize=FONT_SIZE + 3)
    groups = [
        (group, list(members), label, colour)
        for group, members, label, colour in zip(
            configuration.filaments,
            group_members(configuration),
            group_labels(configuration),
            colors_of_filaments(len(configuration.filaments)),
        )
    ]
    still = [
        (group, members_in_all_frames(configuration, members, trajectory), *others)
        for (group, members, *others), grows in zip(groups, grow)
        if not grows
    ]
    still = [entry for entry in still if entry[1]]
    temperature = configuration.solvent.temperature
    energies = read_table(directory.energies)
    labels = linker_labels(configuration)
    colours_of_linkers = spring_colors([own.kind.is_motor for own in configuration.linkers])
    conformations = Conformations(
        configuration,
        [(group, members) for group, members, *_ in groups],
        loads_of_filaments(configuration),
        trajectory,
        read_records(directory.linker_places) if configuration.linkers else np.zeros(0, LINKER_RECORD),
        list(zip(labels, colours_of_linkers)),
        (0, -1) if network else (-1,),
        any(own.kind.is_motor for own in configuration.linkers)
        or any(group.propulsion for group, *_ in groups)
        or any(grow),
    )
    if network:
        # Theory is that of free filaments: what they do together says more.
        conformations.draw(axes[0, 0], 0)
        conformations.draw(axes[0, 1], -1)
        _draw_course(axes[1, 0], network)
        _draw_energies(axes[1, 1], groups, temperature, energies)
    else:
        conformations.draw(axes[0, 0], -1)
        _draw_energies(axes[0, 1], groups, temperature, energies)
        if still:
            _draw_tangent_correlation(axes[1, 0], still, temperature, trajectory)
        if any(has_exact_extension(group) for group, *_ in still):
            _draw_extensions(axes[1, 1], still, temperature, trajectory)
        elif any(group.joints for group, *_ in still):
            _draw_joint_angles(axes[1, 1], still, temperature, trajectory)
        elif still:
            _draw_segment_lengths(axes[1, 1], still, temperature, trajectory)
        for axis in axes[1] if not groups else ():
            axis.set_axis_off()
    if any(grow):
        members, colours = group_members(configuration), [colour for *_, colour in groups]
        draw_growth(axes[2 if own_row else 1], configuration, members, colours, directory)
    if configuration.linkers:
        table = read_reports(directory.linkers)
        _draw_numbers_bound(axes[2 + own_row, 0], labels, colours_of_linkers, table)
        _draw_tensions(axes[2 + own_row, 1], labels, colours_of_linkers, table)
    if has_forces:
        _draw_forces(axes[-1], configuration, directory, trajectory.time)
    mark_stages(axes.flat, configuration, low=axes[1, 1] if network else axes[0, 1])
    for axis in axes.flat:
        axis.title.set_fontsize(FONT_SIZE + 1)
        axis.xaxis.label.set_fontsize(FONT_SIZE)
        axis.yaxis.label.set_fontsize(FONT_SIZE)
        axis.tick_params(labelsize=FONT_SIZE - 1)
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=130)
    return image.getvalue()


def _draw_histogram(axis, values, label, colour):
    bins = int(np.clip(2.0 * len(values) ** (1.0 / 3.0), 10, 60))
    axis.hist(values, bins=bins, density=True, color=colour, alpha=0.35, label=label)


def _time_unit(time):
    name, length = time_unit(time)
    return name.replace("us", "µs"), length


def _times(column):
    # A column of times in ms, in the unit that is named.
    name, length = _time_unit(MILLISECOND * column[-1])
    return name, MILLISECOND * column / length


def _draw_course(axis, network):
    name, time = _times(network.times)
    for number, (label, values) in enumerate(network.shares.items()):
        axis.plot(time, values, ("-", "--", "-.", ":")[number], color=_COLOURS[number], linewidth=1.6, label=label)
    axis.set_xlim(time[0], time[-1])
    axis.set_ylim(0.0, 1.05 * axis.dataLim.y1)
    axis.set_xlabel(f"time ({name})")
    axis.set_title("All filaments together")
    legend(axis, loc="upper center", bbox_to_anchor=(0.5, -0.15))


def _draw_numbers_bound(axis, labels, colours, table):
    name, time = _times(table["time (ms)"][:, 0])
    for number, label in enumerate(labels):
        for state, line in (("both hands bound", "-"), ("one hand bound", ":")):
            axis.plot(
                time,
                table[state][:, number],
                line,
                color=colours[number],
                linewidth=1.5,
                label=f"{label}, {state.removesuffix(' bound')}",
            )
    axis.set_xlim(time[0], time[-1])
    axis.set_ylim(bottom=0.0)
    axis.set_xlabel(f"time ({name})")
    axis.set_ylabel("linkers")
    axis.set_title("Linkers that are bound")
    legend_below(axis)


def _draw_tensions(axis, labels, colours, table):
    name, time = _times(table["time (ms)"][:, 0])
    for number, label in enumerate(labels):
        for which, line, width in (("mean", "-", 1.5), ("maximum", ":", 1.0)):
            axis.plot(
                time,
                table[f"{which} tension (pN)"][:, number],
                line,
                color=colours[number],
                linewidth=width,
                label=f"{label}, {'largest' if which == 'maximum' else which}",
            )
    axis.axhline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axis.set_xlim(time[0], time[-1])
    axis.set_xlabel(f"time ({name})")
    axis.set_ylabel("tension (pN)")
    axis.set_title("Tension of linkers with both hands bound")
    legend_below(axis)


def _draw_forces(axes, configuration, directory, times):
    # Means between reports: at the first one, there are none.
    name, length = _time_unit(times[-1])
    if configuration.walls:
        table = read_reports(directory.wall_forces)
        time, loads = table["time (ms)"][1:, 0] * MILLISECOND / length, table["load (pN)"][1:]
        walls = {(own.number, face): own for own in configuration.walls for face in own.faces}
        # What has more than one Wall is a prism.
        prisms = {own.number for own in configuration.walls if own.first_face}
        faces = zip(table["wall"][0].astype(int), table["face"][0].astype(int))
        for number, (wall, face) in enumerate(faces):
            prism = f"wall {wall}, prism, face {face}"
            label = prism if wall in prisms else _face_label(walls[wall, face], wall, face)
            axes[0].plot(time, loads[:, number], color=_COLOURS[number % len(_COLOURS)], linewidth=1.2, label=label)
    if configuration.contacts_of_filaments:
        table = read_reports(directory.contact_forces)
        time, loads = table["time (ms)"][1:, 0] * MILLISECOND / length, table["load (pN)"][1:]
        axes[1].plot(time, loads.mean(axis=1), color=_COLOURS[0], linewidth=1.5, label="mean over filaments")
        axes[1].plot(time, loads.max(axis=1), ":", color=_COLOURS[0], linewidth=1.0, label="largest")
    titles = "Forces of walls, by faces", "Forces of contacts on a filament"
    for axis, there, title in zip(axes, (configuration.walls, configuration.contacts_of_filaments), titles):
        if not there:
            axis.set_axis_off()
            continue
        axis.set_xlim(0.0, times[-1] / length)
        axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))
        axis.set_xlabel(f"time ({name})")
        axis.set_ylabel("sum of forces (pN)")
        axis.set_title(title)
        legend_below(axis)


def _face_label(wall, number, face):
    # As files name shapes.
    kind = type(wall.shape).__name__.lower().replace("slab", "slit")
    side = {"inside": "", "outside": "outside of a ", "surface": "surface of a "}[wall.side]
    label, faces = f"wall {number}, {side}{kind}", len(wall.shape.faces)
    if faces == 6:
        return f"{label}, {('lower', 'upper')[face % 2]} {'xyz'[face // 2]}"
    return f"{label}, {('upper', 'lower')[face]} face" if faces == 2 else label


def _draw_energies(axis, groups, temperature, energies):
    if not groups:
        return axis.set_axis_off()
    kT = thermal_energy(temperature)
    name, time = _times(energies["time (ms)"])
    kinds = [group for group, *_ in groups]
    segments = np.array([group.count * group.segments for group in kinds])
    joints = np.array([group.count * group.joints for group in kinds])
    means = [theory.chain_mean_energies(one.type, one.segments, temperature, one.planar) for one in kinds]
    stretching, bending = np.array(means).T / kT
    kind = _kind(groups)
    curves = [("stretching", "segment", kind.name, np.average(stretching, weights=segments), _STRETCHING_COLOUR)]
    if np.any(joints * bending):
        curves.append(("bending", "joint", kind.bend_name, np.average(bending, weights=joints), _BENDING_COLOUR))
    free = "exact in equilibrium" if all(map(is_in_equilibrium, kinds)) else "free chains"
    for label, column, per, exact, colour in curves:
        values = energies[f"{label} energy per {column} (kT)"]
        axis.plot(time, values, color=colour, linewidth=1.0, alpha=0.8, label=f"{label}, per {per}")
        axis.axhline(exact, color=colour, linewidth=1.8, linestyle="--", label=f"{free}: {exact:.4g}")
    axis.set_xlim(time[0], time[-1])
    bottom, top = axis.get_ylim()
    axis.set_ylim(min(0.0, bottom), top + 0.28 * (top - min(0.0, bottom)))
    axis.set_xlabel(f"time ({name})")
    axis.set_ylabel("energy (kT)")
    axis.set_title("Energies, averaged over all filaments")
    legend(axis, loc="upper center", ncols=len(curves))


def _draw_tangent_correlation(axis, groups, temperature, trajectory):
    axis.set_title("Correlation of tangents along a filament")
    drawn = [entry for entry in groups if entry[0].segments > 1 and not entry[0].closed]
    unit, scale = length_unit(max(group.segments * group.type.segment_length for group, *_ in groups))
    axis.set_xlabel(f"distance s along the filament ({unit})")
    axis.set_ylabel("⟨t(0)·t(s)⟩")
    if not drawn:
        axis.text(0.5, 0.5, "single segments or rings", transform=axis.transAxes, ha="center", fontsize=FONT_SIZE)
        return
    exact: dict[tuple[float, bool], tuple[float, str]] = {}
    for group, members, label, colour in drawn:
        correlation = tangent_correlation(trajectory, members)
        every = slice(None, None, max(1, len(correlation.lag) // 20))
        axis.errorbar(
            correlation.contour_distance[every] / scale,
            correlation.mean[every],
            correlation.standard_error[every],
            color=colour,
            fmt="o",
            markersize=4,
            capsize=2.5,
            linewidth=1.2,
            label=label,
        )
        theoretical = theory.chain_persistence_length(group.type, temperature, group.planar), group.planar
        length, own = group.segments * group.type.segment_length, colour
        if theoretical in exact:
            length, own = max(length, exact[theoretical][0]), _EXACT_COLOUR
        exact[theoretical] = length, own
    for (persistence, planar), (length, colour) in exact.items():
        if persistence > 0:
            distance = np.linspace(0.0, length, 200)
            axis.plot(
                distance / scale,
                theory.wlc_tangent_correlation(distance, persistence, planar),
                color=colour,
                linestyle="--",
                linewidth=1.8,
                label=f"exp(-s/{'2' * planar}lp), lp = {_format_length(persistence)}",
            )
    axis.set_xlim(0.0, max(group.segments * group.type.segment_length for group, *_ in drawn) / scale)
    if len(drawn) == 1:
        legend(axis, loc="best")
    else:
        legend_below(axis)


def _format_length(length):
    unit, scale = length_unit(length)
    return f"{length / scale:.4g} {unit}"


def _draw_joint_angles(axis, groups, temperature, trajectory):
    kinds = {}
    for group, members, label, colour in groups:
        if not group.joints:
            continue
        cosines = np.clip(np.concatenate([c.ravel() for c in joint_cosines(trajectory, members)]), -1.0, 1.0)
        angles = np.degrees(np.arccos(cosines))
        _draw_histogram(axis, angles, label, colour)
        if group.type.segment_kind is not STRAIGHT_SEGMENTS:
            # Those of beads have no distribution that holds all along the chain, and of those of beam elements there is
            # no closed form.
            continue
        widest, own = angles.max(), colour
        kind = group.type, group.planar, is_in_equilibrium(group)
        if kind in kinds:
            widest, own = max(widest, kinds[kind][1]), _EXACT_COLOUR
        kinds[kind] = group, widest, own
    for group, widest, colour in kinds.values():
        _draw_exact_joint_angles(axis, group, temperature, widest, colour)
    axis.set_xlim(left=0.0)
    ends = dict.fromkeys(group.type.segment_kind.bend_ends for group, *_ in groups)
    axis.set_xlabel(f"angle between {' or '.join(ends)} (degrees)")
    axis.set_ylabel("probability density (1/degree)")
    axis.set_title(f"{_kind(groups).bend_name.capitalize()} angles")
    legend(axis, loc="upper right")


def _draw_exact_joint_angles(axis, group, temperature, widest, colour):
    # As fine near zero as the stiffest joints need.
    angle = np.geomspace(_LEAST_ANGLE, np.pi, 20001)
    density = np.ones_like(angle) if group.planar else np.sin(angle)
    if group.type.bending_rigidity > 0:
        with np.errstate(divide="ignore"):
            density *= np.exp(-group.type.bending_energy(np.cos(angle)) / thermal_energy(temperature))
    degrees = np.degrees(angle)
    density /= scipy.integrate.trapezoid(density, degrees)
    shown = degrees <= max(widest, degrees[np.flatnonzero(density > 1e-3 * density.max())[-1]])
    axis.plot(
        degrees[shown],
        density[shown],
        color=colour,
        linewidth=1.8,
        linestyle=_line(group),
        label=_exact_label(group),
    )


def _kind(groups):
    # That of all filaments; of several kinds, the one with the most general words.
    kinds = {group.type.segment_kind for group, *_ in groups}
    return kinds.pop() if len(kinds) == 1 else STRAIGHT_SEGMENTS


def _draw_extensions(axis, groups, temperature, trajectory):
    # Against the tension, in units of the length at rest; a curve for each kind of filament.
    axis.set_title("Extension along the tension, second half of the run")
    axis.set_xlabel("tension (pN)")
    axis.set_ylabel("extension / length at rest")
    kinds = {}
    for group, members, label, colour in groups:
        if has_exact_extension(group):
            kinds.setdefault((group.type, group.segments), []).append(group.tension[0])
            length = group.segments * group.type.segment_length
            value, error = mean_with_error(extensions(group, trajectory, members) / length)
            force = group.tension[0] / PICONEWTON
            axis.errorbar(force, value, error, fmt="o", color=colour, capsize=2.5, label=label)
    for (kind, segments), tensions in kinds.items():
        force = max(tensions) * np.linspace(0.0, 1.0, 100) ** 2
        exact = theory.chain_extension(kind, segments, force, temperature) / (segments * kind.segment_length)
        axis.plot(force / PICONEWTON, exact, color="0.4", linestyle="--", linewidth=1.8, label=f"exact, {kind.name}")
    axis.set_xlim(left=0.0)
    legend(axis, loc="best")


def _draw_segment_lengths(axis, groups, temperature, trajectory):
    kT = thermal_energy(temperature)
    for group, members, label, colour in groups:
        lengths = np.concatenate([values.ravel() for values in segment_lengths(trajectory, members)])
        _draw_histogram(axis, lengths, label, colour)
        if group.type.node_friction > 0.0:
            continue
        width = 6.0 * np.sqrt(kT / group.type.segment_stiffness)
        length = np.linspace(max(0.0, group.type.segment_length - width), group.type.segment_length + width, 2001)
        energy = group.type.stretching_energy(length) / kT
        density = length ** (1 if group.planar else 2) * np.exp(-(energy - energy.min()))
        density /= scipy.integrate.trapezoid(density, length)
        axis.plot(length, density, color=colour, linewidth=1.8, linestyle=_line(group), label=_exact_label(group))
    axis.set_xlabel("segment length (nm)")
    axis.set_ylabel("probability density (1/nm)")
    axis.set_title("Segment lengths")
    legend(axis, loc="best")


def _line(group):
    return "-" if is_in_equilibrium(group) else "--"


def _exact_label(group):
    return "exact" if is_in_equilibrium(group) else "exact for free chains in equilibrium"
