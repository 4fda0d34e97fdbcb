"""The panels of a figure that show filaments and linkers of a frame, projected on the xy plane."""

import itertools

import numpy as np
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.patches import Circle
from matplotlib.transforms import ScaledTranslation

from ..analysis.filament_shapes import filament_curves
from ..filaments.body import BODY_NAME
from ..mechanics.geometry import unrolled
from ..output.colors import PLUS_END, PLUS_END_COLOR, colors_of_filaments
from ..units.text import time_unit
from .figure_style import FONT_SIZE, legend, length_unit
from .stages import frame_steps

_NARROWEST = 0.4


class Conformations:
    """Draws frames of a run, all with one framing.

    Filaments of one [[filament]] table have one colour, or one for each load. In a periodic box, what leaves it goes on
    at the opposite face.

    Parameters
    ----------
    groups : list of (FilamentGroup, members)
    loads : list of str
        Of each filament, see ``description.loads_of_filaments``.
    records : (n,) array
        Of linkers, see ``LINKER_RECORD``; empty without them.
    springs : list of (label, colour)
        Of kinds of linkers.
    frames : sequence of int
        Those that are drawn.
    polar : bool
        Whether ends are marked.
    """

    def __init__(self, configuration, groups, loads, trajectory, records, springs, frames, polar):
        self._box = None if configuration.box is None else np.array(configuration.box)[:2]
        self._steps = frame_steps(configuration)
        self._trajectory, self._records = trajectory, records
        self._groups = [
            (group, load, [own for own in members if loads[own] == load])
            for group, members in groups
            for load in dict.fromkeys(loads[own] for own in members)
        ]
        kinds = dict.fromkeys((_kind(group), load) for group, load, _ in self._groups)
        self._colours = dict(zip(kinds, colors_of_filaments(len(kinds))))
        self._springs, self._polar = springs, polar
        radii = [np.tile(own.body.radii, own.count) for own in configuration.bodies]
        self._radii = np.concatenate([np.zeros(0), *radii])
        self._body_points = [atom.index for atom in trajectory.topology.atoms if atom.name == BODY_NAME]
        points = [own[:, :2] for frame in frames for *_, lines in self._lines(frame) for own in lines]
        points += [
            places + shift * radius
            for frame in frames
            for places, radius in [self._spheres(frame)]
            for shift in (-1, 1)
        ]
        points = np.concatenate(points) if any(map(len, points)) else np.zeros((1, 2))
        if self._box is not None:
            points = np.array([np.zeros(2), self._box])
        self._lower, self._upper = points.min(axis=0), points.max(axis=0)

    def _lines(self, frame):
        # Of each group and load: the curves of its filaments.
        for group, load, members in self._groups:
            curves = [own[0] for own in filament_curves(self._trajectory[frame], members)]
            # Filaments that are not there have NaN.
            yield group, load, [unrolled(own) if group.closed else own for own in curves if np.isfinite(own).all()]

    def draw(self, axis, frame):
        """Draw a frame, with a legend and a scale bar below."""
        named, ends = set(), []
        for group, load, lines in self._lines(frame):
            segments = np.concatenate(
                [np.zeros((0, 2, 2)), *(np.stack([own[:-1, :2], own[1:, :2]], axis=1) for own in lines)]
            )
            kind = _kind(group), load
            label = None if kind in named else self._label(kind)
            self._draw_segments(axis, segments, self._colours[kind], 1.8, 2, label)
            named.add(kind)
            ends += [] if group.closed else [own[-1, :2] for own in lines]
        self._draw_spheres(axis, frame)
        if self._polar and ends:
            places = np.array(ends) if self._box is None else np.mod(ends, self._box)
            axis.plot(*places.T, "o", color=PLUS_END_COLOR, markersize=3.5, zorder=3, label=PLUS_END)
        step = self._records["step"] == self._steps[frame % len(self._trajectory)]
        for number, (label, colour) in enumerate(self._springs):
            own = self._records[step & (self._records["type"] == number)]
            places = own["places"][~np.isnan(own["places"]).any(axis=(1, 2))].astype(float)
            label = f"{label}, both hands bound" if len(places) else None
            self._draw_segments(axis, places[:, :, :2], colour, 1.6, 4, label)
        self._frame(axis)
        time = self._trajectory.time[frame]
        name, length = time_unit(time)
        when = f"at {time / length:.4g} {name.replace('us', 'µs')}" if time > 0.0 else "at the start"
        what = "Filaments" if self._groups else "Bodies"
        axis.set_title(f"{what} {when}, projected on the xy plane")
        # Below the scale bar and its length, which it would hide in a narrow frame.
        below = axis.transAxes + ScaledTranslation(0.0, -2.4 * FONT_SIZE / 72.0, axis.figure.dpi_scale_trans)
        legend(axis, loc="upper left", bbox_to_anchor=(0.0, -0.01), bbox_transform=below, borderaxespad=0.0)
        _draw_scale_bar(axis)

    def _spheres(self, frame):
        # Centres (n, 2) in nm and radii (n, 1) of the spheres of bodies.
        there = self._radii > 0.0
        places = self._trajectory.xyz[frame, np.array(self._body_points, dtype=int)[there], :2]
        return places.reshape(-1, 2), self._radii[there][:, None]

    def _draw_spheres(self, axis, frame):
        places, radii = self._spheres(frame)
        if self._box is not None:
            places = np.mod(places, self._box)
        if not len(places):
            return
        circles = [Circle(place, float(radius[0])) for place, radius in zip(places, radii)]
        axis.add_collection(PatchCollection(circles, facecolor="0.8", edgecolor="0.4", zorder=1.5), autolim=False)
        axis.plot([], [], "o", color="0.8", markeredgecolor="0.4", label=f"{len(circles)} × spheres of bodies")

    def _label(self, kind):
        own = [(group, members) for group, load, members in self._groups if (_kind(group), load) == kind]
        group = own[0][0]
        own = [(group, members) for group, members in own if not group.is_reserve]
        if not own:
            return f"{group.type.name} that begin"
        counts = sorted({one.segments for one, _ in own})
        text = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
        segments = f"{text} {group.type.segment_kind.name}{'s' * (counts != [1])}"
        label = f"{sum(len(members) for _, members in own)} × {group.type.name}, {segments}"
        if group.growth is not None:
            label += " at first"
        return f"{label}, {kind[1]}" if kind[1] else label

    def _draw_segments(self, axis, segments, colour, width, order, label):
        if self._box is not None and len(segments):
            # At every image that one of its ends is in; the frame cuts off the rest.
            cells = np.floor(segments / self._box)
            images = [np.stack([cells[:, x, 0], cells[:, y, 1]], axis=1) for x, y in itertools.product((0, 1), (0, 1))]
            segments = np.concatenate([segments - (own * self._box)[:, None] for own in images])
            segments = np.unique(segments, axis=0)
        lines = LineCollection(segments, colors=colour, linewidths=width, zorder=order, capstyle="round")
        axis.add_collection(lines, autolim=False)
        if label is not None:
            axis.plot([], [], color=colour, linewidth=width, label=label)

    def _frame(self, axis):
        center, half = 0.5 * (self._lower + self._upper), 0.5 * (self._upper - self._lower)
        if self._box is None:
            # With a margin, and no narrower than two fifths of its width or height.
            half = np.maximum(half, _NARROWEST * half.max()) + 0.05 * half.max()
        axis.set_xlim(center[0] - half[0], center[0] + half[0])
        axis.set_ylim(center[1] - half[1], center[1] + half[1])
        axis.set_aspect("equal")
        axis.set_xticks([])
        axis.set_yticks([])
        for spine in axis.spines.values():
            spine.set_color("0.7")


def _kind(group):
    # Places for filaments like those of a [[filament]] table are of their kind.
    return group.table or group.path


def _draw_scale_bar(axis):
    # As long as a round number that is closest below a quarter of the width, below the frame on the right.
    axis.apply_aspect()
    width = np.diff(axis.get_xlim())[0]
    decade = 10.0 ** np.floor(np.log10(width / 4))
    length = max(step * decade for step in (1, 2, 5) if step * decade <= width / 4)
    unit, scale = length_unit(length)
    transform = axis.transAxes
    fraction = length / width
    axis.plot(
        [1.0 - fraction, 1.0],
        [-0.03, -0.03],
        color="black",
        linewidth=3,
        transform=transform,
        clip_on=False,
        solid_capstyle="butt",
    )
    axis.text(
        1.0 - fraction / 2,
        -0.045,
        f"{length / scale:g} {unit}",
        transform=transform,
        ha="center",
        va="top",
        fontsize=FONT_SIZE,
    )
