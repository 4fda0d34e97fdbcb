/**
 * The equations of a chain, set up and solved by one work-item, from the first node to the last.
 */

#ifndef CHAIN_BY_GROUP
inline DEVICE TensionEquation tensionBehind(const Step* step, int node) {
    TensionEquation result = {loadVector(step, NEW_TANGENT, node), FIELD(COMPLIANCE, node), FIELD(TENSION_START, node)};
    return result;
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
    TensionEquation behind = tensionBehind(step, node);
    eliminatePair(step, node, 2, behind, row, next, second, link);
    eliminateFromBorder(step, node, behind.direction, row, next, second, border, &before, link);
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
        eliminatePair(step, node, 1-node, tensionBehind(step, node), &border[node], &border[1], &none, link);
}
#endif

/** Linearise the equations around the nodes, and eliminate these from first to last. */
DEVICE void eliminate(const Step* step, bool compressed) {
    const int n = step->nodes;
    Row before = emptyRow(), here = emptyRow(), after = emptyRow();
    Geometry previous, current;
    Link link = firstLink();
#ifdef CLOSED
    Row border[2];
    border[0] = border[1] = emptyRow();
#endif
    here.right = forcesOn(step, 0);
    for (int s = 0; s < n; s++) {
        if (s < n-1) {
            after = emptyRow();
            current = newGeometry(step, s);
            // The last segment of a ring that is unrolled is there for its joint alone.
            if (s < step->segments)
                addSegment(step, s, &current, compressed, &here, &after);
            else
                after.right = forcesOn(step, s+1);
        }
        if (s < step->own)
            addNode(step, s, &here);
        if (s > 0) {
            if (s < n-1)
                addBend(step, s, &previous, &current, &before, &here, &after);
#ifdef CLOSED
            if (s < n-1)
                eliminateOfRing(step, s-1, &before, &here, &after, border, &link);
#else
            eliminatePair(step, s-1, s < n-1 ? 2 : 1, tensionBehind(step, s-1), &before, &here, &after, &link);
#endif
        }
        if (s < n-1) {
            previous = current;
            before = here;
            here = after;
        }
    }
#ifdef CLOSED
    closeRing(step, &before, &here, border, &link);
#else
    eliminatePair(step, n-1, 0, tensionBehind(step, n-1), &here, &here, &here, &link);
#endif
}

/** Find the changes of nodes and the tensions, or add to them, if wanted. */
DEVICE void substitute(const Step* step, bool adds, bool wanted) {
    if (!wanted)
        return;
    const int n = step->own;
    Found found;
    found.next = found.second = zeroVector();
    found.tension = 0;
#ifdef CLOSED
    Vector found1 = loadVector(step, SOLUTION, 1);
    double tension0 = FIELD(TENSION_FOUND, 1);
    Vector found0 = loadVector(step, SOLUTION, 0)-matrixTimes(loadMatrix(step, NEXT, 0), found1)+
            loadVector(step, PULL, 0)*tension0;
    double tension = FIELD(TENSION_FOUND, 0)+product(loadVector(step, FIRST, 0), found1)+FIELD(SHARE, 0)*tension0;
    storeField(step, TENSION, 0, tension0+(adds ? FIELD(TENSION, 0) : 0));
    storeField(step, TENSION, n-1, tension+(adds ? FIELD(TENSION, n-1) : 0));
    Vector change0 = adds ? loadVector(step, CHANGE, 0)+found0 : found0;
    Vector change1 = adds ? loadVector(step, CHANGE, 1)+found1 : found1;
    storeVector(step, CHANGE, 0, change0);
    storeVector(step, CHANGE, 1, change1);
    storeVector(step, CHANGE, n, change0);
    storeVector(step, CHANGE, n+1, change1);
    found.border[0] = found0;
    found.border[1] = found1;
    found.tension = tension;
    for (int node = n-1; node >= 2; node--)
        substitutePair(step, node, true, node-1, adds, &found);
#else
    for (int node = n-1; node >= 0; node--)
        substitutePair(step, node, node < n-1, node-1, adds, &found);
#endif
    for (int s = 0; s < step->segments; s++)
        keepTension(step, s);
}

/** Let the change of tensions act along the mean direction as well, with the same elimination, if wanted. */
DEVICE void refine(const Step* step, bool wanted) {
    if (!wanted)
        return;
    const int n = step->own;
    RightSides sides;
    sides.here = sides.next = zeroVector();
    sides.start = 0;
    Vector forceBefore = zeroVector();
#ifdef CLOSED
    Vector force0 = forceOfTurning(step, 0), force1 = forceOfTurning(step, 1);
    sides.border[0] = force0-forceOfTurning(step, n-1);
    sides.border[1] = force1-force0;
    forceBefore = force1;
    const int firstNode = 2;
#else
    const int firstNode = 0;
#endif
    for (int node = firstNode; node < n; node++) {
        Vector own = forceBefore*-1.0;
        if (node < step->segments) {
            forceBefore = forceOfTurning(step, node);
            own = own+forceBefore;
        }
#ifndef CLOSED
        if (node == n-1) {
            // No other node is behind it.
            Vector right = sides.here+own, give = loadVector(step, GIVE, node);
            storeVector(step, SOLUTION, node, symmetricTimes(loadSymmetric(step, INVERSE, node), right)-
                    give*sides.start);
            storeField(step, TENSION_FOUND, node, FIELD(RECIPROCAL, node)*sides.start+product(give, right));
            break;
        }
#endif
        setRightSide(step, node, own, loadVector(step, NEW_TANGENT, node), &sides);
    }
#ifdef CLOSED
    double start = sides.start;
    for (int node = 0; node < 2; node++) {
        Vector right = sides.border[node], give = loadVector(step, GIVE, node);
        Vector solution = symmetricTimes(loadSymmetric(step, INVERSE, node), right)-give*start;
        storeVector(step, SOLUTION, node, solution);
        storeField(step, TENSION_FOUND, node, FIELD(RECIPROCAL, node)*start+product(give, right));
        if (node == 0)
            sides.border[1] = sides.border[1]-transposedTimes(loadMatrix(step, NEXT, 0), right)-
                    loadVector(step, FIRST, 0)*start;
        start = -product(loadVector(step, NEW_TANGENT, node), solution);
    }
#endif
    substitute(step, true, true);
}

/** Add the metric forces of lengths, if wanted. */
#ifndef CLOSED
DEVICE void addMetricForces(const Step* step, bool wanted) {
    if (!wanted)
        return;
    const int n = step->own;
    Responses responses;
    responses.same = loadSymmetric(step, INVERSE, n-1);
    responses.sameAfter = zeroSymmetric();
    responses.other = zeroMatrix();
    responses.after = loadVector(step, GIVE, n-1)*-1.0;
    responses.afterNext = zeroVector();
    responses.own = FIELD(RECIPROCAL, n-1);
    for (int s = n-2; s >= 0; s--) {
        Vector here = responseOf(step, s, &responses);
        addMetricForce(step, s, (here-responses.after)*FIELD(COMPLIANCE, s));
        passResponses(step, s, here, &responses);
    }
}
#else
DEVICE void addMetricForces(const Step* step, bool wanted) {
    if (!wanted)
        return;
    const int n = step->own;
    Responses responses;
    responses.same = responses.sameAfter = zeroSymmetric();
    responses.other = zeroMatrix();
    responses.after = responses.afterNext = zeroVector();
    for (int k = 0; k < 2; k++)
        responses.next[k] = responses.second[k] = zeroMatrix();
    // Of the first two nodes, which were eliminated last.
    Symmetric last = loadSymmetric(step, INVERSE, 1);
    Matrix toNext = loadMatrix(step, NEXT, 0);
    Vector after1 = loadVector(step, GIVE, 1)*-1.0, pull = loadVector(step, PULL, 0);
    Vector first = loadVector(step, FIRST, 0);
    double share = FIELD(SHARE, 0), reciprocal1 = FIELD(RECIPROCAL, 1);
    Vector here = pull*reciprocal1-matrixTimes(toNext, after1);
    addMetricForce(step, 0, (here-after1)*FIELD(COMPLIANCE, 0));
    responses.borders[1][1] = fullMatrix(last);
    responses.borders[0][1] = scaled(sumOf(matrixProduct(toNext, responses.borders[1][1]), outer(pull, after1)), -1);
    responses.borders[1][0] = transposed(responses.borders[0][1]);
    responses.borders[0][0] = fullMatrix(withOuter(lessProductTransposed(loadSymmetric(step, INVERSE, 0), toNext,
            responses.borders[0][1]), pull*-1.0, here));
    double mutual = product(first, after1)+share*reciprocal1;
    responses.ofBorder[1] = after1*share-symmetricTimes(last, first);
    responses.ofBorder[0] = pull*mutual-loadVector(step, GIVE, 0)-matrixTimes(toNext, responses.ofBorder[1]);
    responses.own = FIELD(RECIPROCAL, 0)+product(first, responses.ofBorder[1])+share*mutual;
    for (int s = n-1; s >= 2; s--) {
        here = responseOf(step, s, &responses);
        addMetricForce(step, s, (here-(s == n-1 ? responses.ofBorder[0] : responses.after))*FIELD(COMPLIANCE, s));
        passResponses(step, s, here, &responses);
    }
    addMetricForce(step, 1, (responses.ofBorder[1]-responses.after)*FIELD(COMPLIANCE, 1));
}
#endif
#endif
