"""Filament types of actin, DNA and microtubules, what they grow of, and what holds their ends."""

from dataclasses import replace

from openmm import unit

from .end_states import DynamicInstability, EndStates
from .filament_type import FilamentType
from .monomers import Monomers, MonomerState
from .severing import Severing

_PICONEWTON = unit.piconewton
_PER_AMOUNT = unit.liter / unit.mole / unit.second
_PICONEWTON_PER_NANOMETER = unit.piconewton / unit.nanometer

F_ACTIN = FilamentType(
    name="ACT",
    diameter=6 * unit.nanometer,
    persistence_length=17.2 * unit.micrometer,
    temperature=310 * unit.kelvin,
    stretching_stiffness=48.7 * _PICONEWTON_PER_NANOMETER,
    segment_length=360 * unit.nanometer,
    extension_relaxation_time=0.1 * unit.microsecond,
    mass_per_length=3500 * unit.dalton / unit.nanometer,
)
"""F-actin as in Table 2 of Pesek et al., Soft Matter 2016, 12, 3360.

d = 6 nm, l_p = 17.2 um at 310 K, k = 48.7 pN/nm for a segment of 360 nm (unchanged by
``with_segment_length``, as in their Table 3), tau_l = 0.1 us, inscribed-circle bending (27); mass
1.26 MDa per 360 nm (their Section 5). Tangents decorrelate over l_p; the joints of the paper have the stiffness
l_p k_B T/l0, 3 % more: ``dataclasses.replace(F_ACTIN, temperature=None)``. Their sources: Yogurtcu et al., Biophys. J.
2012, 103, 719 (d);
Nagashima and Asakura 1980, Gittes et al. 1993 (l_p); Kojima et al. 1994 (k).
"""

DSDNA = FilamentType(
    name="DNA",
    diameter=2 * unit.nanometer,
    persistence_length=43.3 * unit.nanometer,
    temperature=310 * unit.kelvin,
    stretching_modulus=1100 * _PICONEWTON,
    segment_length=8 * unit.nanometer,
    friction_length=8 * unit.nanometer,
    mass_per_length=1940 * unit.dalton / unit.nanometer,
)
"""Double-stranded DNA, after the footnote on DNA of Pesek et al., Soft Matter 2016, 12, 3360.

d = 2 nm, l_p = 43.3 nm, l0 = 8 nm (their sources: Odijk, Macromolecules 1995, 28, 7016; Wang et al.,
Biophys. J. 1997, 72, 1335). EA = 1100 pN: the middle of what Wang et al. and Smith, Cui and Bustamante,
Science 1996, 271, 795 report, 1000 to 1200 pN depending on salt. Affine extensional friction. Mass:
660 Da per base pair of 0.34 nm. The flexibility holds at 310 K here; the paper does not say.

Tangents decorrelate over 43.3 nm with segments of any length. A segment lengthens by 2 k_B T/EA = 0.008 nm on average
as it fluctuates, however short it is: by 1 % with segments of 0.8 nm. Under forces above 1 pN the chain is longer than
a wormlike chain, however it is cut: ``theory.calibrated_up_to_force`` makes a type that is one. The
friction of a length of DNA is that of the paper's segments of 8 nm, or of longer ones, so that shorter segments, down
to 1 nm and less, make up the same filament. It leaves out the flow that one segment makes at another. Of a whole rod,
up to a persistence length or so, ``friction_length="filament"`` is nearer to what is measured.
"""

MICROTUBULE = FilamentType(
    name="MT",
    diameter=25 * unit.nanometer,
    bending_rigidity=2.2e7 * _PICONEWTON * unit.nanometer**2,
    stretching_modulus=2.6e5 * _PICONEWTON,
    segment_length=1 * unit.micrometer,
    mass_per_length=1.6e5 * unit.dalton / unit.nanometer,
)
"""Microtubule: rigidity measured, stretching modulus estimated.

EI = 2.2e-23 N m^2, that is l_p = 5.2 mm at 37 C: Gittes et al., J. Cell Biol. 1993, 120, 923. EA is an
estimate, good to some 30 %: Young's modulus 1.2 GPa (same paper, from the same EI) times a wall of about
220 nm^2. d = 25 nm. Affine extensional friction. Mass: 13 protofilaments of 100 kDa dimers every 8 nm.
"""

ACTIN_ATP = Monomers(
    length=2.7 * unit.nanometer,
    plus_on_rate=unit.Quantity(11.6e6, _PER_AMOUNT),
    plus_off_rate=1.4 / unit.second,
    minus_on_rate=unit.Quantity(1.3e6, _PER_AMOUNT),
    minus_off_rate=0.8 / unit.second,
)
"""ATP-actin: Pollard, J. Cell Biol. 1986, 103, 2747: plus end 11.6 /uM/s and 1.4 /s, minus end 1.3 /uM/s and 0.8 /s.

A filament grows by 2.7 nm with a monomer (Holmes et al., Nature 1990, 347, 44). Nucleotides are not told apart.
"""

ACTIN_AGING = replace(
    ACTIN_ATP,
    aging=(
        MonomerState(
            name="ADP-Pi", rate=0.3 / unit.second, plus_off_rate=0.2 / unit.second, minus_off_rate=0.02 / unit.second
        ),
        MonomerState(
            name="ADP", rate=0.0026 / unit.second, plus_off_rate=5.4 / unit.second, minus_off_rate=0.25 / unit.second
        ),
    ),
)
"""Actin whose monomers hydrolyse ATP and release phosphate at random, and dissociate as what they are at an end.

New ones have the rates of ACTIN_ATP; k_off of ADP-Pi 0.2 and 0.02 per s at the plus and minus end, and of ADP 5.4 and
0.25 per s (Fujiwara, Vavylonis and Pollard, Proc. Natl. Acad. Sci. 2007, 104, 8827). Hydrolysis at 0.3 per s (Blanchoin
and Pollard, Biochemistry 2002, 41, 597), phosphate at 0.0026 per s (Carlier, Pantaloni, Biochemistry 1986, 25, 7789).
"""

_GATING_OF_MDIA1 = 0.9

MDIA1_ENDS = EndStates(
    names=("free", "with formin"),
    on_rates=(ACTIN_ATP.plus_on_rate, _GATING_OF_MDIA1 * ACTIN_ATP.plus_on_rate),
    off_rates=(ACTIN_ATP.plus_off_rate, _GATING_OF_MDIA1 * ACTIN_ATP.plus_off_rate),
    switch_rates=((0.0, 0.0), (0.0, 0.0)),
)
"""Plus ends of ATP-actin, free and with the formin mDia1, without profilin: for a ``HandAtEnd`` that changes them.

Free ones are those of ACTIN_ATP. With mDia1 (its domains FH1 and FH2) they grow 0.9 times as fast, its gating factor.
That number is the usual one, whose source is Kovar, Harris, Mahaffy, Higgs and Pollard, Control of the assembly of ATP-
and ADP-actin by formins and profilin, Cell 2006, 124, 423 (doi:10.1016/j.cell.2005.11.038); it was not compared with
the tables of that paper. That k_off has the same factor is no measurement: a formin that stays at the end while
monomers come and go leaves the concentration as it is at which the end stands still. Other formins slow ends down more;
profilin speeds them up.
"""

_TUBULIN_OFF_RATE = 44.0
"""Of the plus end, per second."""

TUBULIN = Monomers(
    length=8.0 / 13.0 * unit.nanometer,
    plus_on_rate=unit.Quantity(8.9e6, _PER_AMOUNT),
    plus_off_rate=_TUBULIN_OFF_RATE / unit.second,
    minus_on_rate=unit.Quantity(4.3e6, _PER_AMOUNT),
    minus_off_rate=23.0 / unit.second,
)
"""Tubulin dimers of microtubules that grow in vitro: Walker et al., J. Cell Biol. 1988, 107, 1437.

Plus end 8.9 /uM/s and 44 /s, minus end 4.3 /uM/s and 23 /s. A dimer of 8 nm is one of 13 protofilaments. While they
shrink, they lose 733 dimers per second at the plus end and 915 at the minus end: the ``shrinking_off_rate`` of a
DynamicInstability. How often ends turn depends on the concentration, and much more on what is in a cell.
"""

_SPEED_IN_MITOSIS, _SHRINKING_IN_MITOSIS = 12.8e3 / 60.0, 14.1e3 / 60.0
"""In nm/s."""

TUBULIN_IN_MITOSIS = replace(
    TUBULIN,
    plus_on_rate=unit.Quantity((_SPEED_IN_MITOSIS / TUBULIN.length + _TUBULIN_OFF_RATE) / 10.0 * 1e6, _PER_AMOUNT),
)
"""Tubulin of microtubules in mitotic cells: plus ends grow by 12.8 um/min at 10 uM of free dimers.

The speed is that of astral microtubules in mitotic cells LLCPK-1 (Rusan, Fagerstrom, Yvon and Wadsworth, Mol. Biol.
Cell 2001, 12, 971). The concentration is an assumption, and that the off rate is the one of TUBULIN. So is the minus
end, which in cells is mostly capped (``Growth(minus_capped=True)``). INSTABILITY_IN_MITOSIS turns plus ends.
"""

INSTABILITY_IN_MITOSIS = DynamicInstability(
    catastrophe_rate=0.058 / unit.second,
    rescue_rate=0.045 / unit.second,
    shrinking_off_rate=_SHRINKING_IN_MITOSIS / TUBULIN.length / unit.second,
)
"""Plus ends of astral microtubules in mitotic cells: they shrink by 14.1 um/min, and turn 0.058 and 0.045 times a
second.

Rusan et al., as for TUBULIN_IN_MITOSIS, with whose speed free microtubules are 12.4 um long on average. Between
divisions, ends pause for most of the time.
"""

COFILIN = Severing(rate=0.032e-3 / ACTIN_ATP.length / (unit.nanometer * unit.second), of_states=("ADP",))
"""Cofilin of fission yeast at the concentration at which it cuts most, for filaments of ACTIN_AGING.

ADP-actin is cut 0.032 times per second in 1000 monomers, 0.012/s in each um (Chen and Pollard, J. Cell Biol. 2011, 195,
485); that it cuts no other actin is an assumption. What it does to ends is left out. In files: ``severing_rate =
"0.0119 1/(um*s)"`` with ``severing_states = ["ADP"]``.
"""
