"""The transfer operator of a bead-spring chain: its exact equilibrium, in the units of the model.

Lengths are in units of d and energies in units of lambda d^2 (Panja, Barkema and van Leeuwen, PRE 2015, 92, 032603,
eq. (2)). The weight of N bonds u_n in D = 3 or 2 dimensions,

    exp(-(1/2T) [sum_n (u_n - 1)^2 - 2 nu sum_n u_n.u_(n+1)]),        T = T*,

couples directions of neighbours only through x = nu u u'/T. With the angles integrated out it is a product of factors
between the lengths of neighbours: u^(D-1) of every length, and of every pair

    k_l(u, u') = exp(nu u u'/T) g_l(x),     g_0 = sinh(x)/x, g_1 = cosh(x)/x - sinh(x)/x^2       (D = 3)
                                            g_0 = I_0(x),    g_1 = I_1(x)                        (D = 2)

each g_l times exp(-x), where l = 0 gives averages of lengths, and l = 1 correlations <u_i.u_j>. Lengths are measured
from those of lowest energy of the straight chain, v_n - nu (v_(n-1) + v_(n+1)) = 1: with u_n = v_n + w_n what is left
of the energy is exactly sum w_n^2/2 - nu sum w_n w_(n+1), so that nothing overflows or cancels, however cold it is.
Both ends of the chain are in this; there is no closed chain.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import scipy

from ..units.types import FloatArray

_HALF_WIDTH = 10.0
_NODES_PER_DEVIATION = 3.0
_FEWEST_NODES = 32
_FINE_SPACING = 0.15
_NUMBERS_AT_ONCE = 4_000_000
_NEWTON_STEPS = 5


@dataclass(frozen=True)
class _Grid:
    # Deviations w from the length of lowest energy, lengths u, and weights of averages over u, with u^(D-1).
    shift: FloatArray
    length: FloatArray
    weight: FloatArray


def _length(length: FloatArray) -> FloatArray:
    return length


class TransferOperator:
    """Averages and independent draws of a chain of N bonds in equilibrium.

    Parameters
    ----------
    nu : float
        kappa/lambda, above 0 and below 1/2.
    reduced_temperature : float
        T* = k_B T/(lambda d^2), above zero.
    bonds : int
        N, at least 1.
    dimensions : {3, 2}
    """

    def __init__(self, nu: float, reduced_temperature: float, bonds: int, dimensions: int = 3) -> None:
        self.bonds = bonds
        self._nu = nu
        self._temperature = reduced_temperature
        self._power = dimensions - 1
        self._zeroth, self._first = _RADIAL[dimensions]
        self._centers = straight_lengths(nu, bonds)
        # The deviation of a length given its neighbours, and what lengths reach: what is left out is below exp(-50).
        deviation = np.sqrt(reduced_temperature)
        self._reach = _HALF_WIDTH * deviation / (1.0 - 4.0 * nu**2) ** 0.25
        widths = 2.0 * self._reach / deviation
        count = max(_FEWEST_NODES, int(np.ceil(_NODES_PER_DEVIATION * widths)))
        self._abscissae, self._coefficients = np.polynomial.legendre.leggauss(count)
        self._cells = max(4 * _FEWEST_NODES, int(np.ceil(widths / _FINE_SPACING)))
        # In the middle of a long chain all bonds are alike, and so is what is computed for them.
        self._bulk = 1.0 / (1.0 - 2.0 * nu)
        self._kept: dict[str, Any] = {}
        self._fine_messages: dict[int, tuple[_Grid, FloatArray]] = {}
        self._messages, self._growth = self._propagate()

    def _once_in_bulk(self, name, bonds, compute):
        # ``compute()``, or what it gave before if the bonds are in the middle of a long chain.
        if any(self._centers[bond] != self._bulk for bond in bonds):
            return compute()
        if name not in self._kept:
            self._kept[name] = compute()
        return self._kept[name]

    def _grid(self, bond):
        return self._once_in_bulk("grid", (bond,), lambda: self._grid_around(self._centers[bond]))

    def _grid_around(self, center):
        low = max(-self._reach, -center)
        half = 0.5 * (self._reach - low)
        shift = low + half * (1.0 + self._abscissae)
        length = center + shift
        return _Grid(shift, length, half * self._coefficients * length**self._power)

    def _gaussian(self, shift):
        return np.exp(-0.25 * shift**2 / self._temperature)

    def _coupling(self, one, other):
        # exp(nu w w'/T), with half of the Gaussian of either length, and x: for one's lengths and other's.
        a, b = one.shift[:, None], other.shift[None, :]
        exponent = (self._nu * a * b - 0.25 * (a**2 + b**2)) / self._temperature
        return np.exp(exponent), self._nu * one.length[:, None] * other.length[None, :] / self._temperature

    def _kernels_between(self, one, other):
        coupling, x = self._coupling(one, other)
        zeroth = self._zeroth(x)
        return coupling * zeroth, coupling * self._first(x, zeroth)

    def _kernels(self, bond):
        # Of l = 0 and l = 1, between a bond and the next one.
        both = (bond, bond + 1)
        return self._once_in_bulk("kernels", both, lambda: self._kernels_between(*map(self._grid, both)))

    def _propagate(self):
        # The message of a bond is the weight of all that stands before it, with half of its own Gaussian. That of what
        # stands behind it is the message of the bond as far from the other end.
        messages = np.empty((self.bonds, len(self._abscissae)))
        growth = np.ones(self.bonds)
        for bond in range(self.bonds):
            if bond == 0:
                message = self._gaussian(self._grid(0).shift)
            else:
                message = (messages[bond - 1] * self._grid(bond - 1).weight) @ self._kernels(bond - 1)[0]
            growth[bond] = np.sqrt(np.sum(message**2))
            messages[bond] = message / growth[bond]
        return messages, growth

    def _behind(self, bond):
        return self._messages[self.bonds - 1 - bond] * self._grid(bond).weight

    def means(self, *functions: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Averages (functions, bonds) of functions of the length of every bond."""
        values = np.empty((len(functions), self.bonds))
        for bond in range(self.bonds):
            density = self._messages[bond] * self._behind(bond)
            density /= density.sum()
            values[:, bond] = [density @ function(self._grid(bond).length) for function in functions]
        return values

    def neighbor_correlations(self) -> FloatArray:
        """<u_n.u_(n+1)> of all neighbours: (bonds - 1,)."""
        values = np.empty(self.bonds - 1)
        for bond in range(self.bonds - 1):
            grid = self._grid(bond)
            carried = (self._messages[bond] * grid.length * grid.weight) @ self._kernels(bond)[1]
            values[bond] = self._projection(bond + 1) @ carried / self._growth[bond + 1]
        return values

    def correlations(self, bond: int) -> FloatArray:
        """<u_bond.u_j> of a bond and all bonds j behind it: (bonds - bond - 1,)."""
        source = np.zeros((self.bonds, 1))
        source[bond] = 1.0
        return np.array([projection @ carried[:, 0] for _, carried, projection in self._carry(source, bond)])

    def correlation_sum(
        self, first: FloatArray, second: FloatArray, vector: Callable[[FloatArray], FloatArray] = _length
    ) -> FloatArray:
        """Sums over pairs i < j of ``first[i] second[j] <v_i.v_j>``, for the columns of two (bonds, sums) arrays.

        v_n is a vector along the bond, ``vector`` of its length long: u_n itself if not given.
        """
        total = np.zeros(first.shape[1])
        for bond, carried, projection in self._carry(first, vector=vector):
            total += second[bond] * (projection @ carried)
        return total

    def _carry(
        self, first: FloatArray, start: int = 0, vector: Callable[[FloatArray], FloatArray] = _length
    ) -> Iterator[tuple[int, FloatArray, FloatArray]]:
        # For every bond j: the sum over i < j of first[i] v_i, carried to j, and what makes averages <.v_j> of it.
        carried = np.zeros((len(self._abscissae), first.shape[1]))
        for bond in range(start, self.bonds - 1):
            grid = self._grid(bond)
            source = carried + np.outer(self._messages[bond] * vector(grid.length), first[bond])
            carried = self._kernels(bond)[1].T @ (source * grid.weight[:, None]) / self._growth[bond + 1]
            yield bond + 1, carried, self._projection(bond + 1, vector)

    def _projection(self, bond, vector=_length):
        behind = self._behind(bond)
        return vector(self._grid(bond).length) * behind / (self._messages[bond] @ behind)

    def correlation_length(self) -> float:
        """Number of bonds over which <u_i.u_j> falls by 1/e in the middle of a long chain of the same parameters."""
        middle = self._grid_around(self._bulk)
        root = np.sqrt(middle.weight)
        last = len(root) - 1
        zeroth, first = (
            scipy.linalg.eigh(root[:, None] * kernel * root, eigvals_only=True, subset_by_index=[last, last])[0]
            for kernel in self._kernels_between(middle, middle)
        )
        return float(1.0 / np.log(zeroth / first))

    def draw(self, generator: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
        """Independent draws of chains: lengths (count, bonds), and x (count, bonds - 1) of all pairs of neighbours.

        The angle between two neighbours has the density exp(x cos) on the sphere or on the circle. Lengths are drawn
        from the last bond to the first, each from its density given the one behind it.
        """
        lengths = np.empty((count, self.bonds))
        at_once = max(1, _NUMBERS_AT_ONCE // self._cells)
        for first in range(0, count, at_once):
            self._draw(generator, lengths[first : first + at_once])
        return lengths, self._nu * lengths[:, 1:] * lengths[:, :-1] / self._temperature

    def _draw(self, generator, lengths):
        for bond in range(self.bonds - 1, -1, -1):
            grid, density = self._kept_fine_message(bond)
            if bond == self.bonds - 1:
                density = np.tile(density * self._gaussian(grid.shift), (len(lengths), 1))
            else:
                behind = lengths[:, bond + 1]
                coupling, x = self._coupling(_Grid(behind - self._centers[bond + 1], behind, behind), grid)
                density = density * coupling * self._zeroth(x)
            spacing = grid.length[1] - grid.length[0]
            lengths[:, bond] = grid.length[0] + spacing * _invert(density, generator.random(len(lengths)))

    def _kept_fine_message(self, bond):
        # With the weights of the grid. One draw after the other takes the same ones.
        if bond in self._fine_messages:
            return self._fine_messages[bond]
        grid, message = self._fine_message(bond)
        weighted = grid, message * grid.weight
        if self.bonds * self._cells <= _NUMBERS_AT_ONCE:
            self._fine_messages[bond] = weighted
        return weighted

    def _fine_message(self, bond):
        # A message on a fine grid, by the integral that makes it.
        grid = self._once_in_bulk("fine", (bond,), lambda: self._fine_grid(bond))
        if bond == 0:
            return grid, self._gaussian(grid.shift)
        both = (bond - 1, bond)
        before = self._grid(bond - 1)
        kernel = self._once_in_bulk("fine kernel", both, lambda: self._kernels_between(before, grid)[0])
        return grid, (self._messages[bond - 1] * before.weight) @ kernel

    def _fine_grid(self, bond):
        center = self._centers[bond]
        shift = np.linspace(max(-self._reach, -center), self._reach, self._cells + 1)
        length = np.maximum(center + shift, 0.0)
        return _Grid(shift, length, length**self._power)


def straight_lengths(nu: float, bonds: int) -> FloatArray:
    """Lengths (bonds,) of lowest energy of the straight chain, in units of d: v_n - nu (v_(n-1) + v_(n+1)) = 1.

    v_n = b (1 - (c^n + c^(N+1-n))/(1 + c^(N+1))), b = 1/(1 - 2 nu), c = 2 nu/(1 + sqrt(1 - 4 nu^2)).
    """
    decay = 2.0 * nu / (1.0 + np.sqrt(1.0 - 4.0 * nu**2))
    near = np.minimum(np.arange(1, bonds + 1), np.arange(bonds, 0, -1))
    ends = (decay**near + decay ** (bonds + 1 - near)) / (1.0 + decay ** (bonds + 1))
    return (1.0 - np.where(ends < 1e-16, 0.0, ends)) / (1.0 - 2.0 * nu)


def _zeroth_in_space(x):
    safe = np.maximum(x, 1e-300)
    return -0.5 * np.expm1(-2.0 * safe) / safe


def _first_in_space(x, zeroth):
    # The difference cancels for small x.
    small = x < 0.3
    safe, square = np.where(small, 1.0, x), x**2
    series = x / 3.0 * (1.0 + square / 10.0 * (1.0 + square / 28.0 * (1.0 + square / 54.0 * (1.0 + square / 88.0))))
    return np.where(small, np.exp(-x) * series, (0.5 * (1.0 + np.exp(-2.0 * x)) - zeroth) / safe)


def _zeroth_in_plane(x):
    return scipy.special.i0e(x)


def _first_in_plane(x, zeroth):
    return scipy.special.i1e(x)


_RADIAL = {3: (_zeroth_in_space, _first_in_space), 2: (_zeroth_in_plane, _first_in_plane)}


def _invert(density, probability):
    # Places, in cells, where the integrals of densities (draws, points) have a share of their total. Integrals of cells
    # are those of cubics through four points; within one, of the parabola with its area and the density at both ends.
    inner = 13.0 * (density[:, 1:-2] + density[:, 2:-1]) - density[:, :-3] - density[:, 3:]
    first, last = density[:, :4] @ _OUTERMOST, density[:, -4:] @ _OUTERMOST[::-1]
    areas = np.maximum(np.concatenate([first[:, None], inner, last[:, None]], axis=1) / 24.0, 0.0)
    cumulative = np.cumsum(areas, axis=1)
    target = probability * cumulative[:, -1]
    cell = np.minimum(np.sum(cumulative < target[:, None], axis=1), areas.shape[1] - 1)
    draw = np.arange(len(density))
    left, right, area = density[draw, cell], density[draw, cell + 1], areas[draw, cell]
    wanted = target - (cumulative[draw, cell] - area)
    second, third = 3.0 * area - 2.0 * left - right, left + right - 2.0 * area
    place = np.minimum(np.maximum(wanted / np.maximum(area, 1e-300), 0.0), 1.0)
    for _ in range(_NEWTON_STEPS):
        excess = place * (left + place * (second + place * third)) - wanted
        slope = left + place * (2.0 * second + 3.0 * place * third)
        before, place = place, np.minimum(np.maximum(place - excess / np.maximum(slope, 1e-300), 0.0), 1.0)
        if (place == before).all():
            break
    return cell + place


_OUTERMOST = np.array([9.0, 19.0, -5.0, 1.0])


@lru_cache(maxsize=8)
def transfer_operator(nu: float, reduced_temperature: float, bonds: int, dimensions: int = 3) -> TransferOperator:
    """A TransferOperator, kept for the next call."""
    return TransferOperator(nu, reduced_temperature, bonds, dimensions)
