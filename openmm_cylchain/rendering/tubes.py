"""Rays through pixels that meet tubes: which one each pixel shows, how far it is, and its normal."""

from dataclasses import dataclass

import numpy as np

from ..units.types import FloatArray, IntArray
from .camera import Camera

_FRAGMENTS_AT_ONCE = 1_000_000


@dataclass(frozen=True)
class Tubes:
    """Straight tubes with round ends; spheres where both ends are at one place.

    Attributes
    ----------
    ends : (n, 2, 3) array
        In nm.
    radii : (n,) array
        In nm.
    colors : (n, 3) array
        sRGB between 0 and 1.
    shaded : (n,) bool array
        Whether light falls on them; lines of a box are flat.
    """

    ends: FloatArray
    radii: FloatArray
    colors: FloatArray
    shaded: FloatArray

    @classmethod
    def joined(cls, parts: "list[Tubes]") -> "Tubes":
        """All tubes of several."""
        fields = ("ends", "radii", "colors", "shaded")
        return cls(*(np.concatenate([getattr(part, field) for part in parts]) for field in fields))

    @classmethod
    def of_one_kind(cls, ends: FloatArray, radius: float, color: FloatArray, shaded: bool = True) -> "Tubes":
        """Tubes of one radius, and of one color or one each."""
        count = len(ends)
        return cls(
            np.reshape(ends, (count, 2, 3)),
            np.full(count, float(radius)),
            np.broadcast_to(np.asarray(color, dtype=float), (count, 3)),
            np.full(count, shaded),
        )

    def at_least(self, radius: float) -> "Tubes":
        """The same, none thinner than a radius in nm."""
        return Tubes(self.ends, np.maximum(self.radii, radius), self.colors, self.shaded)


@dataclass(frozen=True)
class Hits:
    """What the pixels show that show a tube.

    Attributes
    ----------
    pixels : (m,) int array
        Row times width plus column.
    tubes : (m,) int array
    depths : (m,) array
        Distance from the eye's plane in nm.
    normals : (m, 3) array
        In the camera's axes.
    """

    pixels: IntArray
    tubes: IntArray
    depths: FloatArray
    normals: FloatArray


def cast(camera: Camera, tubes: Tubes) -> Hits:
    """Where the rays through the middles of pixels first meet a tube."""
    ends = camera.seen(tubes.ends)
    # A direction for spheres, too short to be seen.
    round_ones = np.all(ends[:, 0] == ends[:, 1], axis=1)
    ends[round_ones, 1, 0] += 1e-6 * tubes.radii[round_ones]
    depths = np.full(camera.width * camera.height, np.inf)
    owners = np.full(camera.width * camera.height, -1)
    focus = camera.scale * camera.distance
    for tube, column, row in _fragments(camera, ends, tubes.radii, focus):
        x, y = (column + 0.5 - 0.5 * camera.width) / focus, (0.5 * camera.height - row - 0.5) / focus
        distance = _first_meeting(x, y, ends, tubes.radii, tube)
        met = np.isfinite(distance)
        pixel, distance, tube = (row * camera.width + column)[met], distance[met], tube[met]
        np.minimum.at(depths, pixel, distance)
        nearest = distance == depths[pixel]
        owners[pixel[nearest]] = tube[nearest]
    pixels = np.flatnonzero(owners >= 0)
    owner, depth = owners[pixels], depths[pixels]
    row, column = np.divmod(pixels, camera.width)
    x, y = (column + 0.5 - 0.5 * camera.width) / focus, (0.5 * camera.height - row - 0.5) / focus
    points = depth[:, None] * np.stack([x, y, -np.ones_like(x)], axis=1)
    starts, axes = ends[owner, 0], ends[owner, 1] - ends[owner, 0]
    along = np.einsum("ij,ij->i", points - starts, axes) / np.einsum("ij,ij->i", axes, axes)
    normals = points - starts - np.clip(along, 0.0, 1.0)[:, None] * axes
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Hits(pixels, owner, depth, normals)


def _fragments(camera, ends, radii, focus):
    # Pixels that may show a tube, in portions: its line is followed along the axis of the picture along which it is
    # longer, and across as many pixels as it is wide.
    depth = -ends[..., 2]
    x = 0.5 * camera.width + focus * ends[..., 0] / depth
    y = 0.5 * camera.height - focus * ends[..., 1] / depth
    # The outline of a sphere off the middle is longer than wide.
    oblique = np.sqrt(1.0 + ((ends[..., 0] ** 2 + ends[..., 1] ** 2) / depth**2).max(axis=1))
    wide = oblique * focus * radii / (depth.min(axis=1) - radii) + 1.0
    flat = np.abs(x[:, 1] - x[:, 0]) >= np.abs(y[:, 1] - y[:, 0])
    major, minor = np.where(flat[:, None], x, y), np.where(flat[:, None], y, x)
    backwards = major[:, 0] > major[:, 1]
    major[backwards], minor[backwards] = major[backwards, ::-1], minor[backwards, ::-1]
    length = major[:, 1] - major[:, 0]
    slope = np.divide(minor[:, 1] - minor[:, 0], length, out=np.zeros_like(length), where=length > 1e-9)
    limit = np.where(flat, camera.width, camera.height)
    first = np.clip(np.floor(major[:, 0] - wide), 0, limit).astype(int)
    last = np.clip(np.ceil(major[:, 1] + wide), 0, limit).astype(int)
    lines = np.maximum(0, last - first)
    across = (2 * np.ceil(wide * np.sqrt(1.0 + slope**2)) + 1).astype(int)
    total = np.cumsum(lines * across)
    begin = 0
    while begin < len(total):
        done = total[begin - 1] if begin else 0
        end = max(begin + 1, int(np.searchsorted(total, done + _FRAGMENTS_AT_ONCE, "right")))
        own = np.arange(begin, end)
        begin = end
        own = np.repeat(own, lines[own])
        if not len(own):
            continue
        along = first[own] + np.arange(len(own)) - np.searchsorted(own, own)
        middle = np.floor(minor[own, 0] + slope[own] * (along + 0.5 - major[own, 0])).astype(int)
        widths = across[own]
        offset = np.arange(widths.sum()) - np.repeat(np.cumsum(widths) - widths, widths)
        tube, along = np.repeat(own, widths), np.repeat(along, widths)
        aside = np.repeat(middle - widths // 2, widths) + offset
        column, row = np.where(flat[tube], along, aside), np.where(flat[tube], aside, along)
        inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
        yield tube[inside], column[inside], row[inside]


def _first_meeting(x, y, ends, radii, tube):
    # Of the ray t (x, y, -1) with |p - axis|^2 = r^2: a quadratic for the wall, and one for the sphere at an end.
    # Infinite where it misses.
    starts, axes = ends[:, 0], ends[:, 1] - ends[:, 0]
    square, inner = np.einsum("ij,ij->i", axes, axes), -np.einsum("ij,ij->i", axes, starts)
    outer = square * (np.einsum("ij,ij->i", starts, starts) - radii**2) - inner**2
    ray_square = x * x + y * y + 1.0
    ray_axis = x * axes[tube, 0] + y * axes[tube, 1] - axes[tube, 2]
    ray_start = x * starts[tube, 0] + y * starts[tube, 1] - starts[tube, 2]
    a = square[tube] * ray_square - ray_axis**2
    b = -square[tube] * ray_start - inner[tube] * ray_axis
    with np.errstate(invalid="ignore", divide="ignore"):
        distance = (-b - np.sqrt(b * b - a * outer[tube])) / a
        height = inner[tube] + distance * ray_axis
    # Of rays along the axis a vanishes; they meet an end.
    near_end = np.where(np.isfinite(height), height, -1.0 * (ray_axis < 0.0))
    missed = ~np.isfinite(height) & (a > 1e-12 * square[tube] * ray_square)
    which = np.where(near_end <= 0.5 * square[tube], 0, 1)
    at_end = ~((height > 0.0) & (height < square[tube])) & ~missed
    chosen = np.flatnonzero(at_end)
    place = ends[tube[chosen], which[chosen]]
    middle = x[chosen] * place[:, 0] + y[chosen] * place[:, 1] - place[:, 2]
    rest = np.einsum("ij,ij->i", place, place) - radii[tube[chosen]] ** 2
    with np.errstate(invalid="ignore"):
        distance[chosen] = (middle - np.sqrt(middle**2 - ray_square[chosen] * rest)) / ray_square[chosen]
    distance[np.isnan(distance)] = np.inf
    return distance
