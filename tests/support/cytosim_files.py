"""Configurations of Cytosim, and what becomes of them."""

from openmm_cylchain.cytosim.command import import_file
from openmm_cylchain.cytosim.translation import translate
from openmm_cylchain.runs.configuration import read_configuration

SYSTEM = "set simul system { time_step = 0.001; viscosity = 0.5; kT = 0.0042; dim = 3 }\n"
CELL = "set space cell { shape = sphere }\nnew cell { radius = 4 }\n"
TUBE = "set fiber tube { rigidity = 20; segmentation = 0.5 }\n"
RUN = "run 1000 system { nb_frames = 10 }\n"
SECOND, MICROMETER = 1e12, 1e3
"""In ps and nm."""


def translated(tmp_path, text, system=SYSTEM, cell=CELL, run=RUN, **options):
    """The Configuration and the Document of a text after a system and a cell, before a run."""
    path, output = tmp_path / "my.cym", tmp_path / "my.toml"
    path.write_text(system + cell + text + run)
    output.unlink(missing_ok=True)
    for start in tmp_path.glob("*.npy"):
        start.unlink()
    import_file(path, output, **options)
    document = translate(path, "my", options.get("dimensions")).document
    assert output.read_text() == document.text()
    return read_configuration(output), document
