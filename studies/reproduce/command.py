"""The command ``reproduce``."""

from openmm_cylchain.cli import say
from openmm_cylchain.output.progress import ProgressMessages


def add_command(commands):
    """Add ``reproduce`` to the subcommands of an argparse parser."""
    parser = commands.add_parser("reproduce", help="compute the results of a paper again")
    parser.add_argument(
        "paper",
        metavar="PAPER",
        help="pesek2016: Pesek et al., Soft Matter 2016, 12, 3360; "
        "diffusion: Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906; "
        "panja2015: Panja, Barkema and van Leeuwen, Phys. Rev. E 2015, 92, 032603; "
        "beams: accuracy of beam elements and straight segments against the number of unknowns; "
        "compression: Simularium's comparison of compressed actin; "
        "ratchets: filaments that grow against loads, after Peskin, Odell and Oster, Biophys. J. 1993, 65, 316",
    )
    parser.add_argument("--figure", type=int, metavar="N", help="only this figure of the paper")
    parser.add_argument("--quick", action="store_true", help="reduced statistics, five minutes at most")
    parser.add_argument("--force", action="store_true", help="measure anew what DIR holds already")
    parser.add_argument("--output", metavar="DIR", required=True, help="directory for results, pictures and the page")
    parser.set_defaults(command=_reproduce)


def _reproduce(options):
    from .reproduction import reproduce, unexplained

    progress = ProgressMessages()
    try:
        content = reproduce(options.paper, options.output, options.figure, options.quick, options.force, say=progress)
    finally:
        progress.finish()
    results = [result for case in content["cases"] for result in case["results"]]
    for result in results:
        if result["reason"]:
            print(f"{result['name']} differs. {result['reason']}")
    agreeing = sum(result["verdict"] == "agrees" for result in results)
    print(f"{agreeing} of {len(results)} results agree. Written to {options.output}: results.json, {options.paper}.md")
    if unexplained(content):
        say("error", f"without a stated cause differ: {', '.join(unexplained(content))}")
        raise SystemExit(1)
