"""What is compared of rods in equilibrium, the same of Monte Carlo and of steps in time: numpy alone."""

import numpy as np

# Distances of axes in nm, for contacts at 30 nm: what is below the first is in the first.
DISTANCES = np.concatenate([[0.0], np.arange(22.0, 51.0, 2.0)])
# Rods that are nearer count for the order of neighbours.
NEAR = 40.0


def observable_names(system):
    """Of what ``observe`` returns, in its order."""
    names = []
    if system.contact:
        names += [f"pairs {a:g}-{b:g} nm" for a, b in zip(DISTANCES, DISTANCES[1:])]
        names += ["energy of contacts", "near pairs", "P2 of near pairs" if not system.planar else "cos2 of near pairs"]
    if system.wall:
        names += ["energy of walls", "force of walls", "P2 across walls", "middle quarter"]
    if system.links:
        names += ["energy of links"]
    return names + ["order"] * (system.rods > 1)


def observe(system, middles, along):
    """An array (copies, observables); energies in k_B T and forces in k_B T/nm, each the sum over all rods.

    The order is the mean over pairs of P2, or cos 2 theta in a plane. P2 of near pairs is their sum, to be divided by
    their number: ``means_of``. P2 across walls is the mean over rods; in the middle quarter of the height are so many
    rods.
    """
    columns = []
    directions = along / np.linalg.norm(along, axis=-1)[..., None]
    if system.rods > 1:
        i, j = np.triu_indices(system.rods, 1)
        cosines = np.einsum("cpk,cpk->cp", directions[:, i], directions[:, j])
        order = 2.0 * cosines**2 - 1.0 if system.planar else 1.5 * cosines**2 - 0.5
    if system.contact:
        distances, parallel = system.pairs(middles, along)
        least = distances[0]
        within = np.array([np.sum(least < edge, axis=1) for edge in DISTANCES])
        columns += list(np.diff(within, axis=0))
        near = least < NEAR
        columns += [system.contact_energies(distances, parallel).sum(axis=1)]
        columns += [near.sum(axis=1), (order * near).sum(axis=1)]
    if system.wall:
        columns += [system.wall_energies(middles, along).sum(axis=1)]
        columns += [system.wall * system.depths(middles, along).sum(axis=(0, 2))]
        columns += [(1.5 * directions[..., 2] ** 2 - 0.5).mean(axis=1)]
        columns += [np.sum(np.abs(middles[..., 2] - 0.5 * system.height) < system.height / 8, axis=1)]
    if system.links:
        columns += [system.link_energies(middles, along).sum(axis=1)]
    if system.rods > 1:
        columns += [order.mean(axis=1)]
    return np.stack(columns, axis=1).astype(float)


def means_of(system, values, weights=None):
    """Means and standard errors (observables,) of independent rows (rows, observables) of ``observe``."""
    weights = np.ones(len(values)) if weights is None else weights
    share = weights / weights.sum()
    means = share @ values
    deviations = values - means
    names = observable_names(system)
    near = [number for number, name in enumerate(names) if name.endswith("of near pairs")]
    for number in near:
        # A quotient of two sums.
        count = names.index("near pairs")
        means[number] /= means[count]
        deviations[:, number] = (values[:, number] - means[number] * values[:, count]) / means[count]
    rows = len(values)
    errors = np.sqrt(((share[:, None] * deviations) ** 2).sum(axis=0) * rows / max(rows - 1, 1))
    return means, errors


# By how much steps in time may differ, relative to what is exact; an order that is nearly zero by SMALL_ORDER.
ALLOWED = {"pairs": 0.05, "energy": 0.05, "energy of walls": 0.02, "force of walls": 0.02, "near pairs": 0.05}
ALLOWED_OTHERS = 0.03
SMALL_ORDER = 0.0015


def allowed_difference(name, exact):
    """Absolute, for an observable of this name."""
    relative = ALLOWED.get(name, ALLOWED.get(name.split()[0], ALLOWED_OTHERS))
    if name.startswith(("order", "P2", "cos2")):
        return max(relative * abs(exact), SMALL_ORDER)
    return relative * abs(exact)


def check(system, rows, exact, exact_errors, seen=0.05):
    """Assert that rows are as is exact, within what is allowed and four standard errors.

    All of those whose error is below a quarter of ``seen`` of the mean count, and they must be there: energies and
    distances from the soft layer outwards. It shows all of them otherwise.
    """
    means, errors = means_of(system, rows)
    errors = np.hypot(errors, exact_errors)
    lines, wrong, sure = [], [], []
    for name, mean, error, expected in zip(observable_names(system), means, errors, exact):
        off = abs(mean - expected) > allowed_difference(name, expected) + 4 * error
        lines.append(f"{name}: {mean / expected:.4f} +- {abs(error / expected):.4f} of {expected:.5g}")
        if off:
            wrong.append(name)
            lines[-1] += " wrong"
        if 4 * error < seen * abs(expected):
            sure.append(name)
    assert not wrong, "\n".join(lines)
    needed = [name for name in observable_names(system) if name.startswith(("energy", "force"))]
    needed += ["pairs 26-28 nm", "pairs 28-30 nm", "pairs 30-32 nm", "pairs 32-34 nm"] if system.contact else []
    assert set(needed) <= set(sure), "too few samples:\n" + "\n".join(lines)
