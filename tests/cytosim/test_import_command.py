"""The command ``import``: what it writes and says, what it refuses, and files that are changed by chance."""

import re

import numpy as np
import pytest

from openmm_cylchain.cli import main
from openmm_cylchain.cytosim.command import import_file
from openmm_cylchain.errors import InputError

NETWORK = """% motors in a circle
set simul system
{
    time_step = 0.005
    viscosity = 0.1
    kT = 0.0042
    display = ( size=512; )
}
set space cell { shape = circle }
new cell { radius = 3 }
set fiber actin
{
    rigidity = 0.1
    segmentation = 0.25
    confine = inside, 100
}
set hand myosin
{
    binding = 10, 0.05
    unbinding = 0.5, 4
    activity = move
    unloaded_speed = 0.3
    stall_force = 4
}
set couple motor
{
    hand1 = myosin
    hand2 = myosin
    stiffness = 100
    diffusion = fast
}
new 8 actin { length = 2 }
new 40 motor
run 200 system { nb_frames = 4 }
"""
GROWING = """set simul system { time_step = 0.001; viscosity = 0.5; steric = 1, 1000; dim = 3 }
set space cell { shape = sphere }
new cell { radius = 5 }
set fiber tube { rigidity = 20; segmentation = 0.5; confine = inside, 100; steric = 1, 0.005
    activity = classic; growing_speed = 0.1; shrinking_speed = -0.3; catastrophe_rate = 0.1; rescue_rate = 0.01
    min_length = 0.3; growing_force = 2; total_polymer = 60 }
set hand glue { binding = 5, 0.02; unbinding = 0.1, 3 }
set single grafted { hand = glue; stiffness = 100; activity = fixed }
for X=1:4 { new 2 tube { length = [X]; position = ball 3; direction = radial; plus_end = grow } }
new event { rate = 2; code = ( new tube { length = 0.5; plus_end = grow; position = ball 1 } ) }
new 30 grafted { position = disc 3 0 at 0 0 [[round(1/3, 2)]] }
repeat 2 { run 50 system { nb_frames = 2 } }
report fiber:length lengths.txt { verbose = 0 }
"""
SHAPES = """set simul system { time_step = 0.002; dim = 2 } %{ a
comment }
set space cell { shape = strip }
new cell { length = 6, 4 }
set fiber f { rigidity = 5; segmentation = 0.5; confine = inside, 50 }
set hand h { binding_rate = 1; binding_range = 0.03; unbinding = 0, inf }
set single pin { hand = h; stiffness = 30; activity = fixed }
set couple link { hand1 = h; hand2 = h; stiffness = 50; fast_diffusion = 1 }
new f { shape = -1 0, 0 0.5, 1 0; placement = off }
new f { length = 2; position = 0 1; direction = 1 0; attach1 = pin, 0, minus_end }
new 3 f { length = 1, 0.2; orientation = horizontal }
new link { attach1 = f1, 1; attach2 = f2, 1 }
new 20 link { attach1 = f }
new bead { radius = 0 }
run system { duration = 0.5; nb_frames = 5 }
"""
SHAPES = SHAPES.replace("new bead { radius = 0 }\n", "")


def written(tmp_path, text, *arguments):
    (tmp_path / "my.cym").write_text(text)
    return main(["import", str(tmp_path / "my.cym"), "--output", str(tmp_path / "my.toml"), *arguments])


@pytest.mark.parametrize("text", [NETWORK, GROWING, SHAPES])
def test_what_is_written_runs(tmp_path, capsys, text):
    assert written(tmp_path, text) == 0
    assert "missing" not in capsys.readouterr().out
    assert main(["run", str(tmp_path / "my.toml"), "--dry-run"]) == 0


def test_every_place_says_what_was_done(tmp_path, capsys):
    assert written(tmp_path, NETWORK.replace("diffusion = fast", "diffusion = 10\n    specificity = bipolar")) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert re.search(r"exact: \d+ settings", said.out)
    assert "rules for pairs of hands" in said.out and "specificity = bipolar (line 31)" in said.out
    lines = (tmp_path / "my.toml").read_text().splitlines()
    # Numbers and names that say themselves what they are.
    unsaid = [line for line in lines if "=" in line and "#" not in line]
    assert {line.split(" = ")[0] for line in unsaid} <= {"title", "segments", "platform", "seed", "planar", "height"}
    commented = [line for line in lines if "#" in line]
    assert all(re.search(r"# (exact|nearest|left out)", line) for line in commented)


def test_outputs_are_never_overwritten(tmp_path, capsys):
    assert written(tmp_path, NETWORK) == 0
    before = (tmp_path / "my.toml").read_text()
    assert written(tmp_path, GROWING) == 2
    assert "exists already: name another file" in capsys.readouterr().err
    assert (tmp_path / "my.toml").read_text() == before
    (tmp_path / "my.toml").unlink()
    (tmp_path / "my_1.npy").write_text("mine")
    assert written(tmp_path, NETWORK.replace("length = 2 }", "length = 9 }")) == 2
    assert "my_1.npy exists already" in capsys.readouterr().err
    assert (tmp_path / "my_1.npy").read_text() == "mine"
    assert not (tmp_path / "my.toml").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("title = 1\n", r"my\.cym, line 1: this is no configuration of Cytosim"),
        (
            NETWORK.replace("rigidity = 0.1", "rigidity = x"),
            r"my\.cym, line 13: rigidity of fiber actin must be a number",
        ),
        (NETWORK.replace("hand2 = myosin", "hand2 = nobody"), r"my\.cym, line 25: there is no hand called 'nobody'"),
        (NETWORK.replace("new 8 actin", "new 8 actn"), r"my\.cym, line 32: nothing called 'actn' has been set"),
        (NETWORK.replace("new 8 actin { length = 2 }", ""), r"my\.cym: there are neither fibers nor bodies in it"),
        (NETWORK.replace("    time_step = 0.005\n", ""), r"time_step of simul must be given"),
        (NETWORK.replace("viscosity = 0.1", "viscosity = -1"), r"line 5: viscosity of simul must be positive"),
        (NETWORK + "new actin {", r"line 35: \"{\" has no \"}\" that closes it"),
        ("\0\1\2", "is no text"),
    ],
)
def test_what_cannot_be_read_is_refused_in_a_sentence(tmp_path, capsys, text, said):
    assert written(tmp_path, text) == 2
    error = capsys.readouterr().err
    assert re.search(said, error)
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == [tmp_path / "my.cym"]


def test_files_that_are_not_there(tmp_path, capsys):
    assert main(["import", str(tmp_path / "none.cym"), "--output", str(tmp_path / "my.toml")]) == 2
    assert "none.cym cannot be read" in capsys.readouterr().err
    (tmp_path / "my.cym").write_text(NETWORK)
    assert main(["import", str(tmp_path / "my.cym"), "--output", str(tmp_path / "no" / "my.toml")]) == 2
    assert "which is not a directory" in capsys.readouterr().err


def test_values_of_templates_are_taken_from_the_command_line(tmp_path, capsys):
    text = NETWORK.replace("new 8 actin", "[[n = [8, 9]]]new [[n]] actin")
    assert written(tmp_path, text, "--value", "n=5") == 0
    assert "count = 5" in (tmp_path / "my.toml").read_text()
    (tmp_path / "my.toml").unlink()
    assert written(tmp_path, text) == 0
    assert "has 2 values: the first is taken, 8" in capsys.readouterr().out
    (tmp_path / "my.toml").unlink()
    assert written(tmp_path, text, "--value", "5") == 2
    assert "--value must be a name and a value" in capsys.readouterr().err


STAGED = """
set simul system { time_step = 0.001; viscosity = 0.1; kT = 0.0042; dim = 3 }
set space cell { shape = sphere }
set fiber tube { rigidity = 20; segmentation = 0.5; confine = inside, 100 }
set hand dynein { binding = 10, 0.05; unbinding = 1, 3; activity = move; unloaded_speed = -1; stall_force = 5 }
set single motor { hand = dynein; stiffness = 100 }
set couple bridge { hand1 = dynein; hand2 = dynein; stiffness = 100; diffusion = 1 }
set solid core { confine = inside, 100 }
set aster star { stiffness = 1000, 500 }
new cell { radius = 3 }
new 2 star { solid = core; radius = 0.6, 0.2; point1 = center, 0.6; fibers = 6, tube, ( length = 1; ) }
new 2 core { sphere1 = 0 0 0, 0.5, 4 motor; point1 = 0.5 0 0, 0, motor; single1 = motor, point1, sphere1, 0.5 }
new 20 bridge
run 100 system { nb_frames = 2 }
change dynein { unloaded_speed = 0 }
delete 5 bridge
run 100 system { nb_frames = 2 }
change cell { radius = 2.5 }
new 2 tube { length = 1 }
run 100 system { nb_frames = 2 }
"""

PLACED = """/* of 2017 */
set simul system { time_step = 0.001; viscosity = 0.1; dim = 3 }
set space cell { shape = ellipse }
new cell { diameter = 4, 5, 6 }
set fiber tube { rigidity = 20; segmentation = 0.5; activity = classic; growing_speed = 0.1; shrinking_speed = -0.2;
 catastrophe_rate = 0.01; confine = inside, 100 }
set fiber rod { rigidity = 20; segmentation = 0.5 }
set hand binder { binding = 5, 0.05; unbinding = 1, 3 }
set single pin { hand = binder; activity = fixed; stiffness = 100 }
set couple bridge { hand1 = binder; hand2 = binder; stiffness = 100; diffusion = 1 }
new rod { length = 2; shape = curved, 3, 0 0 1; position = 0 0 0; orientation = off, axis 0 0 1 degree 90 }
new 2 rod { length = 1; direction = X blur 0.1 or 0 1 0; position = ball 1 if (X > 0); attach1 = bridge, 0.2, plus_end }
new 2 tube { length = 1; plus_end = grow; rotation = X 0.5; position = cap 2 1 turn quat 1 0 0 0 }
new 3 bridge { attach1 = rod1, 0.5 }
new 2 pin { position = 0 1 0; attach = tube1, 0.5 }
new event { rate = 2; code = ( new tube { length = 0.05; plus_end = grow; direction = X; position = cylinder 2 0 } ) }
new event { delay = 0.1; code = ( new rod { length = 0.5 } ) }
run 100 system { nb_frames = 2 }
"""

NUCLEATED = """
set simul system { time_step = 0.002; viscosity = 0.5; steric = 1, 200; dim = 3 }
set space cell { shape = semi_periodic }
set space floor { shape = strip }
set space rail { shape = rectangle }
set space pin { shape = sphere }
new cell { length = 8, 6; bottom = 0; top = 2 }
new floor { length = 8, 6; bottom = 0; top = 0 }
new rail { length = 6, 0, 0 }
new pin { radius = 0 }
set fiber tube { rigidity = 20; segmentation = 0.5; activity = grow; growing_speed = 0.2; confine = on, 50, floor
 confine2 = inside, 100, cell; steric = 1, 0.03 }
set hand maker { unbinding = 0, 3; activity = nucleate; nucleate = 4, tube, ( length = 0.2; plus_end = grow ) }
set hand other { unbinding = 2; activity = nucleate; nucleate = 4, tube, ( length = 0.2; direction = X ) }
set single seed { hand = maker; diffusion = 1; confine = on,, floor }
set single again { hand = other; diffusion = 2 }
set single held { hand = maker; activity = fixed; stiffness = 500 }
set bead ball { viscosity = 20; confine = on, 200, rail }
set solid core { viscosity = inf; confine = point, 100, pin }
new 6 seed
new 3 again { position = 0 0 1 }
new 2 held { position = rectangle 2 2 at 0 0 1 }
new 2 ball { radius = 0.3 }
new core { point1 = 0 0 0, 0.2 }
run 100 system { nb_frames = 2 }
change ball { viscosity = 2 }
run 100 system { nb_frames = 2 }
"""

PIECES = (
    "{",
    "}",
    "(",
    ")",
    "%",
    ";",
    ",",
    "=",
    "\\\n",
    "-1",
    "1e9",
    "inf",
    "nan",
    "x",
    "0",
    "\n",
    "[[",
    "]]",
    '"',
    "é",
)


TEXTS = (NETWORK, GROWING, SHAPES, STAGED, PLACED, NUCLEATED)


def mutated(generator):
    """One of the texts with some of its pieces changed, and words of others in their place."""
    text = TEXTS[generator.integers(len(TEXTS))]
    words = re.split(r"(\s+)", "".join(TEXTS))
    parts = re.split(r"(\W)", text)
    for _ in range(generator.integers(1, 5)):
        at = generator.integers(len(parts))
        kind = generator.integers(5)
        if kind == 0:
            parts[at] = ""
        elif kind == 1:
            parts[at] = PIECES[generator.integers(len(PIECES))]
        elif kind == 2:
            parts[at] += words[generator.integers(len(words))]
        elif kind == 3:
            parts[at:] = parts[at + int(generator.integers(20)) :]
        else:
            numbers = [number for number, part in enumerate(parts) if part.isdigit()]
            parts[numbers[generator.integers(len(numbers))]] = ("-3", "1e9", "0", "7 8")[generator.integers(4)]
    return "".join(parts)


def outcomes(tmp_path, seed, count):
    generator, refused = np.random.default_rng(seed), 0
    for number in range(count):
        text = mutated(generator)
        (tmp_path / "my.cym").write_text(text)
        try:
            import_file(tmp_path / "my.cym", tmp_path / f"{number}.toml")
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
        except BaseException:
            print(text)
            raise
    return refused


@pytest.mark.parametrize(
    ("text", "tables"),
    [
        (STAGED, ("[[body]]", "[[stage]]")),
        (PLACED, ("[[nucleation]]", "bound_at")),
        (NUCLEATED, ("[[nucleation]]", "[[stage]]")),
    ],
)
def test_without_changes_all_is_written(tmp_path, text, tables):
    (tmp_path / "my.cym").write_text(text)
    import_file(tmp_path / "my.cym", tmp_path / "my.toml")
    found = (tmp_path / "my.toml").read_text()
    assert all(table in found for table in tables)


def test_files_that_are_changed_by_chance_are_refused_in_words_or_written(tmp_path):
    assert 150 < outcomes(tmp_path, 1, 300) < 270


@pytest.mark.slow
def test_many_files_that_are_changed_by_chance(tmp_path):
    assert 500 < outcomes(tmp_path, 2, 1000) < 900
