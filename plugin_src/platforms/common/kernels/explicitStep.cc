/**
 * A step of the explicit schemes: forces and noise redistributed along the chain by its resistance. See
 * dynamics/ExplicitLoops-inl.h and Redistribution-inl.h.
 *
 * Of the memory of a place, NODE is the position, EXTERNAL the force, CHANGE the velocity, and INVERSE, SOLUTION and
 * NEW_TANGENT, with SHARE and RESPONSE, are what elimination leaves of a node for substitution.
 */

#ifndef CHAIN_BY_GROUP
/** The friction of a segment on its ends: (s 1+r tt) on the velocity of the same end, and of the other. */
typedef struct {
    Vector tangent;
    double same, sameAxial, other, otherAxial;
} EndFriction;

inline DEVICE EndFriction frictionOfEnds(const Step* step, int s) {
    Vector difference = loadVector(step, NODE, s+1)-loadVector(step, NODE, s);
    double inverseSquare = 1/product(difference, difference);
    double acrossTrans = 0.25*PROPERTY(PERPENDICULAR, s), alongTrans = 0.25*PROPERTY(PARALLEL, s);
    double acrossTurn = PROPERTY(ROTATIONAL, s)*inverseSquare, alongTurn = PROPERTY(EXTENSIONAL, s)*inverseSquare;
    EndFriction result;
    result.tangent = difference*sqrt(inverseSquare);
    result.same = acrossTrans+acrossTurn;
    result.sameAxial = alongTrans+alongTurn-result.same;
    result.other = acrossTrans-acrossTurn;
    result.otherAxial = alongTrans-alongTurn-result.other;
    return result;
}

/** The force on a node, with the drag of the flow on it alone. */
inline DEVICE Vector draggedForce(const Step* step, int node) {
    Vector force = loadVector(step, EXTERNAL, node);
    if (step->hasFlow && step->nodeFriction > 0 && node < step->own)
        force = force+flowAt(step, loadVector(step, NODE, node))*step->nodeFriction;
    return force;
}

/** Add the drag of the flow on a segment to the forces on its ends. */
inline DEVICE void addDrag(const Step* step, int s, EndFriction friction, Vector* here, Vector* next) {
    if (!step->hasFlow)
        return;
    Vector t = friction.tangent;
    Vector first = flowAt(step, loadVector(step, NODE, s)), second = flowAt(step, loadVector(step, NODE, s+1));
    double first1 = product(t, first), second1 = product(t, second);
    *here = *here+first*friction.same+second*friction.other+
            t*(friction.sameAxial*first1+friction.otherAxial*second1);
    *next = *next+second*friction.same+first*friction.other+
            t*(friction.sameAxial*second1+friction.otherAxial*first1);
}

/** Keep what substitution needs of a node. */
inline DEVICE void keepEliminated(const Step* step, int s, Symmetric inverse, Vector right, EndFriction friction) {
    storeSymmetric(step, INVERSE, s, inverse);
    storeVector(step, SOLUTION, s, right);
    storeVector(step, NEW_TANGENT, s, friction.tangent);
    storeField(step, SHARE, s, friction.other);
    storeField(step, RESPONSE, s, friction.otherAxial);
}

/** The velocity of a node, given that of the next one. */
inline DEVICE Vector velocityBefore(const Step* step, int s, Vector next, Vector ofOthers) {
    Vector t = loadVector(step, NEW_TANGENT, s), right = loadVector(step, SOLUTION, s)-ofOthers;
    right = right-next*FIELD(SHARE, s)-t*(FIELD(RESPONSE, s)*product(t, next));
    return symmetricTimes(loadSymmetric(step, INVERSE, s), right);
}

/** Find the velocities of nodes under forces, by elimination from the first node to the last. */
#ifndef CLOSED
DEVICE void findVelocities(const Step* step) {
    const int last = step->own-1;
    Symmetric diagonal = withDiagonal(zeroSymmetric(), step->nodeFriction);
    Vector right = draggedForce(step, 0);
    for (int s = 0; s < last; s++) {
        EndFriction friction = frictionOfEnds(step, s);
        Vector t = friction.tangent, next = draggedForce(step, s+1);
        addDrag(step, s, friction, &right, &next);
        diagonal = withAxial(diagonal, friction.same, friction.sameAxial, t);
        Symmetric inverse = inverseOfMobile(diagonal, PROPERTY(MOBILE, s));
        keepEliminated(step, s, inverse, right, friction);
        Matrix other = axial(friction.other, friction.otherAxial, t);
        Symmetric passed = lessTransposedProduct(zeroSymmetric(), other, symmetricTimesMatrix(inverse, other));
        diagonal = withDiagonal(withAxial(passed, friction.same, friction.sameAxial, t), step->nodeFriction);
        right = next-matrixTimes(other, symmetricTimes(inverse, right));
    }
    Vector velocity = symmetricTimes(inverseOfMobile(diagonal, PROPERTY(MOBILE, last)), right);
    storeVector(step, CHANGE, last, velocity);
    for (int s = last-1; s >= 0; s--) {
        velocity = velocityBefore(step, s, velocity, zeroVector());
        storeVector(step, CHANGE, s, velocity);
    }
}
#else
/** The first node comes last, and all others are coupled to it. */
DEVICE void findVelocities(const Step* step) {
    const int count = step->segments;
    Symmetric diagonal = zeroSymmetric(), first = withDiagonal(zeroSymmetric(), step->nodeFriction);
    Vector right = draggedForce(step, 0), rightOfFirst = zeroVector();
    Matrix coupling = zeroMatrix();
    for (int s = 0; s < count; s++) {
        EndFriction friction = frictionOfEnds(step, s);
        Vector t = friction.tangent, next = draggedForce(step, s+1);
        addDrag(step, s, friction, &right, &next);
        Matrix other = axial(friction.other, friction.otherAxial, t), nextCoupling = zeroMatrix();
        Symmetric behind = withAxial(zeroSymmetric(), friction.same, friction.sameAxial, t);
        if (s == 0) {
            first = sumOfSymmetric(first, behind);
            rightOfFirst = right;
            nextCoupling = other;
        }
        else {
            diagonal = withAxial(diagonal, friction.same, friction.sameAxial, t);
            if (s == count-1) {
                coupling = sumOf(coupling, other);
                first = sumOfSymmetric(first, behind);
                rightOfFirst = rightOfFirst+next;
            }
            Symmetric inverse = inverseOfMobile(diagonal, PROPERTY(MOBILE, s));
            keepEliminated(step, s, inverse, right, friction);
            storeMatrix(step, BORDER, s, coupling);
            Matrix passed = symmetricTimesMatrix(inverse, coupling);
            Vector moved = symmetricTimes(inverse, right);
            first = lessTransposedProduct(first, coupling, passed);
            rightOfFirst = rightOfFirst-transposedTimes(coupling, moved);
            behind = lessTransposedProduct(behind, other, symmetricTimesMatrix(inverse, other));
            next = next-matrixTimes(other, moved);
            nextCoupling = scaled(matrixProduct(other, passed), -1);
        }
        diagonal = withDiagonal(behind, step->nodeFriction);
        right = next;
        coupling = nextCoupling;
    }
    Vector found = symmetricTimes(inverseOfMobile(first, PROPERTY(MOBILE, 0)), rightOfFirst), velocity = found;
    storeVector(step, CHANGE, 0, found);
    storeVector(step, CHANGE, count, found);
    for (int s = count-1; s > 0; s--) {
        Vector ofFirst = matrixTimes(loadMatrix(step, BORDER, s), found);
        velocity = velocityBefore(step, s, s == count-1 ? zeroVector() : velocity, ofFirst);
        storeVector(step, CHANGE, s, velocity);
    }
    storeVector(step, CHANGE, count+1, loadVector(step, CHANGE, 1));
}
#endif

/** Add the random forces, and for Euler's scheme the thermal torques. */
DEVICE void addRandomForces(const Step* step, bool isEuler) {
    double amplitude = sqrt(2*step->kT/step->h), thermal = isEuler ? step->kT : 0;
    for (int s = 0; s < step->own; s++) {
        if (step->nodeFriction > 0) {
            double4 n = drawNormals(step->key, NOISE_NODE, step->chain, s, 0);
            addVector(step, EXTERNAL, s, inSpace(make_double3(n.x, n.y, n.z))*(sqrt(step->nodeFriction)*amplitude));
        }
        if (s >= step->segments)
            continue;
        double4 n = drawNormals(step->key, NOISE_SEGMENT, step->chain, s, 0);
        double4 m = drawNormals(step->key, NOISE_SEGMENT, step->chain, s, 1);
        Vector difference = loadVector(step, NODE, s+1)-loadVector(step, NODE, s);
        double inverse = 1/sqrt(product(difference, difference));
        Vector t = difference*inverse, a = inSpace(make_double3(n.x, n.y, n.z));
        Vector b = inSpace(make_double3(n.w, m.x, m.y));
        double across = sqrt(PROPERTY(PERPENDICULAR, s)), along = sqrt(PROPERTY(PARALLEL, s));
        double turn = sqrt(PROPERTY(ROTATIONAL, s)), stretch = sqrt(PROPERTY(EXTENSIONAL, s));
        Vector force = (a*across+t*((along-across)*product(t, a)))*(0.5*amplitude);
        Vector pair = (b*turn+t*((stretch-turn)*product(t, b)))*(amplitude*inverse)+
                t*(thermal*PROPERTY(DRIFT, s)*inverse);
        addVector(step, EXTERNAL, s, force-pair);
        addVector(step, EXTERNAL, s+1, force+pair);
    }
}

/** Take a step; MOVED is how far nodes move. Returns whether no segment has changed too much. */
DEVICE bool takeExplicitStep(Step* step, GLOBAL const double* forces, bool isEuler) {
    Vector x = positionOf(step, 0);
    for (int node = 0; node < step->nodes; node++) {
        storeVector(step, NODE, node, x);
        Vector force = zeroVector();
        if (node < step->own)
            force = inSpace(make_double3(forces[3*node], forces[3*node+1], forces[3*node+2]));
        storeVector(step, EXTERNAL, node, force);
        if (node < step->nodes-1)
            x = x+vectorOfSegment(step, node);
    }
    if (step->kT > 0)
        addRandomForces(step, isEuler);
    for (int stage = 0; stage < (isEuler ? 1 : 2); stage++) {
        if (stage > 0)
            for (int node = 0; node < step->nodes; node++)
                addVector(step, NODE, node, loadVector(step, CHANGE, node)*(0.5*step->h));
        if (step->hasFlow)
            beginFlow(step, loadVector(step, NODE, 0));
        findVelocities(step);
    }
    bool stable = true;
    for (int s = 0; s < step->nodes; s++) {
        Vector velocity = loadVector(step, CHANGE, s);
        storeVector(step, MOVED, s, velocity*step->h);
        if (s >= step->segments)
            continue;
        Vector change = (loadVector(step, CHANGE, s+1)-velocity)*step->h;
        double rest = PROPERTY(REST_LENGTH, s);
        stable = stable && product(change, change) < rest*rest;
#ifdef STRETCHING_FENE
        Vector after = vectorOfSegment(step, s)+change;
        stable = stable && fabs((sqrt(product(after, after))-rest)*PROPERTY(INVERSE_EXTENSION, s)) < 1;
#endif
    }
    return stable;
}
#endif
