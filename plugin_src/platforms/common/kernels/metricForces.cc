/**
 * The metric forces of lengths, which take blocks of the inverse of the equations, from the last node that was
 * eliminated to the first: see dynamics/TensionResponses-inl.h, whose names these are.
 */

/**
 * Of the next two nodes: their blocks of the inverse, and what a unit of compliance times start of the tension behind
 * the node moves them by, and changes that tension by. In a ring, the same for the first two nodes: their own blocks,
 * and those of the next two nodes with them.
 */
typedef struct {
    Symmetric same, sameAfter;
    Matrix other;
    Vector after, afterNext;
    double own;
#ifdef CLOSED
    Matrix borders[2][2], next[2], second[2];
    Vector ofBorder[2];
#endif
} Responses;

/** What a unit of compliance times start of the tension behind a node moves it by. */
inline DEVICE Vector responseOf(const Step* step, int node, const Responses* responses) {
    Vector here = loadVector(step, PULL, node)*responses->own-
            matrixTimes(loadMatrix(step, NEXT, node), responses->after)-
            matrixTimes(loadMatrix(step, SECOND, node), responses->afterNext);
#ifdef CLOSED
    for (int k = 0; k < 2; k++)
        here = here-matrixTimes(loadMatrix(step, BORDER+9*k, node), responses->ofBorder[k]);
#endif
    return here;
}

/** Go on to the node before, given what responseOf() has found. */
inline DEVICE void passResponses(const Step* step, int node, Vector here, Responses* responses) {
    Matrix next = loadMatrix(step, NEXT, node), second = loadMatrix(step, SECOND, node);
    Vector pull = loadVector(step, PULL, node), first = loadVector(step, FIRST, node);
    Vector last = loadVector(step, LAST, node), after = responses->after, afterNext = responses->afterNext;
    Symmetric same = responses->same, sameAfter = responses->sameAfter;
    Matrix other = responses->other;
    double share = FIELD(SHARE, node), own = responses->own;

    // The node's own block, and those with the next two.
    Matrix newOther = sumOf(sumOf(matrixProduct(next, fullMatrix(same)),
            matrixProduct(second, transposed(other))), outer(pull, after));
    Matrix newSecond = sumOf(sumOf(matrixProduct(next, other), matrixProduct(second, fullMatrix(sameAfter))),
            outer(pull, afterNext));
#ifdef CLOSED
    Matrix border[2], newBorder[2];
    for (int k = 0; k < 2; k++)
        border[k] = loadMatrix(step, BORDER+9*k, node);
    for (int k = 0; k < 2; k++) {
        newOther = sumOf(newOther, matrixProduct(border[k], transposed(responses->next[k])));
        newSecond = sumOf(newSecond, matrixProduct(border[k], transposed(responses->second[k])));
        newBorder[k] = scaled(sumOf(sumOf(sumOf(matrixProduct(next, responses->next[k]),
                matrixProduct(second, responses->second[k])), sumOf(matrixProduct(border[0], responses->borders[0][k]),
                matrixProduct(border[1], responses->borders[1][k]))), outer(pull, responses->ofBorder[k])), -1);
    }
#endif
    newOther = scaled(newOther, -1);
    Symmetric newSame = lessProductTransposed(loadSymmetric(step, INVERSE, node), next, newOther);
    newSame = lessProductTransposed(newSame, second, scaled(newSecond, -1));
    newSame = withOuter(newSame, pull*-1.0, here);

    // The same for the tension before the node.
    double mutual = product(first, after)+product(last, afterNext)+share*own;
    Vector newAfterNext = after*share-symmetricTimes(same, first)-matrixTimes(other, last);
    Vector beyond = afterNext*share-transposedTimes(other, first)-symmetricTimes(sameAfter, last);
#ifdef CLOSED
    Vector newOfBorder[2], tensionBorder[2];
    for (int k = 0; k < 2; k++)
        tensionBorder[k] = loadVector(step, TENSION_BORDER+3*k, node);
    for (int k = 0; k < 2; k++) {
        newSame = lessProductTransposed(newSame, border[k], newBorder[k]);
        mutual += product(tensionBorder[k], responses->ofBorder[k]);
        newAfterNext = newAfterNext-matrixTimes(responses->next[k], tensionBorder[k]);
        beyond = beyond-matrixTimes(responses->second[k], tensionBorder[k]);
        newOfBorder[k] = responses->ofBorder[k]*share-transposedTimes(responses->next[k], first)-
                transposedTimes(responses->second[k], last)-matrixTimes(responses->borders[k][0], tensionBorder[0])-
                matrixTimes(responses->borders[k][1], tensionBorder[1]);
    }
#endif
    after = pull*mutual-loadVector(step, GIVE, node)-matrixTimes(next, newAfterNext)-matrixTimes(second, beyond);
    own = FIELD(RECIPROCAL, node)+product(first, newAfterNext)+product(last, beyond)+share*mutual;
#ifdef CLOSED
    for (int k = 0; k < 2; k++) {
        after = after-matrixTimes(border[k], newOfBorder[k]);
        own += product(tensionBorder[k], newOfBorder[k]);
        responses->ofBorder[k] = newOfBorder[k];
        responses->second[k] = responses->next[k];
        responses->next[k] = newBorder[k];
    }
#endif
    responses->after = after;
    responses->own = own;
    responses->afterNext = newAfterNext;
    responses->sameAfter = same;
    responses->same = newSame;
    responses->other = newOther;
}

/** Add the metric force of a length, given how far a unit force along its segment moves its ends apart. */
inline DEVICE void addMetricForce(const Step* step, int s, Vector response) {
    Vector t = tangentAtStart(step, s);
    double stiffness = PROPERTY(STIFFNESS, s), perLength = FIELD(INVERSE_LENGTH, s), theta = FIELD(THETA, s);
    double noise = stiffness*(2*theta-1)+PROPERTY(EXTENSIONAL, s)*perLength*perLength/step->h;
    double along = product(t, response);
    // The length resists more in the second stage than in this one.
    if (step->twoStages)
        noise = noise/(1+stiffness*(theta-DIAGONAL)*along);
    Vector force = (response-t*along)*(step->kT*noise*perLength);
    addVector(step, METRIC, s, force);
    addVector(step, METRIC, s+1, force*-1.0);
}
