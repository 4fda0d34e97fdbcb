// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What a step keeps of elements, and velocities and forces at the points of their curves.
 */

/** What a step begins with. */
template <int W> struct BeamStart {
    Vector<typename Lanes<W>::Type> *control, *chord;
    /** From the points of tethers to their nodes: three numbers for each. */
    double* tethers;
    /** The first nodes of chains, where a flow drags them along. */
    Vector<typename Lanes<W>::Type>* first;
};

/** The memory for what a step begins with. */
template <int W> struct BeamStartMemory {
    Scratch vectors;
    std::vector<double> tethers;
    BeamStart<W> reserve(const BeamPack& pack) {
        typedef Vector<typename Lanes<W>::Type> Vec;
        Vec* const begun = vectors.template reserve<Vec>(2*pack.nodes+1);
        tethers.resize(3*pack.tethers.size());
        return {begun, begun+pack.nodes, tethers.data(), begun+2*pack.nodes};
    }
};

/** What a step keeps of a tether, which is a coordinate of three components. */
struct BeamTetherState {
    double theta, random[3];
};

/** A coordinate that is a strain: its start and noise, and what the last iteration had for its tension. */
template <class Real> struct BeamStrain {
    Real start, random, stiffness, tension, multiplier, before;
};

/** What a step keeps of an element and of its first node. */
template <class Real> struct BeamElementState {
    BeamStrain<Real> ofNode, ofMiddle;
    Vector<Real> sum, difference, randomSum, randomDifference, middle;
    Vector<Real> direction, newMiddle;
    /** The response of the strain in the middle to the four vectors. */
    Vector<Real> weights[4];
    /** What the forces of the two strains lack of those along the mean directions, for a tension of one. */
    BeamGradient<Real> lacking;
    Vector<Real> nodeLacking;
};

/** The direction of the curve at a Gauss point. */
template <class Real> CYLCHAIN_INLINE Vector<Real> directionAt(int g, const Vector<Real>& control1,
            const Vector<Real>& chord, const Vector<Real>& control2) {
    const Vector<Real> slope = control1*splat<Real>(WEIGHTS.slope[g][1])+chord*splat<Real>(WEIGHTS.slope[g][2])+
            control2*splat<Real>(WEIGHTS.slope[g][3]);
    return slope*(1/root(slope.dot(slope)));
}

/** Let a force at a Gauss point act on the nodes. */
template <class Real> CYLCHAIN_INLINE void addAt(int g, const Vector<Real>& force, SixVector<Real>& first,
            SixVector<Real>& second) {
    first.position = first.position+force*splat<Real>(WEIGHTS.value[g][0]);
    first.control = first.control+force*splat<Real>(WEIGHTS.value[g][1]);
    second.position = second.position+force*splat<Real>(WEIGHTS.value[g][2]);
    second.control = second.control+force*splat<Real>(WEIGHTS.value[g][3]);
}

/** Let the propulsion of an element act on its nodes. */
template <class Real> CYLCHAIN_INLINE void addPropulsionOf(Real propulsion, const Vector<Real>& control1,
            const Vector<Real>& chord, const Vector<Real>& control2, SixVector<Real>& first,
            SixVector<Real>& second) {
    for (int g = 0; g < GAUSS_POINTS; g++)
        addAt(g, directionAt(g, control1, chord, control2)*(propulsion*GAUSS_WEIGHTS[g]), first, second);
}

/** How far a Gauss point moves with the nodes. */
template <class Real> CYLCHAIN_INLINE Vector<Real> velocityAt(int g, const SixVector<Real>& first,
            const SixVector<Real>& second) {
    return first.position*splat<Real>(WEIGHTS.value[g][0])+first.control*splat<Real>(WEIGHTS.value[g][1])+
            second.position*splat<Real>(WEIGHTS.value[g][2])+second.control*splat<Real>(WEIGHTS.value[g][3]);
}

/** Let a force on the vectors of an element act on its nodes. */
template <class Real> CYLCHAIN_INLINE void addForcesOf(const BeamGradient<Real>& force, Real perLength,
            SixVector<Real>& first, SixVector<Real>& second) {
    const Vector<Real> chord = force.middle*(perLength*Scalar(1.5)), control = force.middle*(perLength*Scalar(0.75));
    first.position = first.position-chord;
    first.control = first.control+force.first*(3*perLength)-control;
    second.position = second.position+chord;
    second.control = second.control+force.last*(3*perLength)-control;
}
