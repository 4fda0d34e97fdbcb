// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The resistance of chains to the motion of their nodes: forces redistributed along chains, in O(N), and the drag of a
 * flow.
 */

/** What elimination leaves of a node for substitution, and the coupling s 1 + r tt to the next node. */
template <class Real> struct Eliminated {
    Symmetric<Real> inverse;
    Vector<Real> right, tangent;
    Real coupling, axial;
};

/** The friction of a segment on its ends: (s 1 + r tt) on the velocity of the same end, and of the other. */
template <class Real> struct EndFriction {
    Real same, sameAxial, other, otherAxial;
    CYLCHAIN_INLINE EndFriction(const Pack& pack, int s, Real inverseSquare) {
        const Real acrossTrans = 0.25*property<Real>(pack, s, Pack::Perpendicular);
        const Real alongTrans = 0.25*property<Real>(pack, s, Pack::Parallel);
        const Real acrossTurn = property<Real>(pack, s, Pack::Rotational)*inverseSquare;
        const Real alongTurn = property<Real>(pack, s, Pack::Extensional)*inverseSquare;
        same = acrossTrans+acrossTurn;
        sameAxial = alongTrans+alongTurn-same;
        other = acrossTrans-acrossTurn;
        otherAxial = alongTrans-alongTurn-other;
    }
};

/** Solve Z(x) v = f for a pack: v = Z^-1 f by block elimination from the first node to the last and back. */
template <int W> void redistribute(const Pack& pack, const Vector<typename Lanes<W>::Type>* x,
            const Vector<typename Lanes<W>::Type>* f, Eliminated<typename Lanes<W>::Type>* nodes,
            Vector<typename Lanes<W>::Type>* v) {
    typedef typename Lanes<W>::Type Real;
    const Real ofNode = loaded<Real>(pack.nodeFriction, 0);
    Symmetric<Real> diagonal = {};
    diagonal.addDiagonal(ofNode);
    Vector<Real> right = f[0];
    const int last = pack.nodes-1;
    for (int s = 0; s < last; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real inverseSquare = 1/difference.dot(difference);
        const Vector<Real> t = difference*root(inverseSquare);
        const EndFriction<Real> friction(pack, s, inverseSquare);
        const Real same = friction.same, sameAxial = friction.sameAxial;
        const Real other = friction.other, otherAxial = friction.otherAxial;
        diagonal.addAxial(same, sameAxial, t);

        // Eliminate node s.
        Eliminated<Real>& node = nodes[s];
        node.inverse = inverseOfMobile(diagonal, property<Real>(pack, s, Pack::Mobile));
        node.right = right;
        node.tangent = t;
        node.coupling = other;
        node.axial = otherAxial;
        const Vector<Real> g = node.inverse*t;
        const Real tgt = t.dot(g);
        Symmetric<Real> next = {};
        const Real square = other*other, cross = other*otherAxial;
        const Real axial = otherAxial*otherAxial*tgt;
        const Symmetric<Real>& inverse = node.inverse;
        next.xx = -(square*inverse.xx+2*cross*t.x*g.x+axial*t.x*t.x);
        next.yx = -(square*inverse.yx+cross*(t.y*g.x+t.x*g.y)+axial*t.y*t.x);
        next.yy = -(square*inverse.yy+2*cross*t.y*g.y+axial*t.y*t.y);
        next.zx = -(square*inverse.zx+cross*(t.z*g.x+t.x*g.z)+axial*t.z*t.x);
        next.zy = -(square*inverse.zy+cross*(t.z*g.y+t.y*g.z)+axial*t.z*t.y);
        next.zz = -(square*inverse.zz+2*cross*t.z*g.z+axial*t.z*t.z);
        next.addAxial(same, sameAxial, t);
        diagonal = next;
        diagonal.addDiagonal(ofNode);
        const Vector<Real> moved = node.inverse*right;
        right = f[s+1]-moved*other-t*(otherAxial*t.dot(moved));
    }
    v[last] = inverseOfMobile(diagonal, property<Real>(pack, last, Pack::Mobile))*right;
    for (int s = last-1; s >= 0; s--) {
        const Eliminated<Real>& node = nodes[s];
        v[s] = node.inverse*(node.right-v[s+1]*node.coupling-node.tangent*(node.axial*node.tangent.dot(v[s+1])));
    }
}

/**
 * Solve Z(x) v = f for a pack of closed chains: elimination from the second node to the last, each of which is also
 * coupled to the first one then, which comes last.
 */
template <int W> void redistributeClosed(const Pack& pack, const Vector<typename Lanes<W>::Type>* x,
            const Vector<typename Lanes<W>::Type>* f, Eliminated<typename Lanes<W>::Type>* nodes,
            Matrix<typename Lanes<W>::Type>* toFirst, Vector<typename Lanes<W>::Type>* v) {
    typedef typename Lanes<W>::Type Real;
    typedef Matrix<Real> Mat;
    const int count = pack.segments;
    const Real ofNode = loaded<Real>(pack.nodeFriction, 0);
    Symmetric<Real> diagonal = {}, first = {};
    first.addDiagonal(ofNode);
    Vector<Real> right = {}, rightOfFirst = f[0]+f[count];
    Mat coupling = {};
    for (int s = 0; s < count; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real inverseSquare = 1/difference.dot(difference);
        const Vector<Real> t = difference*root(inverseSquare);
        const EndFriction<Real> friction(pack, s, inverseSquare);
        const Mat other = Mat::axial(friction.other, friction.otherAxial, t);
        if (s == 0)
            first.addAxial(friction.same, friction.sameAxial, t);
        else
            diagonal.addAxial(friction.same, friction.sameAxial, t);
        Symmetric<Real> next = {};
        (s == count-1 ? first : next).addAxial(friction.same, friction.sameAxial, t);
        Vector<Real> nextRight = f[s+1];
        Mat nextCoupling = {};
        if (s == 0)
            nextCoupling = other;
        else {
            // Eliminate node s.
            if (s == count-1)
                coupling = coupling+other;
            Eliminated<Real>& node = nodes[s];
            node.inverse = inverseOfMobile(diagonal, property<Real>(pack, s, Pack::Mobile));
            node.right = right;
            node.tangent = t;
            node.coupling = friction.other;
            node.axial = friction.otherAxial;
            toFirst[s] = coupling;
            const Mat inverse = Mat::of(node.inverse), passed = inverse*coupling;
            const Vector<Real> moved = node.inverse*right;
            first = first-(coupling.transposed()*passed).lower();
            rightOfFirst = rightOfFirst-coupling.transposed()*moved;
            if (s < count-1) {
                next = next-(other*(inverse*other)).lower();
                nextRight = nextRight-other*moved;
                nextCoupling = -(other*passed);
            }
        }
        diagonal = next;
        diagonal.addDiagonal(ofNode);
        right = nextRight;
        coupling = nextCoupling;
    }
    v[0] = inverseOfMobile(first, property<Real>(pack, 0, Pack::Mobile))*rightOfFirst;
    for (int s = count-1; s > 0; s--) {
        const Eliminated<Real>& node = nodes[s];
        Vector<Real> rest = node.right-toFirst[s]*v[0];
        if (s < count-1)
            rest = rest-v[s+1]*node.coupling-node.tangent*(node.axial*node.tangent.dot(v[s+1]));
        v[s] = node.inverse*rest;
    }
    v[count] = v[0];
    v[count+1] = v[1];
}

/** Add the drag of the fluid on nodes at rest, Z u. It varies linearly, so the velocities of the ends say all of it. */
template <int W> void addDrag(const Pack& pack, const Vector<typename Lanes<W>::Type>* x, const LaneFlow<W>& flow,
            Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    const Real ofNode = loaded<Real>(pack.nodeFriction, 0);
    for (int node = 0; node < pack.ownNodes() && pack.hasNodeFriction; node++)
        f[node] = f[node]+flow.at(x[node])*ofNode;
    for (int s = 0; s < pack.segments; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real inverseSquare = 1/difference.dot(difference);
        const Vector<Real> t = difference*root(inverseSquare);
        const EndFriction<Real> friction(pack, s, inverseSquare);
        const Vector<Real> first = flow.at(x[s]), second = flow.at(x[s+1]);
        f[s] = f[s]+first*friction.same+second*friction.other+
                t*(friction.sameAxial*t.dot(first)+friction.otherAxial*t.dot(second));
        f[s+1] = f[s+1]+second*friction.same+first*friction.other+
                t*(friction.sameAxial*t.dot(second)+friction.otherAxial*t.dot(first));
    }
}

/** Velocities of all nodes under the forces f, in the flow. */
template <int W> void findVelocities(const Pack& pack, const Vector<typename Lanes<W>::Type>* x,
            const Vector<typename Lanes<W>::Type>* f, const BackgroundFlow& flow, Vector<typename Lanes<W>::Type>* v) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch scratch, couplings, vectors;
    Eliminated<Real>* nodes = scratch.reserve<Eliminated<Real>>(pack.nodes);
    if (flow.present) {
        Vector<Real>* dragged = vectors.reserve<Vector<Real>>(pack.nodes);
        std::copy(f, f+pack.nodes, dragged);
        addDrag<W>(pack, x, LaneFlow<W>(flow, pack.planar, x[0]), dragged);
        f = dragged;
    }
    if (pack.closed)
        redistributeClosed<W>(pack, x, f, nodes, couplings.reserve<Matrix<Real>>(pack.nodes), v);
    else
        redistribute<W>(pack, x, f, nodes, v);
}
