"""The camera: from places in nm to pixels, with equal axes, in perspective or as good as parallel."""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..units.types import FloatArray

PROJECTIONS = ("perspective", "orthographic")

# Of the distance to the eye in half diagonals of the scene. Rays of the second are parallel to a pixel.
_DISTANCES = {"perspective": 3.5, "orthographic": 3000.0}
_MARGIN = 0.06
# Of the smallest extent over the middle one: what is flatter is seen from above. Of the second extent over the first:
# what is thinner is seen from its side.
_FLAT = 0.35
_THIN = 0.35
_OBLIQUE = np.array([-0.42, 0.83, -0.36])


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Attributes
    ----------
    center : (3,) array
        In nm; it is in the middle of the picture.
    axes : (3, 3) array
        Unit vectors to the right, upwards and to the viewer.
    distance : float
        From the eye to the center in nm.
    scale : float
        Pixels per nm in the plane through the center.
    width, height : int
        Of the picture in pixels.
    depths : (float, float)
        Distances from the eye, in nm, between which things fade into the background.
    """

    center: FloatArray
    axes: FloatArray
    distance: float
    scale: float
    width: int
    height: int
    depths: tuple[float, float]

    def seen(self, positions: FloatArray) -> FloatArray:
        """Places (..., 3) in nm from the eye: to the right, upwards and towards the viewer (negative)."""
        return (positions - self.center) @ self.axes.T - [0.0, 0.0, self.distance]

    def places(self, positions: FloatArray) -> FloatArray:
        """Places (..., 2) in the picture of positions (..., 3) in nm: pixels to the right and upwards of its middle."""
        seen = self.seen(positions)
        return self.distance * self.scale * seen[..., :2] / -seen[..., 2:]

    def enlarged(self, factor: int) -> "Camera":
        """The same view with more pixels."""
        return replace(self, scale=self.scale * factor, width=self.width * factor, height=self.height * factor)


def camera_on(
    points: FloatArray,
    size: tuple[int, int],
    projection: str = "perspective",
    view: FloatArray | None = None,
    turn: float = 0.0,
) -> Camera:
    """A camera that sees all points (n, 3) in nm.

    Parameters
    ----------
    points : (n, 3) array
    size : (width, height) in pixels
    projection : {"perspective", "orthographic"}
    view : (3,) array, optional
        Direction in which the camera looks. If not given, from above onto what is flat, from the side onto what is
        thin, and else obliquely.
    turn : float
        Angle in degrees by which the camera is turned about the vertical.
    """
    if projection not in PROJECTIONS:
        raise InputError(f"projection must be one of {', '.join(PROJECTIONS)}, but is {projection!r}.")
    lower, upper = points.min(axis=0), points.max(axis=0)
    extent = upper - lower
    looking = _usual_view(points) if view is None else np.asarray(view, dtype=float)
    if looking.shape != (3,) or not np.all(np.isfinite(looking)) or not np.any(looking):
        raise InputError(f"view must be a direction, three numbers that are not all zero, but is {view!r}.")
    axes = _axes(looking, turn)
    center = 0.5 * (lower + upper)
    half_diagonal = max(0.5 * float(np.linalg.norm(extent)), 1e-3)
    distance = _DISTANCES[projection] * half_diagonal
    relative = (points - center) @ axes.T
    room = np.array(size) * (0.5 - _MARGIN)
    # A point at the height z above the center's plane appears larger by distance/(distance - z).
    reach = np.abs(relative[:, :2]) * (distance / (distance - relative[:, 2]))[:, None]
    scale = float(np.min(room / np.maximum(reach.max(axis=0), 1e-3 * half_diagonal)))
    near = distance - float(relative[:, 2].max())
    return Camera(center, axes, distance, scale, *size, (near, near + 2.0 * half_diagonal))


def _usual_view(points):
    extent = np.ptp(points, axis=0)
    flat = int(np.argmin(extent))
    if np.sort(extent)[0] < _FLAT * np.sort(extent)[1]:
        return -np.eye(3)[flat]
    _, principal = np.linalg.eigh(np.cov(points.T))
    spread = np.ptp(points @ principal, axis=0)
    if max(spread[:2]) >= _THIN * spread[2]:
        return _OBLIQUE
    longest = principal[:, 2]
    aside = _OBLIQUE - (_OBLIQUE @ longest) * longest
    return aside if np.linalg.norm(aside) > 0.2 else principal[:, 1]


def _axes(looking, turn):
    back = -looking / np.linalg.norm(looking)
    upright = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    angle = np.radians(turn)
    about = np.cross(upright, back)
    back = np.cos(angle) * back + np.sin(angle) * about + (1.0 - np.cos(angle)) * (upright @ back) * upright
    right = np.cross(upright, back)
    if np.linalg.norm(right) < 0.2:
        # Seen from above, the picture turns in its plane.
        right = np.array([np.cos(angle), np.sin(angle), 0.0])
    right -= (right @ back) * back
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(back, right), back])
