"""Tables of growth, which reporters write and analysis reads, and other reporters of what has grown."""

import csv

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    FilamentReporter,
    Filaments,
    Growth,
    GrowthReporter,
    InputError,
    TensionReporter,
    analysis,
)
from openmm_cylchain.output.run_tables import GROWTH_TABLE_COLUMNS
from support.contexts import energy_of, new_simulation
from support.solvent import TEMPERATURE, VISCOSITY

KIND = F_ACTIN.with_segment_length(54.0)  # of 20 monomers
STEP = 2e8


def filaments_of(count):
    """Filaments side by side, all but the last of which grow."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(count + 1):
        pool = unit.Quantity(50e-6, unit.molar)
        growth = Growth(monomers=ACTIN_ATP, pool=pool, longest=600.0) if number < count else None
        filaments.add_straight(KIND, 4, [0, 30 * number, 0], [1, 0, 0], growth=growth)
    return filaments


def test_reporters(tmp_path):
    """A file that is gone on with, energies of the segments that there are, tensions of joints that come and go."""
    filaments = filaments_of(2)
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, STEP, random_seed=1, checks=False)
    simulation = new_simulation(topology, system, positions, integrator)
    path = tmp_path / "growth.csv"
    energies, tensions = FilamentReporter(None, 50, filaments), TensionReporter(None, 50, filaments, mean=True)
    for append in (False, True):
        own = GrowthReporter(path, 50, filaments, append=append)
        simulation.reporters[:] = [own, energies, tensions]
        simulation.step(100)
        own.close()
    state = filaments.in_context(simulation.context).growth()
    assert own.filaments == [0, 1] and own["nodes"].shape == (2, 2)
    np.testing.assert_array_equal(own["nodes"][-1], state.nodes)
    np.testing.assert_array_equal(own["plus end (monomers)"][-1], state.monomers[:, 1])
    np.testing.assert_allclose(own["length (nm)"][-1], state.lengths._value)
    np.testing.assert_allclose(own["free monomers (uM)"], 50.0)
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["step"] for row in rows] == [str(50 * k) for k in (1, 2, 3, 4) for _ in (0, 1)]
    assert [float(row["time (ms)"]) for row in rows] == [float(row["step"]) * STEP / 1e9 for row in rows]
    assert [row["filament"] for row in rows] == 4 * ["0", "1"]
    for end, monomers in (("minus", -state.monomers[1, 0]), ("plus", state.monomers[1, 1] - 80)):
        assert int(rows[-1][f"{end} end gained (monomers)"]) - int(rows[-1][f"{end} end lost (monomers)"]) == monomers
    table = analysis.read_growth(path)
    for name in own._columns:
        np.testing.assert_array_equal(table[name][2:], own[name])
    total = energies["stretching_energy"][-1] + energies["bending_energy"][-1]
    assert total.sum() == pytest.approx(energy_of(simulation.context), rel=1e-9)
    found = filaments.in_context(simulation.context).mean_axial_tensions()
    np.testing.assert_allclose(tensions["mean_tension"][-1], [own._value.mean() for own in found])
    assert [len(own) for own in found] == [*(state.nodes - 2), 3]
    with pytest.raises(InputError, match="no growth to report"):
        still = filaments_of(0)
        still.build()
        GrowthReporter(None, 1, still)


def test_files_of_growth_are_read(tmp_path):
    """The last of reports with the same step holds; those that are not whole are left out."""
    path = tmp_path / "mine.csv"
    header = ",".join(GROWTH_TABLE_COLUMNS)
    rest = ",0" * (len(GROWTH_TABLE_COLUMNS) - 4)
    lines = [(0, 3, 1.0), (0, 5, 2.0), (9, 3, 3.0), (9, 5, 4.0), (18, 3, 5.0), (9, 3, 6.0), (9, 5, 7.0), (18, 5, 8.0)]
    lines += [(27, 3, 9.0)]
    path.write_text("\n".join([header, *(f"{step},0.5,{own},{length}{rest}" for step, own, length in lines), ""]))
    table = analysis.read_growth(str(path))
    np.testing.assert_array_equal(table["length (nm)"], [[1, 2], [6, 7], [5, 8]])
    np.testing.assert_array_equal(table["filament"], [[3, 5]] * 3)
    path.write_text(header + "\n")
    assert analysis.read_growth(path)["nodes"].shape == (0, 0)
    path.write_text("step,nodes\n1,2\n")
    with pytest.raises(InputError, match="its columns are 'step,nodes'"):
        analysis.read_growth(path)
    with pytest.raises(InputError, match="There is no file"):
        analysis.read_growth(tmp_path / "none.csv")
