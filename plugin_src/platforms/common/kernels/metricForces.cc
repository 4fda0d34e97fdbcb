/**
 * The metric forces of lengths, which take blocks of the inverse of the equations: see dynamics/TensionResponses-inl.h,
 * whose names these are.
 */

inline DEVICE void addMetricForce(const Step* step, int s, Vector response);

#ifndef CLOSED
DEVICE void addMetricForces(const Step* step) {
    const int n = step->own;
    Symmetric same = loadSymmetric(step, INVERSE, n-1), sameAfter = zeroSymmetric();
    Matrix other = zeroMatrix();
    Vector after = loadVector(step, GIVE, n-1)*-1.0, afterNext = zeroVector();
    double own = FIELD(RECIPROCAL, n-1);
    for (int s = n-2; s >= 0; s--) {
        Matrix next = loadMatrix(step, NEXT, s), second = loadMatrix(step, SECOND, s);
        Vector pull = loadVector(step, PULL, s), first = loadVector(step, FIRST, s), last = loadVector(step, LAST, s);
        double share = FIELD(SHARE, s);
        Vector here = pull*own-matrixTimes(next, after)-matrixTimes(second, afterNext);
        addMetricForce(step, s, (here-after)*FIELD(COMPLIANCE, s));

        // The node's own block, and those with the next two.
        Matrix newOther = sumOf(sumOf(matrixProduct(next, fullMatrix(same)),
                matrixProduct(second, transposed(other))), outer(pull, after));
        Matrix newSecond = sumOf(sumOf(matrixProduct(next, other), matrixProduct(second, fullMatrix(sameAfter))),
                outer(pull, afterNext));
        newOther = scaled(newOther, -1);
        Symmetric newSame = lessProductTransposed(loadSymmetric(step, INVERSE, s), next, newOther);
        newSame = lessProductTransposed(newSame, second, scaled(newSecond, -1));
        newSame = withOuter(newSame, pull*-1.0, here);

        // The same for the tension before the node.
        double mutual = product(first, after)+product(last, afterNext)+share*own;
        Vector newAfterNext = after*share-symmetricTimes(same, first)-matrixTimes(other, last);
        Vector beyond = afterNext*share-transposedTimes(other, first)-symmetricTimes(sameAfter, last);
        after = pull*mutual-loadVector(step, GIVE, s)-matrixTimes(next, newAfterNext)-matrixTimes(second, beyond);
        own = FIELD(RECIPROCAL, s)+product(first, newAfterNext)+product(last, beyond)+share*mutual;
        afterNext = newAfterNext;
        sameAfter = same;
        same = newSame;
        other = newOther;
    }
}
#else
DEVICE void addMetricForces(const Step* step) {
    const int n = step->own;
    Symmetric same = zeroSymmetric(), sameAfter = zeroSymmetric();
    Matrix other = zeroMatrix();
    Vector after = zeroVector(), afterNext = zeroVector();
    // For the first two nodes: their own blocks, those of the next two nodes with them, and those of tensions.
    Matrix borders[2][2], next[2], second[2];
    Vector ofBorder[2];
    next[0] = next[1] = second[0] = second[1] = zeroMatrix();
    Symmetric last = loadSymmetric(step, INVERSE, 1);
    Matrix toNext = loadMatrix(step, NEXT, 0);
    Vector after1 = loadVector(step, GIVE, 1)*-1.0, pull = loadVector(step, PULL, 0);
    Vector first = loadVector(step, FIRST, 0);
    double share = FIELD(SHARE, 0), reciprocal1 = FIELD(RECIPROCAL, 1);
    Vector here = pull*reciprocal1-matrixTimes(toNext, after1);
    addMetricForce(step, 0, (here-after1)*FIELD(COMPLIANCE, 0));
    borders[1][1] = fullMatrix(last);
    borders[0][1] = scaled(sumOf(matrixProduct(toNext, borders[1][1]), outer(pull, after1)), -1);
    borders[1][0] = transposed(borders[0][1]);
    borders[0][0] = fullMatrix(withOuter(lessProductTransposed(loadSymmetric(step, INVERSE, 0), toNext,
            borders[0][1]), pull*-1.0, here));
    double mutual = product(first, after1)+share*reciprocal1;
    ofBorder[1] = after1*share-symmetricTimes(last, first);
    ofBorder[0] = pull*mutual-loadVector(step, GIVE, 0)-matrixTimes(toNext, ofBorder[1]);
    double own = FIELD(RECIPROCAL, 0)+product(first, ofBorder[1])+share*mutual;
    for (int s = n-1; s >= 2; s--) {
        Matrix toSecond = loadMatrix(step, SECOND, s), border[2], newBorder[2];
        Vector behind = loadVector(step, LAST, s), tensionBorder[2], newOfBorder[2];
        toNext = loadMatrix(step, NEXT, s);
        pull = loadVector(step, PULL, s);
        first = loadVector(step, FIRST, s);
        share = FIELD(SHARE, s);
        for (int k = 0; k < 2; k++) {
            border[k] = loadMatrix(step, BORDER+9*k, s);
            tensionBorder[k] = loadVector(step, TENSION_BORDER+3*k, s);
        }
        here = pull*own-matrixTimes(toNext, after)-matrixTimes(toSecond, afterNext)-
                matrixTimes(border[0], ofBorder[0])-matrixTimes(border[1], ofBorder[1]);
        addMetricForce(step, s, (here-(s == n-1 ? ofBorder[0] : after))*FIELD(COMPLIANCE, s));
        Matrix newOther = sumOf(sumOf(matrixProduct(toNext, fullMatrix(same)),
                matrixProduct(toSecond, transposed(other))), outer(pull, after));
        Matrix newSecond = sumOf(sumOf(matrixProduct(toNext, other),
                matrixProduct(toSecond, fullMatrix(sameAfter))), outer(pull, afterNext));
        for (int k = 0; k < 2; k++) {
            newOther = sumOf(newOther, matrixProduct(border[k], transposed(next[k])));
            newSecond = sumOf(newSecond, matrixProduct(border[k], transposed(second[k])));
            newBorder[k] = scaled(sumOf(sumOf(sumOf(matrixProduct(toNext, next[k]),
                    matrixProduct(toSecond, second[k])), sumOf(matrixProduct(border[0], borders[0][k]),
                    matrixProduct(border[1], borders[1][k]))), outer(pull, ofBorder[k])), -1);
        }
        newOther = scaled(newOther, -1);
        Symmetric newSame = lessProductTransposed(loadSymmetric(step, INVERSE, s), toNext, newOther);
        newSame = lessProductTransposed(newSame, toSecond, scaled(newSecond, -1));
        newSame = withOuter(newSame, pull*-1.0, here);
        mutual = product(first, after)+product(behind, afterNext)+share*own;
        Vector newAfterNext = after*share-symmetricTimes(same, first)-matrixTimes(other, behind);
        Vector beyond = afterNext*share-transposedTimes(other, first)-symmetricTimes(sameAfter, behind);
        for (int k = 0; k < 2; k++) {
            newSame = lessProductTransposed(newSame, border[k], newBorder[k]);
            mutual += product(tensionBorder[k], ofBorder[k]);
            newAfterNext = newAfterNext-matrixTimes(next[k], tensionBorder[k]);
            beyond = beyond-matrixTimes(second[k], tensionBorder[k]);
            newOfBorder[k] = ofBorder[k]*share-transposedTimes(next[k], first)-transposedTimes(second[k], behind)-
                    matrixTimes(borders[k][0], tensionBorder[0])-matrixTimes(borders[k][1], tensionBorder[1]);
        }
        after = pull*mutual-loadVector(step, GIVE, s)-matrixTimes(toNext, newAfterNext)-
                matrixTimes(toSecond, beyond)-matrixTimes(border[0], newOfBorder[0])-
                matrixTimes(border[1], newOfBorder[1]);
        own = FIELD(RECIPROCAL, s)+product(first, newAfterNext)+product(behind, beyond)+share*mutual+
                product(tensionBorder[0], newOfBorder[0])+product(tensionBorder[1], newOfBorder[1]);
        for (int k = 0; k < 2; k++) {
            ofBorder[k] = newOfBorder[k];
            second[k] = next[k];
            next[k] = newBorder[k];
        }
        afterNext = newAfterNext;
        sameAfter = same;
        same = newSame;
        other = newOther;
    }
    addMetricForce(step, 1, (ofBorder[1]-after)*FIELD(COMPLIANCE, 1));
}
#endif
