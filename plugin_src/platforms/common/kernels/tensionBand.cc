/**
 * The linear equations of the nodes of a chain and of the tensions of its segments, solved by elimination along the
 * chain: see dynamics/TensionBand-inl.h, whose names these are.
 */

/** The equations of a node while they are gathered: its own block, and those to the next node and the one after. */
typedef struct {
    Symmetric diagonal;
    Matrix upper, second;
    Vector right;
#ifdef CLOSED
    Matrix border[2];
#endif
} Row;

/** The equation of the tension before a node, while it is gathered: resistance T = right+first.y+last.y(+1). */
typedef struct {
    double resistance, right;
    Vector first, last;
#ifdef CLOSED
    Vector border[2];
#endif
} Link;

inline DEVICE Row emptyRow() {
    Row row;
    row.diagonal = zeroSymmetric();
    row.upper = row.second = zeroMatrix();
    row.right = zeroVector();
#ifdef CLOSED
    row.border[0] = row.border[1] = zeroMatrix();
#endif
    return row;
}

/** There is no tension before the first node. */
inline DEVICE Link firstLink() {
    Link link;
    link.resistance = 1;
    link.right = 0;
    link.first = link.last = zeroVector();
#ifdef CLOSED
    link.border[0] = link.border[1] = zeroVector();
#endif
    return link;
}

/**
 * Eliminate a node, with the tension before it, from the equations of the next ones.
 *
 * @param following   how many nodes follow, or 2 if there are more
 */
DEVICE void eliminatePair(const Step* step, int node, int following, const Row* row, Row* next, Row* second, Link* link) {
    Symmetric inverse = inverseOfMobile(row->diagonal, PROPERTY(MOBILE, node));
    Vector raised = symmetricTimes(inverse, link->first);
    double reciprocal = 1/(link->resistance+product(link->first, raised));
    Vector give = raised*reciprocal;
    inverse = withOuter(inverse, raised*-1.0, give);
    Vector solution = symmetricTimes(inverse, row->right)-give*link->right;
    double tension = link->right*reciprocal+product(give, row->right);
    storeSymmetric(step, INVERSE, node, inverse);
    storeVector(step, GIVE, node, give);
    FIELD(RECIPROCAL, node) = reciprocal;
    storeVector(step, SOLUTION, node, solution);
    FIELD(TENSION_FOUND, node) = tension;
    if (following == 0)
        return;
    Vector t = loadVector(step, NEW_TANGENT, node), lastBefore = link->last, pull = symmetricTimes(inverse, t);
    double compliance = FIELD(COMPLIANCE, node);
    Matrix toNext = sumOf(symmetricTimesMatrix(inverse, row->upper), outer(give, lastBefore));
    Vector first = lastBefore*reciprocal-transposedTimes(row->upper, give);
    storeVector(step, PULL, node, pull);
    FIELD(SHARE, node) = product(give, t);
    storeMatrix(step, NEXT, node, toNext);
    storeVector(step, FIRST, node, first);
    next->right = next->right-transposedTimes(row->upper, solution)-lastBefore*tension;
    next->diagonal = withOuter(lessTransposedProduct(next->diagonal, row->upper, toNext), lastBefore, first);
    link->resistance = compliance+product(t, pull);
    link->right = compliance*FIELD(TENSION_START, node)-product(t, solution);
    link->first = t+transposedTimes(toNext, t);
    Matrix toSecond = zeroMatrix();
    Vector last = zeroVector();
    link->last = zeroVector();
    if (following > 1) {
        toSecond = symmetricTimesMatrix(inverse, row->second);
        last = transposedTimes(row->second, give)*-1.0;
        link->last = transposedTimes(toSecond, t);
        next->upper = sumOf(differenceOf(next->upper, transposedProduct(row->upper, toSecond)), outer(lastBefore, last));
        second->diagonal = lessTransposedProduct(second->diagonal, row->second, toSecond);
        second->right = second->right-transposedTimes(row->second, solution);
    }
    storeMatrix(step, SECOND, node, toSecond);
    storeVector(step, LAST, node, last);
}

#ifdef CLOSED
/** Eliminate a node of a ring. The first two nodes come last, and all others are coupled to them. */
DEVICE void eliminateOfRing(const Step* step, int node, Row* row, Row* next, Row* second, Row* border, Link* link) {
    int n = step->own;
    if (node < 2) {
        border[node].diagonal = row->diagonal;
        border[node].right = row->right;
        second->border[node] = transposed(row->second);
        if (node == 0)
            border[0].upper = row->upper;
        else {
            next->border[1] = transposed(row->upper);
            link->resistance = FIELD(COMPLIANCE, 1);
            link->right = FIELD(COMPLIANCE, 1)*FIELD(TENSION_START, 1);
            link->first = loadVector(step, NEW_TANGENT, 1);
            link->last = link->border[0] = zeroVector();
            link->border[1] = link->first*-1.0;
        }
        return;
    }
    // The nodes behind the last one are the first two.
    if (node == n-2) {
        row->border[0] = sumOf(row->border[0], row->second);
        row->second = zeroMatrix();
    }
    if (node == n-1) {
        row->border[0] = sumOf(row->border[0], row->upper);
        row->border[1] = sumOf(row->border[1], row->second);
        row->upper = row->second = zeroMatrix();
        link->border[0] = link->border[0]+link->last;
        link->last = zeroVector();
    }
    Link before = *link;
    eliminatePair(step, node, 2, row, next, second, link);
    Symmetric inverse = loadSymmetric(step, INVERSE, node);
    Vector give = loadVector(step, GIVE, node), solution = loadVector(step, SOLUTION, node);
    Vector direction = loadVector(step, NEW_TANGENT, node), ofTension[2];
    double reciprocal = FIELD(RECIPROCAL, node), tension = FIELD(TENSION_FOUND, node);
    Matrix couplings[2];
    for (int k = 0; k < 2; k++) {
        Matrix coupling = sumOf(symmetricTimesMatrix(inverse, row->border[k]), outer(give, before.border[k]));
        couplings[k] = coupling;
        ofTension[k] = before.border[k]*reciprocal-transposedTimes(row->border[k], give);
        storeMatrix(step, BORDER+9*k, node, coupling);
        storeVector(step, TENSION_BORDER+3*k, node, ofTension[k]);
        next->border[k] = sumOf(differenceOf(next->border[k], transposedProduct(row->upper, coupling)),
                outer(before.last, ofTension[k]));
        second->border[k] = differenceOf(second->border[k], transposedProduct(row->second, coupling));
        border[k].diagonal = withOuter(lessTransposedProduct(border[k].diagonal, row->border[k], coupling),
                before.border[k], ofTension[k]);
        border[k].right = border[k].right-transposedTimes(row->border[k], solution)-before.border[k]*tension;
        link->border[k] = transposedTimes(coupling, direction);
    }
    border[0].upper = sumOf(differenceOf(border[0].upper, transposedProduct(row->border[0], couplings[1])),
            outer(before.border[0], ofTension[1]));
}

/** Eliminate the first two nodes of a ring, whose rows have been begun a second time behind the last node. */
DEVICE void closeRing(const Step* step, const Row* first, const Row* second, Row* border, Link* link) {
    border[0].diagonal = sumOfSymmetric(border[0].diagonal, first->diagonal);
    border[0].upper = sumOf(border[0].upper, first->upper);
    border[0].right = border[0].right+first->right;
    border[1].diagonal = sumOfSymmetric(border[1].diagonal, second->diagonal);
    border[1].right = border[1].right+second->right;
    link->first = link->first+link->border[0];
    link->last = link->border[1];
    Row none = emptyRow();
    for (int node = 0; node < 2; node++)
        eliminatePair(step, node, 1-node, &border[node], &border[1], &none, link);
}
#endif

/** Keep the tension of a segment, and what the next iteration needs of it, once its nodes have been found. */
inline DEVICE void keepTension(const Step* step, int s) {
    Vector change = loadVector(step, CHANGE, s+1)-loadVector(step, CHANGE, s);
    FIELD(MULTIPLIER, s) = FIELD(TENSION, s)+FIELD(SHIFT, s)*product(loadVector(step, NEW_TANGENT, s), change);
}

/** Find the changes of nodes and the tensions, or add to them. */
DEVICE void substitute(const Step* step, bool adds) {
    const int n = step->own;
    Vector next = zeroVector(), second = zeroVector();
    double tension = 0;
#ifdef CLOSED
    Vector found1 = loadVector(step, SOLUTION, 1);
    double tension0 = FIELD(TENSION_FOUND, 1);
    Vector found0 = loadVector(step, SOLUTION, 0)-matrixTimes(loadMatrix(step, NEXT, 0), found1)+
            loadVector(step, PULL, 0)*tension0;
    tension = FIELD(TENSION_FOUND, 0)+product(loadVector(step, FIRST, 0), found1)+FIELD(SHARE, 0)*tension0;
    FIELD(TENSION, 0) = tension0+(adds ? FIELD(TENSION, 0) : 0);
    FIELD(TENSION, n-1) = tension+(adds ? FIELD(TENSION, n-1) : 0);
    Vector change0 = adds ? loadVector(step, CHANGE, 0)+found0 : found0;
    Vector change1 = adds ? loadVector(step, CHANGE, 1)+found1 : found1;
    storeVector(step, CHANGE, 0, change0);
    storeVector(step, CHANGE, 1, change1);
    storeVector(step, CHANGE, n, change0);
    storeVector(step, CHANGE, n+1, change1);
    const int firstNode = 2;
#else
    const int firstNode = 0;
#endif
    for (int node = n-1; node >= firstNode; node--) {
        Vector here = loadVector(step, SOLUTION, node);
        double found = FIELD(TENSION_FOUND, node);
#ifndef CLOSED
        if (node < n-1)
#endif
        {
            here = here-matrixTimes(loadMatrix(step, NEXT, node), next)-
                    matrixTimes(loadMatrix(step, SECOND, node), second)+loadVector(step, PULL, node)*tension;
            found += product(loadVector(step, FIRST, node), next)+product(loadVector(step, LAST, node), second)+
                    FIELD(SHARE, node)*tension;
        }
#ifdef CLOSED
        here = here-matrixTimes(loadMatrix(step, BORDER, node), found0)-
                matrixTimes(loadMatrix(step, BORDER+9, node), found1);
        found += product(loadVector(step, TENSION_BORDER, node), found0)+
                product(loadVector(step, TENSION_BORDER+3, node), found1);
#endif
        storeVector(step, CHANGE, node, adds ? loadVector(step, CHANGE, node)+here : here);
        if (node > 0)
            FIELD(TENSION, node-1) = found+(adds ? FIELD(TENSION, node-1) : 0);
        tension = found;
        second = next;
        next = here;
    }
    for (int s = 0; s < step->segments; s++)
        keepTension(step, s);
}

/** What the last iteration's tensions lack of acting along the mean direction, as a force on a segment's first node. */
inline DEVICE Vector forceOfTurning(const Step* step, int s) {
    return loadVector(step, TURNED, s)*(FIELD(MULTIPLIER, s)-FIELD(MULTIPLIER_BEFORE, s));
}

/** Let the change of tensions act along the mean direction as well, with the same elimination. */
DEVICE void refine(const Step* step) {
    const int n = step->own;
    Vector here = zeroVector(), next = zeroVector(), forceBefore = zeroVector();
    double start = 0;
#ifdef CLOSED
    Vector force0 = forceOfTurning(step, 0), force1 = forceOfTurning(step, 1), ofBorder[2];
    ofBorder[0] = force0-forceOfTurning(step, n-1);
    ofBorder[1] = force1-force0;
    forceBefore = force1;
    const int firstNode = 2;
#else
    const int firstNode = 0;
#endif
    for (int node = firstNode; node < n; node++) {
        Vector right = here-forceBefore, give = loadVector(step, GIVE, node);
        if (node < step->segments) {
            forceBefore = forceOfTurning(step, node);
            right = right+forceBefore;
        }
        Vector solution = symmetricTimes(loadSymmetric(step, INVERSE, node), right)-give*start;
        storeVector(step, SOLUTION, node, solution);
        FIELD(TENSION_FOUND, node) = FIELD(RECIPROCAL, node)*start+product(give, right);
#ifdef CLOSED
        for (int k = 0; k < 2; k++)
            ofBorder[k] = ofBorder[k]-transposedTimes(loadMatrix(step, BORDER+9*k, node), right)-
                    loadVector(step, TENSION_BORDER+3*k, node)*start;
#else
        if (node == n-1)
            break;
#endif
        here = next-transposedTimes(loadMatrix(step, NEXT, node), right)-loadVector(step, FIRST, node)*start;
        next = (transposedTimes(loadMatrix(step, SECOND, node), right)+loadVector(step, LAST, node)*start)*-1.0;
        start = -product(loadVector(step, NEW_TANGENT, node), solution);
    }
#ifdef CLOSED
    for (int node = 0; node < 2; node++) {
        Vector right = ofBorder[node], give = loadVector(step, GIVE, node);
        Vector solution = symmetricTimes(loadSymmetric(step, INVERSE, node), right)-give*start;
        storeVector(step, SOLUTION, node, solution);
        FIELD(TENSION_FOUND, node) = FIELD(RECIPROCAL, node)*start+product(give, right);
        if (node == 0)
            ofBorder[1] = ofBorder[1]-transposedTimes(loadMatrix(step, NEXT, 0), right)-
                    loadVector(step, FIRST, 0)*start;
        start = -product(loadVector(step, NEW_TANGENT, node), solution);
    }
#endif
    substitute(step, true);
}
