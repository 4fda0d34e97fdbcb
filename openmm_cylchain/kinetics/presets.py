"""Crosslinkers and motors with numbers from the literature.

Rates and speeds depend on temperature, salt and ATP by factors of two and more, and many numbers have not been measured
but are what models take: each docstring says which. A reach is chosen such that it hardly cuts off what the spring
allows; rates of binding are chosen, since what a hand meets depends on its reach and the stiffness of the spring. A
preset with other values is made by ``dataclasses.replace``.

Papers
------
Cooper, Wagenbach, Asbury, Wordeman, Nat. Struct. Mol. Biol. 2010, 17, 77. Coppin, Pierce, Hsu, Vale, PNAS 1997, 94,
8539. Davidson et al., Science 2019, 366, 1338. Ferrer, Lee, Chen, Pelz, Nakamura, Kamm, Lang, PNAS 2008, 105, 9221.
Ganji et al., Science 2018, 360, 102. Hansen et al., eLife 2017, 6, e25776. Helenius, Brouhard, Kalaidzidis, Diez,
Howard, Nature 2006, 441, 115. Hunter et al., Mol. Cell 2003, 11, 445. Kerssemakers, Howard, Hess, Diez, PNAS 2006, 103,
15812. Klumpp, Lipowsky, PNAS 2005, 102, 17284. Kuhlman, Ellis, Critchley, Bagshaw, FEBS Lett. 1994, 339, 297. Leduc et
al., PNAS 2004, 101, 17096. Mallik, Carter, Lex, King, Gross, Nature 2004, 427, 649. Müller, Klumpp, Lipowsky, PNAS
2008, 105, 4609. Nakamura, Osborn, Hartemink, Hartwig, Stossel, J. Cell Biol. 2007, 179, 1011. Popov, Komianos, Papoian,
PLoS Comput. Biol. 2016, 12, e1004877 (MEDYAN). Schnitzer, Visscher, Block, Nat. Cell Biol. 2000, 2, 718. Svoboda,
Block, Cell 1994, 77, 773.
"""

from openmm import unit

from ..filaments.presets import F_ACTIN, MICROTUBULE
from .crosslinker import Crosslinker
from .hand import Hand
from .hand_at_end import HandAtEnd

_NM = unit.nanometer
_PN = unit.piconewton
_UM = unit.micrometer
_S = unit.second

ALPHA_ACTININ = Crosslinker(
    name="alpha-actinin",
    hands=Hand(
        binding_rate=35 / _S,
        reach=50 * _NM,
        unbinding_rate=0.3 / _S,
        unbinding_force=17.1 * _PN,
        binds_to=[F_ACTIN],
    ),
    stiffness=8 * _PN / _NM,
    rest_length=35 * _NM,
)
"""alpha-actinin, a short and stiff crosslinker of actin.

- unbinding 0.3/s, ``unbinding_force`` 17.1 pN (k_BT at 25 C over a bond length of 0.24 nm), stiffness 8 pN/nm, length
  30 to 40 nm: as MEDYAN takes them (Popov et al. 2016). Measured are rupture forces of 40 to 80 pN at 4 to 50 pN/s
  (Ferrer et al. 2008), and 1.5/s at 15 C and 9.6/s at 25 C for its actin-binding domain alone (Kuhlman et al. 1994).
- ``binding_rate`` is chosen: one hand in solution binds to actin, a site every 2.7 nm, with K_d = 1 uM; the
  actin-binding domain has 0.83 uM at 15 C and 2.4 uM at 25 C (Kuhlman et al. 1994).
"""

FILAMIN = Crosslinker(
    name="filamin",
    hands=Hand(
        binding_rate=2.7 / _S,
        reach=180 * _NM,
        unbinding_rate=0.3 / _S,
        unbinding_force=17.1 * _PN,
        binds_to=[F_ACTIN],
    ),
    stiffness=0.1 * _PN / _NM,
    rest_length=150 * _NM,
)
"""Filamin, a long and soft crosslinker of actin.

- length: a dimer of two arms of about 80 nm (Nakamura et al. 2007), which are flexible; 150 nm are chosen.
- unbinding as for ALPHA_ACTININ, which is an assumption: both have similar rupture forces of 40 to 80 pN (Ferrer et al.
  2008).
- stiffness 0.1 pN/nm is chosen, not measured; filamin is no harmonic spring.
- ``binding_rate`` is chosen: one hand in solution binds to actin, a site every 2.7 nm, with K_d = 1 uM, an assumption.
"""

MYOSIN_II = Crosslinker(
    name="myosin II",
    hands=Hand(
        binding_rate=18 / _S,
        reach=225 * _NM,
        unbinding_rate=0.42 / _S,
        speed=0.5 * _UM / _S,
        stall_force=4 * _PN,
        binds_to=[F_ACTIN],
    ),
    stiffness=0.1 * _PN / _NM,
    rest_length=200 * _NM,
)
"""A bipolar filament of nonmuscle myosin II, as network simulators take it: each hand stands for the heads of one half.

These are effective values of models, not measurements of one molecule:

- 22 heads a side, of 15 to 30, that bind with k_on = 0.2/s and unbind with k_off = 1.7/s, and act over 175 to 225 nm,
  as in MEDYAN (Popov et al. 2016). Together they let go with N k_on/((1 + k_on/k_off)^N - 1) = 0.42/s (Klumpp,
  Lipowsky 2005), and the first of them binds with N k_on = 4.4/s: that is what a straight filament at
  200 nm from the other hand meets. Load does not change these rates here; in MEDYAN it is a catch bond.
- speed 0.5 um/s, ``stall_force`` 4 pN, stiffness 0.1 pN/nm: those of the contractile bundle among the examples of
  Cytosim (cym/bundle_contract.cym, after a model of D. Cortes), a program with effective hands; ATP is not limiting.
  MEDYAN lets a filament stall at much larger forces.
- ``rest_length`` 200 nm: the middle of the 175 to 225 nm.
"""

KINESIN_1 = Crosslinker(
    name="kinesin-1",
    hands=Hand(
        binding_rate=15 / _S,
        reach=50 * _NM,
        unbinding_rate=0.8 / _S,
        unbinding_force=3 * _PN,
        speed=0.8 * _UM / _S,
        stall_force=6 * _PN,
        binds_to=[MICROTUBULE],
    ),
    stiffness=0.3 * _PN / _NM,
    rest_length=30 * _NM,
)
"""Kinesin-1, at saturating ATP and room temperature, on a surface or a particle (``anchors``).

Without anchors it is a complex of two of them, whose length and stiffness are those of one: two in series have
``rest_length`` 60 nm and half of the stiffness.

- speed 0.8 um/s, ``stall_force`` 6 pN (Svoboda, Block 1994; Schnitzer, Visscher, Block 2000: 5 to 8 pN).
- unbinding 0.8/s, so that it runs 1 um; ``unbinding_force`` 3 pN (Müller et al. 2008, from Schnitzer et al. 2000).
- length: it holds its cargo 17 nm above a microtubule (Kerssemakers et al. 2006), whose radius is 12.5 nm.
- stiffness 0.3 pN/nm (Coppin et al. 1997); the spring resists compression as well, which a kinesin hardly does.
- ``binding_rate`` is chosen: 5/s (Leduc et al. 2004, kinesins on vesicles) for a straight filament at the rest length.

It binds anywhere, not to sites every 8 nm: a line with such sites would hold one motor each, and a microtubule has 13
protofilaments. ``site_spacing`` has them.
"""

DYNEIN = Crosslinker(
    name="dynein",
    hands=Hand(
        binding_rate=5.4 / _S,
        reach=70 * _NM,
        unbinding_rate=0.27 / _S,
        unbinding_force=0.75 * _PN,
        speed=-0.65 * _UM / _S,
        stall_force=1.1 * _PN,
        binds_to=[MICROTUBULE],
    ),
    stiffness=0.3 * _PN / _NM,
    rest_length=50 * _NM,
)
"""Cytoplasmic dynein of mammals, at saturating ATP, on a surface or a particle (``anchors``); it walks to minus ends.

Without anchors it is a complex of two of them, as KINESIN_1.

- speed 0.65 um/s, ``stall_force`` 1.1 pN (Mallik et al. 2004), unbinding 0.27/s, ``unbinding_force`` 0.75 pN, and 1.6/s
  with which it binds: as Müller et al. 2008 take them, the last two from a fit. Others find stall forces of 4 pN, with
  adaptors, to 7 pN.
- length 50 nm and stiffness 0.3 pN/nm: about the size of the molecule, and the stiffness of kinesin, assumptions.
- ``binding_rate`` is chosen: 1.6/s for a straight filament at the rest length.
"""

KINESIN_13 = Crosslinker(
    name="kinesin-13",
    hands=[
        Hand(binding_rate=0 / _S, reach=50 * _NM, unbinding_rate=0 / _S, binds_to=[MICROTUBULE]),
        Hand(
            binding_rate=30.5 / _S,
            reach=50 * _NM,
            unbinding_rate=1 / (0.83 * _S),
            binds_to=[MICROTUBULE],
            sliding_friction=4.116 * _PN * _NM / (0.38 * _UM**2 / _S),
            filament_end=HandAtEnd(
                end="both", range=8 * _NM, tracks=True, off_rate=1 / _S, sites=14, unbinding_rate=1 / (20 * _S)
            ),
        ),
    ],
    stiffness=0.3 * _PN / _NM,
    rest_length=30 * _NM,
)
"""Kinesin-13, MCAK, with ATP at 25 C: it diffuses on microtubules that grow, stays at both ends, and takes tubulin off.

- it diffuses with 0.38 um^2/s, and lets go after 0.83 s on average (Helenius et al. 2006): it slides 0.56 um.
- it gets to an end with 54/(uM s), stays there for some 20 dimers, which it takes off at 1/s; there are up to 14 at an
  end, one for each protofilament (Hunter et al. 2003): ``unbinding_rate`` 0.05/s at an end, and 14 ``sites``.
- ``binding_rate`` is chosen: what binds within reach of an end slides there with these 54/(uM s), 96/(uM s) for each
  micrometre of microtubule. That all of them come by sliding is an assumption; some come out of the solution (Cooper et
  al. 2010).
- that none leaves an end along the lattice, nor gets in the way of others, and that it takes as much off an end that
  grows, or that a load pulls at, are assumptions. A dimer a second is little where 50 come and go; that it makes
  catastrophes more frequent is another matter: ``changes`` of a ``HandAtEnd`` at plus ends.
- range, stiffness and lengths are chosen, the latter as for KINESIN_1. The first hand binds to nothing; with
  ``anchors``, as on a kinetochore, there is the second one alone.
"""

# One kilobase of DNA is 340 nm long.
COHESIN = Crosslinker(
    name="cohesin",
    hands=[
        Hand(
            binding_rate=1 / _S,
            reach=100 * _NM,
            unbinding_rate=0.5 / (22 * 60 * _S),
            speed=direction * 170 * _NM / _S,
            stall_force=0.2 * _PN,
        )
        for direction in (-1, 1)
    ],
    stiffness=0.005 * _PN / _NM,
    rest_length=40 * _NM,
    loading_distance=40 * _NM,
)
"""Cohesin with NIPBL on DNA: both hands load at once, walk apart, and extrude a loop from both sides.

- speed: 1 kb/s in all, half of it on each side. Single complexes extrude symmetrically, with up to 2.1 kb/s (Davidson
  et al. 2019); the mean is 0.5 kb/s in Kim et al., Science 2019, 366, 1345. Lengths are those of naked DNA, 340 nm for
  a kilobase: on filaments that stand for chromatin, take the length of a kilobase there.
- unbinding: once in 22 min, the residence time of cohesin on chromatin (Hansen et al. 2017).
- ``stall_force`` 0.2 pN is chosen: extrusion is sensitive to some tenths of a piconewton.
- lengths are chosen, about the size of the molecule, and so is ``binding_rate``. The spring is so soft that its
  thermal force, (k k_BT)^(1/2) = 0.14 pN, does not exceed the stall force.
"""

CONDENSIN = Crosslinker(
    name="condensin",
    hands=[
        Hand(
            binding_rate=1 / _S,
            reach=100 * _NM,
            unbinding_rate=0.001 / _S,
            speed=speed * 204 * _NM / _S,
            stall_force=0.4 * _PN if speed else None,
        )
        for speed in (0, 1)
    ],
    stiffness=0.005 * _PN / _NM,
    rest_length=40 * _NM,
    loading_distance=40 * _NM,
)
"""Yeast condensin on DNA: one hand holds, the other one walks to the plus end and reels DNA in from that side.

- one-sided, with up to 1.5 kb/s, depending on the force (Ganji et al. 2018); speed 0.6 kb/s, its mean.
- all others walk to the minus end: a second kind of linkers, with a first hand that walks and a second one that holds.
- ``stall_force`` 0.4 pN, unbinding once in 500 s, stiffness, lengths and ``binding_rate`` are chosen, as for COHESIN.
"""

PRESETS = {
    "ALPHA_ACTININ": ALPHA_ACTININ,
    "FILAMIN": FILAMIN,
    "MYOSIN_II": MYOSIN_II,
    "KINESIN_1": KINESIN_1,
    "DYNEIN": DYNEIN,
    "KINESIN_13": KINESIN_13,
    "COHESIN": COHESIN,
    "CONDENSIN": CONDENSIN,
}
"""Crosslinkers by the names that users and configurations use."""
