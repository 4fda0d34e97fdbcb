"""Configurations with mistakes that are made by chance, and what becomes of them."""

import re
import time
import warnings

import numpy as np

from openmm_cylchain import InputError, InstabilityError
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.relaxation import relaxed_positions
from openmm_cylchain.runs.run import create_simulation

VALUES = (
    *(
        "0",
        "-1",
        "3",
        "1.5",
        "nan",
        "-inf",
        "1e308",
        "-0.0",
        "1000000000",
        "99999999999999999999999",
        "true",
        "[]",
        "{}",
    ),
    *('""', '"nan nm"', '"inf s"', '"1e308 nm"', '"-1 um"', '"0 nm"', '"1e-300 s"', '"1e30 K"', '"1 K"', '"2 pN"'),
    *('"1 nm/s"', '"5 pN/nm"', '"1 um"', '"1 s"', '"10 1/s"', '"1 mPa*s"', '"3,1 K"', '"3 1 nm"', '"1e9"', '"nm"'),
    *(r'"a\nb"', r'"\u0000"', r'"3\nnm"', '"$x^$"', "'\\frac{'", '"F_ACTIN"', '"DSDNA_BASE_PAIRS"', '"equilibrium"'),
    *(
        '"recommended"',
        '"portable"',
        '"euler"',
        '"midpoint"',
        '"fene"',
        '"sphere"',
        '"box"',
        '"1 nm nm"',
        '"%s"',
        '"1 {}"',
    ),
    *("[1, 2]", '["1 nm"]', "[[]]", "[nan, 0, 0]", "[0, 0, 0]", '["0 nm", "0 nm", "0 nm"]', "1979-05-27", "[-1, 0]"),
    *(
        "{ shape = 3 }",
        "{ a.b = 1 }",
        "0x10",
        "[1, [2]]",
        '["1e9 nm", "1 nm", "1 nm"]',
        "[[1, 2, 3]]",
        "{ filament = 0 }",
    ),
)
"""What takes the place of a value."""


_NUMBER = re.compile(r"(?<![\w.])\d+(\.\d+)?(?![\w.])")


def mutated(text, generator):
    """A text with one to three changes: keys that are removed, doubled, renamed or moved, and other values."""
    lines = text.splitlines()
    for _ in range(generator.integers(1, 4)):
        if not lines:
            break
        number = int(generator.integers(len(lines)))
        lines[number : number + 1] = _mutated_line(lines, number, generator)
    return "\n".join(lines) + "\n"


def _mutated_line(lines, number, generator):
    line = lines[number]
    key, equals, value = line.partition(" = ")
    value_of = VALUES[generator.integers(len(VALUES))]
    kind = generator.integers(12)
    if kind > 7 and equals:
        # What may be meant: another number of the same kind. Larger systems than that take long to build.
        most = 10.0 if key.strip() in ("count", "segments") else 1e6
        return [f"{key} = {re.sub(_NUMBER, lambda match: _scaled(match[0], most, generator), value)}"]
    if kind == 0:
        return []
    if kind == 1:
        return [line, line]
    if kind == 2:
        return [line, lines[generator.integers(len(lines))]]
    if not equals:
        return [line[:-1], line.replace("[[", "[").replace("]]", "]"), line.upper(), "[[x]]"][kind % 4 : kind % 4 + 1]
    if kind == 3:
        other = lines[generator.integers(len(lines))].partition(" = ")[0]
        return [f"{other} = {value}"]
    if kind == 4 and any(character.isdigit() for character in value):
        digits = [index for index, character in enumerate(value) if character.isdigit()]
        place = digits[generator.integers(len(digits))]
        new = ("-1", "0", "e99", "99", ".", "nan", ",")[generator.integers(7)]
        return [f"{key} = {value[:place]}{new}{value[place + 1 :]}"]
    if kind == 5 and len(value) > 2:
        place = int(generator.integers(len(value)))
        return [f"{key} = {value[:place]}{value[place + 1 :]}"]
    return [f"{key} = {value_of}"]


def _scaled(number, most, generator):
    factor = (0, 1e-6, 1e-3, 0.1, 0.5, 1, 1, 2, 3, 10, 1e3, 1e6)[generator.integers(12)]
    scaled = float(number) * min(factor, most)
    return str(round(scaled)) if number.isdigit() and scaled >= 1 else f"{scaled:g}"


def outcome(text, steps=3):
    """What becomes of a configuration: "refused", "stopped" (with an error that says why) or "runs".

    Any other exception than those for users passes through, and AssertionErrors say what is wrong: values that are not
    finite, messages that say nothing, or more than 30 s of the processor.
    """
    start = time.process_time()
    try:
        found = _outcome(text, steps)
    except InputError as error:
        message = str(error)
        assert len(message) > 20 and len(message) < 2000, message
        found = "refused"
    except InstabilityError as error:
        assert len(str(error)) > 20
        found = "stopped"
    assert time.process_time() - start < 30.0
    return found


def _outcome(text, steps):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        configuration = parse_configuration(text)
        simulation, built = create_simulation(configuration)
        simulation.context.setPositions(relaxed_positions(configuration, built))
        for _ in range(steps):
            simulation.step(1)
            state = simulation.context.getState(positions=True, energy=True)
            assert np.all(np.isfinite(state.getPositions(asNumpy=True)._value))
            assert np.isfinite(state.getPotentialEnergy()._value)
    return "runs"
