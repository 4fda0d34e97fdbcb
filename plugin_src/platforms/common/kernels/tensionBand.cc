/**
 * The linear equations of the nodes of a chain and of the tensions of its segments, solved by elimination along the
 * chain: what it does at a node. See dynamics/TensionBand-inl.h, whose names these are.
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

/** The equation of the tension of the segment behind a node, with its direction from the node. */
typedef struct {
    Vector direction;
    double compliance, start;
} TensionEquation;

/** What is found of the two nodes behind one, and of the tension between; of rings, of the first two nodes, too. */
typedef struct {
    Vector next, second;
    double tension;
#ifdef CLOSED
    Vector border[2];
#endif
} Found;

/** Right sides of a node, of the one behind it and of the tension before it, while they are gathered. */
typedef struct {
    Vector here, next;
    double start;
#ifdef CLOSED
    Vector border[2];
#endif
} RightSides;

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
DEVICE void eliminatePair(const Step* step, int node, int following, TensionEquation behind, const Row* row, Row* next,
        Row* second, Link* link) {
    Symmetric inverse = inverseOfMobile(row->diagonal, PROPERTY(MOBILE, node));
    Vector raised = symmetricTimes(inverse, link->first);
    double reciprocal = 1/(link->resistance+product(link->first, raised));
    Vector give = raised*reciprocal;
    inverse = withOuter(inverse, raised*-1.0, give);
    Vector solution = symmetricTimes(inverse, row->right)-give*link->right;
    double tension = link->right*reciprocal+product(give, row->right);
    storeSymmetric(step, INVERSE, node, inverse);
    storeVector(step, GIVE, node, give);
    storeField(step, RECIPROCAL, node, reciprocal);
    storeVector(step, SOLUTION, node, solution);
    storeField(step, TENSION_FOUND, node, tension);
    if (following == 0)
        return;
    Vector t = behind.direction, lastBefore = link->last, pull = symmetricTimes(inverse, t);
    Matrix toNext = sumOf(symmetricTimesMatrix(inverse, row->upper), outer(give, lastBefore));
    Vector first = lastBefore*reciprocal-transposedTimes(row->upper, give);
    storeVector(step, PULL, node, pull);
    storeField(step, SHARE, node, product(give, t));
    storeMatrix(step, NEXT, node, toNext);
    storeVector(step, FIRST, node, first);
    next->right = next->right-transposedTimes(row->upper, solution)-lastBefore*tension;
    next->diagonal = withOuter(lessTransposedProduct(next->diagonal, row->upper, toNext), lastBefore, first);
    link->resistance = behind.compliance+product(t, pull);
    link->right = behind.compliance*behind.start-product(t, solution);
    link->first = t+transposedTimes(toNext, t);
    Matrix toSecond = zeroMatrix();
    Vector last = zeroVector();
    link->last = zeroVector();
    if (following > 1) {
        toSecond = symmetricTimesMatrix(inverse, row->second);
        last = transposedTimes(row->second, give)*-1.0;
        link->last = transposedTimes(toSecond, t);
        next->upper = sumOf(differenceOf(next->upper, transposedProduct(row->upper, toSecond)),
                outer(lastBefore, last));
        second->diagonal = lessTransposedProduct(second->diagonal, row->second, toSecond);
        second->right = second->right-transposedTimes(row->second, solution);
    }
    storeMatrix(step, SECOND, node, toSecond);
    storeVector(step, LAST, node, last);
}

#ifdef CLOSED
/** Pass on what couples a node of a ring, which has just been eliminated, to the first two nodes. */
inline DEVICE void eliminateFromBorder(const Step* step, int node, Vector direction, const Row* row, Row* next,
        Row* second, Row* border, const Link* before, Link* link) {
    Symmetric inverse = loadSymmetric(step, INVERSE, node);
    Vector give = loadVector(step, GIVE, node), solution = loadVector(step, SOLUTION, node);
    Vector ofTension[2];
    double reciprocal = FIELD(RECIPROCAL, node), tension = FIELD(TENSION_FOUND, node);
    Matrix couplings[2];
    for (int k = 0; k < 2; k++) {
        Matrix coupling = sumOf(symmetricTimesMatrix(inverse, row->border[k]), outer(give, before->border[k]));
        couplings[k] = coupling;
        ofTension[k] = before->border[k]*reciprocal-transposedTimes(row->border[k], give);
        storeMatrix(step, BORDER+9*k, node, coupling);
        storeVector(step, TENSION_BORDER+3*k, node, ofTension[k]);
        next->border[k] = sumOf(differenceOf(next->border[k], transposedProduct(row->upper, coupling)),
                outer(before->last, ofTension[k]));
        second->border[k] = differenceOf(second->border[k], transposedProduct(row->second, coupling));
        border[k].diagonal = withOuter(lessTransposedProduct(border[k].diagonal, row->border[k], coupling),
                before->border[k], ofTension[k]);
        border[k].right = border[k].right-transposedTimes(row->border[k], solution)-before->border[k]*tension;
        link->border[k] = transposedTimes(coupling, direction);
    }
    border[0].upper = sumOf(differenceOf(border[0].upper, transposedProduct(row->border[0], couplings[1])),
            outer(before->border[0], ofTension[1]));
}
#endif

/** Keep the tension of a segment, and what the next iteration needs of it, once its nodes have been found. */
inline DEVICE void keepTension(const Step* step, int s) {
    Vector change = loadVector(step, CHANGE, s+1)-loadVector(step, CHANGE, s);
    storeField(step, MULTIPLIER, s,
            FIELD(TENSION, s)+FIELD(SHIFT, s)*product(loadVector(step, NEW_TANGENT, s), change));
}

/** What the last iteration's tensions lack of acting along the mean direction, as a force on a segment's first node. */
inline DEVICE Vector forceOfTurning(const Step* step, int s) {
    return loadVector(step, TURNED, s)*(FIELD(MULTIPLIER, s)-FIELD(MULTIPLIER_BEFORE, s));
}

/**
 * Find the change of a node, or add to it, and the tension of the segment before it.
 *
 * @param coupled   whether other nodes are behind it
 * @param before    the segment before it, or -1
 */
inline DEVICE void substitutePair(const Step* step, int node, bool coupled, int before, bool adds, Found* behind) {
    Vector here = loadVector(step, SOLUTION, node), change = loadVector(step, CHANGE, node);
    double found = FIELD(TENSION_FOUND, node), tension = FIELD(TENSION, before < 0 ? 0 : before);
    if (coupled) {
        here = here-matrixTimes(loadMatrix(step, NEXT, node), behind->next)-
                matrixTimes(loadMatrix(step, SECOND, node), behind->second)+
                loadVector(step, PULL, node)*behind->tension;
        found += product(loadVector(step, FIRST, node), behind->next)+
                product(loadVector(step, LAST, node), behind->second)+FIELD(SHARE, node)*behind->tension;
    }
#ifdef CLOSED
    here = here-matrixTimes(loadMatrix(step, BORDER, node), behind->border[0])-
            matrixTimes(loadMatrix(step, BORDER+9, node), behind->border[1]);
    found += product(loadVector(step, TENSION_BORDER, node), behind->border[0])+
            product(loadVector(step, TENSION_BORDER+3, node), behind->border[1]);
#endif
    change = change+here;
    tension += found;
    storeVector(step, CHANGE, node, make_double3(adds ? change.x : here.x, adds ? change.y : here.y,
            adds ? change.z : here.z));
    if (before >= 0)
        storeField(step, TENSION, before, adds ? tension : found);
    behind->tension = found;
    behind->second = behind->next;
    behind->next = here;
}

/** Take a new right side of a node, with the same elimination. */
inline DEVICE void setRightSide(const Step* step, int node, Vector own, Vector direction, RightSides* sides) {
    Vector right = sides->here+own, give = loadVector(step, GIVE, node);
    double start = sides->start;
    Vector solution = symmetricTimes(loadSymmetric(step, INVERSE, node), right)-give*start;
    storeVector(step, SOLUTION, node, solution);
    storeField(step, TENSION_FOUND, node, FIELD(RECIPROCAL, node)*start+product(give, right));
#ifdef CLOSED
    for (int k = 0; k < 2; k++)
        sides->border[k] = sides->border[k]-transposedTimes(loadMatrix(step, BORDER+9*k, node), right)-
                loadVector(step, TENSION_BORDER+3*k, node)*start;
#endif
    sides->here = sides->next-transposedTimes(loadMatrix(step, NEXT, node), right)-loadVector(step, FIRST, node)*start;
    sides->next = (transposedTimes(loadMatrix(step, SECOND, node), right)+loadVector(step, LAST, node)*start)*-1.0;
    sides->start = -product(direction, solution);
}
