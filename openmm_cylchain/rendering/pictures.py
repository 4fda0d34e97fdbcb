"""Pictures (PNG) and films (GIF, MP4, WebM) of runs."""

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from ..analysis.runs import Run
from ..errors import InputError
from ..output.files import check_output_path, write_atomically
from ..units.quantities import whole_number
from ..units.types import FloatArray
from .annotations import annotated, clock_text, margins
from .camera import camera_on
from .scene import Look, legend_of, make_scene
from .shading import shaded_image

PICTURES, FILMS = (".png",), (".gif", ".mp4", ".webm")
_SIZE = (960, 720)
_SHOWN = 0.75  # Of a picture that is made for what it shows: the rest is for what is written on it.
_BACKGROUND = np.array([1.0, 1.0, 1.0])
_CODECS = {
    ".mp4": ("libx264", ["-crf", "20", "-preset", "medium"]),
    ".webm": ("libvpx-vp9", ["-crf", "30", "-b:v", "0"]),
}


@dataclass(frozen=True)
class View:
    """From where and how large a run is seen.

    Attributes
    ----------
    size : (width, height) in pixels, even, or None
        None is 960 by 720, or down to half as wide or high for what is thin.
    projection : {"perspective", "orthographic"}
    direction : (3,) sequence or None
        In which the camera looks; chosen if None.
    turn : float
        Degrees by which the camera turns about the vertical in a film.
    """

    size: tuple[int, int] | None = None
    projection: str = "perspective"
    direction: tuple[float, float, float] | None = None
    turn: float = 0.0

    def __post_init__(self) -> None:
        if self.size is None:
            return
        if min(self.size) < 100 or max(self.size) > 8000 or any(edge % 2 for edge in self.size):
            raise InputError(f"size must be two even numbers of pixels from 100 to 8000, but is {self.size!r}.")


def images(run: Run, frames: list[int], look: Look, view: View) -> Iterator[FloatArray]:
    """Pictures (height, width, 3) of frames, as whole numbers from 0 to 255, all with one framing."""
    scene = make_scene(run, look, frames)
    direction = None if view.direction is None else np.array(view.direction)
    turns = np.linspace(0.0, view.turn, len(frames)) if view.turn else np.zeros(1)

    def cameras(size):
        return [camera_on(scene.points, size, view.projection, direction, turn) for turn in turns]

    width, height = view.size or _fitting_size(scene.points, cameras(_SIZE))
    free = margins(scene, lambda free: cameras((width - free.left - free.right, height)), (width, height))
    own = cameras((width - free.left - free.right, height))
    # A picture of the start has the clock of the run.
    times = run.times[frames] if np.any(run.times[frames] > 0.0) else run.times
    for number, frame in enumerate(frames):
        camera = own[number % len(own)]
        # What is thinner than a pixel would be broken lines.
        shaded = shaded_image(camera, scene.tubes(frame).at_least(0.4 / camera.scale), _BACKGROUND)
        image = np.tile(_BACKGROUND, (height, width, 1))
        image[:, free.left : width - free.right] = shaded
        yield annotated(image, camera, scene, clock_text(float(run.times[frame]), times))


def _fitting_size(points, cameras):
    needed = 2.0 * np.max([np.abs(camera.places(points)).max(axis=0) for camera in cameras], axis=0) / _SHOWN
    width, height = (2 * int(np.clip(own, usual / 2, usual) / 2) for own, usual in zip(needed, _SIZE))
    return width, height


def write_picture(run: Run, frame: int, path: str | Path, look: Look | None = None, view: View | None = None) -> None:
    """Draw a frame into a PNG file.

    Parameters
    ----------
    run : Run
        See ``analysis.load``.
    frame : int
        A negative one counts from the end.
    path : str or Path
        Ends in ``.png``.

    Raises
    ------
    InputError
        For a frame that there is not, or a path that cannot be written or has another ending.
    """
    _check_path(path, PICTURES, "a picture")
    run.positions(frame)
    (image,) = images(run, [frame % len(run)], look or Look(), view or View())
    data = io.BytesIO()
    Image.fromarray(image).save(data, format="png", optimize=True)
    write_atomically(Path(path), data.getvalue())


def write_film(
    run: Run,
    path: str | Path,
    frames: list[int] | None = None,
    frames_per_second: float = 20.0,
    look: Look | None = None,
    view: View | None = None,
    say: Callable[[str], None] = lambda message: None,
    colors: int = 255,
) -> None:
    """Draw frames into a film: GIF, or MP4 and WebM, which need imageio-ffmpeg.

    Parameters
    ----------
    run : Run
        See ``analysis.load``.
    path : str or Path
        Ends in ``.gif``, ``.mp4`` or ``.webm``.
    frames : list of int, optional
        All if not given.
    say : callable (str), optional
        Told how far it is.
    colors : int
        Of a GIF, 2 to 255: fewer make a smaller file.

    Raises
    ------
    InputError
        For frames that there are not, a path that cannot be written or has another ending, and if imageio-ffmpeg is
        needed and missing.
    """
    _check_path(path, FILMS, "a film")
    path = Path(path)
    if not 0.0 < frames_per_second <= 100.0:
        raise InputError(f"A film has more than 0 and up to 100 frames per second, but not {frames_per_second!r}.")
    if whole_number(colors, 2, "colors") > 255:
        raise InputError(f"A GIF has up to 255 colors, but not {colors}.")
    frames = list(range(len(run))) if frames is None else [int(frame) for frame in frames]
    if not frames:
        raise InputError("A film needs a frame at least.")
    for frame in frames:
        run.positions(frame)
    frames = [frame % len(run) for frame in frames]
    drawn = images(run, frames, look or Look(), view or View())
    temporary = path.with_name(f".{path.stem}.new{path.suffix}")
    try:
        pictures = _told(drawn, len(frames), say)
        if path.suffix == ".gif":
            legend = [color for _, color, _ in legend_of(run, look or Look())]
            _write_gif(pictures, temporary, frames_per_second, int(colors), legend)
        else:
            _write_video(pictures, temporary, frames_per_second)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _told(drawn, count, say):
    for number, image in enumerate(drawn, 1):
        say(f"frame {number} of {count}")
        yield image


def _check_path(path, endings, what):
    if Path(path).suffix not in endings:
        raise InputError(f"{what[0].upper()}{what[1:]} is a file that ends in {' or '.join(endings)}, but not {path}.")
    check_output_path(path)
    if Path(path).suffix in _CODECS:
        _ffmpeg()


def _ffmpeg():
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError(
            "MP4 and WebM films need imageio-ffmpeg: install it by pip install imageio-ffmpeg, or write a GIF."
        ) from None
    return imageio_ffmpeg


def _write_gif(drawn, path, frames_per_second, colors, legend):
    # One palette for all frames, or colors would flicker.
    pictures = [Image.fromarray(image) for image in drawn]
    palette = _palette(pictures[len(pictures) // 2], colors, legend)
    indexed = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    indexed[0].save(
        path, format="gif", save_all=True, append_images=indexed[1:], duration=1000.0 / frames_per_second, loop=0
    )


def _palette(picture, colors, legend):
    # Colors of the legend cover few pixels: a median with their neighbours would make two types look alike.
    exact = [channel for color in legend[: colors // 2] for channel in bytes.fromhex(color[1:])]
    left = colors - len(exact) // 3
    palette = Image.new("P", (1, 1))
    palette.putpalette([*exact, *picture.quantize(left, Image.Quantize.MEDIANCUT).getpalette()[: 3 * left]])
    return palette


def _write_video(drawn, path, frames_per_second):
    codec, options = _CODECS[path.suffix]
    writer = None
    try:
        for image in drawn:
            if writer is None:
                size = (image.shape[1], image.shape[0])
                writer = _ffmpeg().write_frames(
                    str(path), size, fps=frames_per_second, codec=codec, output_params=options, macro_block_size=2
                )
                writer.send(None)
            writer.send(np.ascontiguousarray(image))
    finally:
        if writer is not None:
            writer.close()
