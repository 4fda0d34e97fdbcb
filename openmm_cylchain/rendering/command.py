"""The command ``openmm-cylchain render``."""

import math

from ..errors import InputError

_SECONDS_BETWEEN_LINES = 10.0


def add_command(commands):
    """Add ``render`` to the subcommands of an argparse parser."""
    parser = commands.add_parser("render", help="draw a picture or a film of a run")
    parser.add_argument("run", metavar="RUN", help="directory of a run")
    parser.add_argument("--output", metavar="FILE", required=True, help=".png, or with --film .gif, .mp4 or .webm")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--frame", type=int, metavar="N", help="from 0; -1, the default, is the last")
    what.add_argument("--film", action="store_true", help="a film of all frames, or of those of --frames")
    parser.add_argument("--frames", metavar="A:B:C", help="of a film: from A to before B, every C-th, as in Python")
    parser.add_argument("--fps", type=float, metavar="N", help="frames per second of a film, 20 if not given")
    parser.add_argument("--colors", type=int, metavar="N", help="of a GIF, 255 if not given: fewer make a smaller file")
    parser.add_argument("--turn", type=float, default=0.0, metavar="DEGREES", help="turn the camera during a film")
    parser.add_argument(
        "--color",
        default="type",
        metavar="BY",
        help="of filaments: type (default), tension, orientation (angle to the director) or bending",
    )
    parser.add_argument("--average", type=int, default=1, metavar="N", help="frames over which tensions are averaged")
    parser.add_argument(
        "--diameter", metavar="D", help='of all tubes, as in "20 nm", or true; visible ones if not given'
    )
    parser.add_argument(
        "--size", metavar="WxH", help="in pixels; if not given 960x720, or less where what is shown is thin"
    )
    parser.add_argument("--projection", default="perspective", metavar="P", help="perspective (default), orthographic")
    parser.add_argument("--view", metavar="X,Y,Z", help="the direction in which the camera looks")
    parser.add_argument("--whole", action="store_true", help="let filaments leave the periodic box")
    parser.add_argument("--no-linkers", action="store_true", help="leave linkers and crosslinks out")
    parser.add_argument("--no-particles", action="store_true", help="leave particles beside filaments out")
    parser.add_argument(
        "--hide", metavar="NAMES", help='residues that are left out, as in "HOH,NA"; water if not given, "" for none'
    )
    parser.add_argument("--incomplete", action="store_true", help="draw a run that is not at its end")
    parser.set_defaults(command=_render)


def _render(options):
    of_films = (options.frames, options.fps, options.colors)
    if not options.film and (options.turn or any(own is not None for own in of_films)):
        raise InputError("--frames, --fps, --colors and --turn belong to --film: give that, too.")

    from ..analysis.run_loading import load
    from ..output.progress import ProgressMessages
    from .pictures import View, write_film, write_picture
    from .scene import WATER, Look

    look = Look(
        options.color,
        _diameter(options.diameter),
        options.whole,
        not options.no_linkers,
        options.average,
        not options.no_particles,
        WATER if options.hide is None else tuple(filter(None, options.hide.split(","))),
    )
    direction = None if options.view is None else _numbers(options.view, ",", 3, "--view")
    view = View(None if options.size is None else _size(options.size), options.projection, direction, options.turn)
    run = load(options.run, options.incomplete)
    if options.film:
        progress = ProgressMessages(seconds_between_lines=_SECONDS_BETWEEN_LINES)
        try:
            frames_per_second = 20.0 if options.fps is None else options.fps
            frames = _frames(options.frames, len(run))
            colors = 255 if options.colors is None else options.colors
            write_film(run, options.output, frames, frames_per_second, look, view, progress, colors)
        finally:
            progress.finish()
    else:
        write_picture(run, -1 if options.frame is None else options.frame, options.output, look, view)
    print(f"Written to {options.output}")


def _frames(text, count):
    if text is None:
        return None
    try:
        frames = list(range(count)[slice(*(int(part) if part else None for part in text.split(":")))])
    except (ValueError, TypeError):
        raise InputError(f"--frames must be such as 100:200:2, but is {text!r}.") from None
    if not frames:
        raise InputError(f"--frames {text} selects none of the {count} frames.")
    return frames


def _diameter(text):
    from ..units.quantities import LENGTH
    from ..units.text import parse_quantity

    if text is None:
        return None
    if text == "true":
        return 0.0
    value = parse_quantity(text, LENGTH, "--diameter")
    if not value > 0.0:
        raise InputError(f"--diameter must be positive, or true, but is {text!r}.")
    return value


def _size(text):
    return tuple(int(edge) for edge in _numbers(text, "x", 2, "--size"))


def _numbers(text, separator, count, name):
    try:
        numbers = tuple(float(part) for part in text.split(separator))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise InputError(f"{name} must be {count} numbers with {separator!r} between them, but is {text!r}.")
    return numbers
