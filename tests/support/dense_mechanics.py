"""Bent and straight chains, their friction and stiffness as dense matrices, and their motion by other ways."""

import numpy as np

from support.solvent import TEMPERATURE, VISCOSITY


def _project(tangent, along, across):
    parallel = np.outer(tangent, tangent)
    return along * parallel + across * (np.eye(3) - parallel)


def bent_chain(kind, segments, seed):
    generator = np.random.default_rng(seed)
    tangents = np.array([1.0, 0.0, 0.0]) + 0.4 * generator.normal(size=(segments, 3))
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    lengths = kind.segment_length * (1.0 + 0.05 * generator.normal(size=(segments, 1)))
    return np.concatenate([np.zeros((1, 3)), np.cumsum(lengths * tangents, axis=0)]) + generator.normal(size=3) * 50


def dense_resistance(nodes, friction, closed=False):
    """Z assembled segment by segment from the four friction coefficients."""
    count = len(nodes)
    resistance = np.zeros((3 * count, 3 * count))
    for segment in range(count if closed else count - 1):
        following = (segment + 1) % count
        difference = nodes[following] - nodes[segment]
        length = np.linalg.norm(difference)
        tangent = difference / length
        trans = _project(tangent, friction.parallel, friction.perpendicular)
        dr = _project(tangent, friction.extensional, friction.rotational) / length**2
        same, other = trans / 4 + dr, trans / 4 - dr
        block = np.concatenate([3 * segment + np.arange(3), 3 * following + np.arange(3)])
        resistance[np.ix_(block, block)] += np.block([[same, other], [other, same]])
    return resistance


def virtual_forces(nodes, friction, minus, plus):
    """Phi from (24) and velocities from (22) and (23), in the paper's notation.

    The paper's segment i has its plus end at node i and its minus end at node i + 1.
    """
    count = len(nodes) - 1
    mobility_trans, mobility_dr, length = [], [], []
    force, torque = [], []
    for i in range(count):
        difference = nodes[i] - nodes[i + 1]
        length.append(np.linalg.norm(difference))
        tangent = difference / length[i]
        mobility_trans.append(_project(tangent, 1 / friction.parallel, 1 / friction.perpendicular))
        mobility_dr.append(_project(tangent, 1 / friction.extensional, 1 / friction.rotational))
        force.append(minus[i] + plus[i])
        torque.append(length[i] / 2 * (minus[i] - plus[i]))
    a_plus = [mobility_trans[i] + length[i] ** 2 / 4 * mobility_dr[i] for i in range(count)]
    a_minus = [mobility_trans[i] - length[i] ** 2 / 4 * mobility_dr[i] for i in range(count)]
    phi = np.zeros((count + 1, 3))  # phi[i] is Phi^(i); phi[-1] stands for the absent Phi^(-1) and Phi^(N-1).
    if count > 1:
        matrix, right = np.zeros((3 * (count - 1), 3 * (count - 1))), np.zeros((count - 1, 3))
        for i in range(count - 1):
            rows = slice(3 * i, 3 * i + 3)
            matrix[rows, rows] = a_plus[i + 1] + a_plus[i]
            if i + 1 < count - 1:
                matrix[rows, 3 * i + 3 : 3 * i + 6] = -a_minus[i + 1]
            if i > 0:
                matrix[rows, 3 * i - 3 : 3 * i] = -a_minus[i]
            right[i] = (
                mobility_trans[i + 1] @ force[i + 1]
                - mobility_trans[i] @ force[i]
                + length[i + 1] / 2 * mobility_dr[i + 1] @ torque[i + 1]
                + length[i] / 2 * mobility_dr[i] @ torque[i]
            )
        phi[: count - 1] = np.linalg.solve(matrix, right.reshape(-1)).reshape(-1, 3)
    velocity = np.zeros((count + 1, 3))
    for i in range(count):
        before, after = phi[i - 1] if i > 0 else np.zeros(3), phi[i] if i < count - 1 else np.zeros(3)
        total = force[i] + after - before
        moment = torque[i] - length[i] / 2 * after - length[i] / 2 * before
        translation, turning = mobility_trans[i] @ total, length[i] / 2 * mobility_dr[i] @ moment
        velocity[i], velocity[i + 1] = translation + turning, translation - turning
    return velocity, phi[: count - 1]


def straight_resistance(kind, segments, translational, rotational):
    """Friction of the nodes of a straight filament along one direction, by hand."""
    resistance = np.zeros((segments + 1, segments + 1))
    for segment in range(segments):
        both = np.ix_([segment, segment + 1], [segment, segment + 1])
        moving, turning = translational / 4, rotational / kind.segment_length**2
        resistance[both] += [[moving + turning, moving - turning], [moving - turning, moving + turning]]
    return resistance


def straight_matrices(kind, segments, step):
    """Friction and stiffness of the nodes of a straight filament across it, and theta."""
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE, segments)
    nodes = segments + 1
    resistance = straight_resistance(kind, segments, friction.perpendicular, friction.rotational)
    stiffness = np.zeros((nodes, nodes))
    for joint in range(1, segments):
        bend = np.zeros(nodes)
        bend[joint - 1 : joint + 2] = 1.0, -2.0, 1.0
        stiffness += kind.bending_rigidity / kind.segment_length**3 * np.outer(bend, bend)
    fastest = 4 * step * kind.bending_rigidity / kind.segment_length / friction.rotational
    return resistance, stiffness, max(0.5, 1 - 1 / fastest)
