/**
 * The equations of a chain, set up and solved by several work-items.
 *
 * Each of them sets up some of the equations. Two of them, 0 and 1, eliminate nodes from the first and from the last
 * towards the middle; what is behind a node is for work-item 1 what is before it in the chain. In a ring, the first two
 * nodes come last, and both ends are coupled to them. The equations of the nodes and tensions that are left, in the
 * middle, have a matrix that is inverted by all.
 */

#ifdef CHAIN_BY_GROUP

/**
 * What is left: the nodes in the middle, number 0 and 1, in a ring the first two, number 2 and 3, and then tensions:
 * those of the segments that either end has arrived at, of the segment between the nodes in the middle, and in a ring
 * of that between the first two.
 */
#ifdef CLOSED
#define FIRST_INNER_NODE 2
#define NODES_LEFT 4
#define NUMBERS_LEFT NUMBERS_LEFT_OF_RING
#define ROW_LENGTH ROW_LENGTH_OF_RING
#define SIZE_OF_MIDDLE SIZE_OF_MIDDLE_OF_RING
#else
#define FIRST_INNER_NODE 0
#define NODES_LEFT 2
#define NUMBERS_LEFT NUMBERS_LEFT_OF_OPEN_CHAIN
#define ROW_LENGTH ROW_LENGTH_OF_OPEN_CHAIN
#define SIZE_OF_MIDDLE SIZE_OF_MIDDLE_OF_OPEN_CHAIN
#endif
#define TENSION_OF_END (3*NODES_LEFT)
#define TENSION_BETWEEN (3*NODES_LEFT+2)
#define TENSION_OF_BORDER (3*NODES_LEFT+3)
/**
 * Numbers of either end for what is left: the matrix, right sides, and what is found. Those of end 0 become those of
 * both.
 */
#define LEFT_OF_END(end) (step->middle+(end)*(SIZE_OF_MIDDLE/2))
#define LEFT_MATRIX(left, i, j) (left)[(i)*ROW_LENGTH+(j)]
#define LEFT_RIGHT(left, i) (left)[NUMBERS_LEFT*ROW_LENGTH+(i)]
#define LEFT_FOUND(i) step->middle[NUMBERS_LEFT*(ROW_LENGTH+1)+(i)]
/** How many of its rows a work-item has at most. */
#define ROWS_OF_ITEM ((NUMBERS_LEFT+ITEMS_OF_CHAIN-1)/ITEMS_OF_CHAIN)

/** Where the equations of nodes are, before elimination leaves its results there. */
enum {ROW_DIAGONAL = INVERSE, ROW_UPPER = NEXT, ROW_SECOND = SECOND, ROW_RIGHT = SOLUTION};

/** How many nodes are eliminated from an end, and which. */
inline DEVICE int countOfEnd(const Step* step, int end) {
    const int inner = step->own-FIRST_INNER_NODE-2;
    return end == 0 ? inner/2 : inner-inner/2;
}

inline DEVICE int nodeOfEnd(const Step* step, int end, int number) {
    return end == 0 ? FIRST_INNER_NODE+number : step->own-1-number;
}

/** The node with a number among those that are left. */
inline DEVICE int nodeLeft(const Step* step, int number) {
    return number < 2 ? FIRST_INNER_NODE+countOfEnd(step, 0)+number : number-2;
}

/** The segments before and behind a node, as an end sees it. */
inline DEVICE int segmentBefore(int end, int node) {
    return end == 0 ? node-1 : node;
}

inline DEVICE int segmentBehind(int end, int node) {
    return end == 0 ? node : node-1;
}

inline DEVICE Vector directionOf(const Step* step, int end, int s) {
    return loadVector(step, NEW_TANGENT, s)*(end == 0 ? 1.0 : -1.0);
}

inline DEVICE void addToRow(const Step* step, int node, Symmetric diagonal, Vector right) {
    storeSymmetric(step, ROW_DIAGONAL, node, sumOfSymmetric(loadSymmetric(step, ROW_DIAGONAL, node), diagonal));
    addVector(step, ROW_RIGHT, node, right);
}

inline DEVICE void addToUpper(const Step* step, int node, Matrix upper) {
    storeMatrix(step, ROW_UPPER, node, sumOf(loadMatrix(step, ROW_UPPER, node), upper));
}

/** Linearise the equations around the nodes. What segments and joints add to a node comes in an order of its own. */
DEVICE void gatherRows(const Step* step, bool compressed) {
    EACH(node, step->nodes) {
        Row row = emptyRow();
        if (node == 0 || node > step->segments)
            row.right = forcesOn(step, node);
        if (node < step->own)
            addNode(step, node, &row);
        storeSymmetric(step, ROW_DIAGONAL, node, row.diagonal);
        storeVector(step, ROW_RIGHT, node, row.right);
        storeMatrix(step, ROW_UPPER, node, row.upper);
        storeMatrix(step, ROW_SECOND, node, row.second);
    }
    WAIT_FOR_ITEMS
    int first = 0;
    do {
        const int s = first+ITEM;
        Row here = emptyRow(), after = emptyRow();
        if (s < step->segments) {
            Geometry geometry = newGeometry(step, s);
            addSegment(step, s, &geometry, compressed, &here, &after);
            addToRow(step, s, here.diagonal, here.right);
            addToUpper(step, s, here.upper);
        }
        WAIT_FOR_ITEMS
        if (s < step->segments)
            addToRow(step, s+1, after.diagonal, after.right);
        WAIT_FOR_ITEMS
        first += ITEMS_OF_CHAIN;
    } while (first < step->segments);
    first = 1;
    do {
        const int s = first+ITEM;
        Row before = emptyRow(), here = emptyRow(), after = emptyRow();
        if (s < step->nodes-1) {
            Geometry geometry1 = newGeometry(step, s-1), geometry2 = newGeometry(step, s);
            addBend(step, s, &geometry1, &geometry2, &before, &here, &after);
            addToRow(step, s-1, before.diagonal, before.right);
            addToUpper(step, s-1, before.upper);
            storeMatrix(step, ROW_SECOND, s-1, before.second);
        }
        WAIT_FOR_ITEMS
        if (s < step->nodes-1) {
            addToRow(step, s, here.diagonal, here.right);
            addToUpper(step, s, here.upper);
        }
        WAIT_FOR_ITEMS
        if (s < step->nodes-1)
            addToRow(step, s+1, after.diagonal, after.right);
        WAIT_FOR_ITEMS
        first += ITEMS_OF_CHAIN;
    } while (first < step->nodes-1);
}

/** A matrix as an end sees it. */
inline DEVICE Matrix matrixOfEnd(const Step* step, int end, int field, int place) {
    Matrix m = loadMatrix(step, field, place), other = transposed(m);
    m.x = make_double3(m.x.x, end == 0 ? m.x.y : other.x.y, end == 0 ? m.x.z : other.x.z);
    m.y = make_double3(end == 0 ? m.y.x : other.y.x, m.y.y, end == 0 ? m.y.z : other.y.z);
    m.z = make_double3(end == 0 ? m.z.x : other.z.x, end == 0 ? m.z.y : other.z.y, m.z.z);
    return m;
}

/**
 * The equations of a node as an end sees it. Nothing is asked of the number, so that they can be on their way while the
 * node before is eliminated: both ends have all of the nodes in the middle.
 */
inline DEVICE Row rowOfEnd(const Step* step, int end, int number) {
    Row row = emptyRow();
    const int node = nodeOfEnd(step, end, number);
    row.diagonal = loadSymmetric(step, ROW_DIAGONAL, node);
    row.right = loadVector(step, ROW_RIGHT, node);
    row.upper = matrixOfEnd(step, end, ROW_UPPER, max(end == 0 ? node : node-1, 0));
    row.second = matrixOfEnd(step, end, ROW_SECOND, max(end == 0 ? node : node-2, 0));
    return row;
}

#ifdef CLOSED
/** Couple the first two rows that an end has to the first two nodes of a ring. */
inline DEVICE void coupleToBorder(const Step* step, int end, Row* first, Row* second) {
    // An array whose index is not known when this is compiled would be in memory.
    const int last = step->own-1;
    if (end == 0) {
        first->border[0] = transposed(loadMatrix(step, ROW_SECOND, 0));
        first->border[1] = transposed(loadMatrix(step, ROW_UPPER, 1));
        second->border[1] = transposed(loadMatrix(step, ROW_SECOND, 1));
    }
    else {
        first->border[0] = loadMatrix(step, ROW_UPPER, last);
        first->border[1] = loadMatrix(step, ROW_SECOND, last);
        second->border[0] = loadMatrix(step, ROW_SECOND, last-1);
    }
}
#endif

inline DEVICE void addRowLeft(LOCAL_ARG double* left, int row, int column, Vector v) {
    LEFT_MATRIX(left, row, column) += v.x;
    LEFT_MATRIX(left, row, column+1) += v.y;
    LEFT_MATRIX(left, row, column+2) += v.z;
}

/** Add a block to the rows of one node that is left, and to those of another. */
inline DEVICE void addBlockLeft(LOCAL_ARG double* left, int one, int other, Matrix m) {
    addRowLeft(left, 3*one, 3*other, m.x);
    addRowLeft(left, 3*one+1, 3*other, m.y);
    addRowLeft(left, 3*one+2, 3*other, m.z);
    m = transposed(m);
    addRowLeft(left, 3*other, 3*one, m.x);
    addRowLeft(left, 3*other+1, 3*one, m.y);
    addRowLeft(left, 3*other+2, 3*one, m.z);
}

inline DEVICE void addRightLeft(LOCAL_ARG double* left, int number, Vector right) {
    LEFT_RIGHT(left, 3*number) += right.x;
    LEFT_RIGHT(left, 3*number+1) += right.y;
    LEFT_RIGHT(left, 3*number+2) += right.z;
}

/** Add the block of a node that is left, and its right side. */
inline DEVICE void addNodeLeft(LOCAL_ARG double* left, int number, Symmetric diagonal, Vector right) {
    Matrix m = fullMatrix(diagonal);
    addRowLeft(left, 3*number, 3*number, m.x);
    addRowLeft(left, 3*number+1, 3*number, m.y);
    addRowLeft(left, 3*number+2, 3*number, m.z);
    addRightLeft(left, number, right);
}

inline DEVICE void addTensionLeft(LOCAL_ARG double* left, int tension, int number, Vector v) {
    addRowLeft(left, tension, 3*number, v);
    LEFT_MATRIX(left, 3*number, tension) += v.x;
    LEFT_MATRIX(left, 3*number+1, tension) += v.y;
    LEFT_MATRIX(left, 3*number+2, tension) += v.z;
}

/** Add the tension of a segment whose nodes, one after the other, are left. */
inline DEVICE void addSegmentLeft(const Step* step, LOCAL_ARG double* left, int tension, int number, int s) {
    Vector direction = loadVector(step, NEW_TANGENT, s);
    addTensionLeft(left, tension, number, direction*-1.0);
    addTensionLeft(left, tension, number+1, direction);
    LEFT_MATRIX(left, tension, tension) -= FIELD(COMPLIANCE, s);
    LEFT_RIGHT(left, tension) -= FIELD(COMPLIANCE, s)*FIELD(TENSION_START, s);
}

/** Eliminate nodes from an end to the middle, and add what is arrived at to what is left. */
DEVICE void eliminateFromEnd(const Step* step, int end) {
    const int count = countOfEnd(step, end), near = end, far = 1-end, tension = TENSION_OF_END+end;
    LOCAL_ARG double* left = LEFT_OF_END(end);
    Link link = firstLink();
#ifdef CLOSED
    const int first = segmentBefore(end, nodeOfEnd(step, end, 0));
    link.resistance = FIELD(COMPLIANCE, first);
    link.right = FIELD(COMPLIANCE, first)*FIELD(TENSION_START, first);
    link.first = directionOf(step, end, first);
    link.border[0] = link.first*(end == 0 ? 0.0 : -1.0);
    link.border[1] = link.first*(end == 0 ? -1.0 : 0.0);
    Row border[2];
    border[0] = border[1] = emptyRow();
#endif
    Row here = rowOfEnd(step, end, 0), next = rowOfEnd(step, end, 1);
#ifdef CLOSED
    coupleToBorder(step, end, &here, &next);
#endif
    for (int number = 0; number < count; number++) {
        const int node = nodeOfEnd(step, end, number), s = segmentBehind(end, node);
        Row second = rowOfEnd(step, end, number+2);
        TensionEquation behind = {directionOf(step, end, s), FIELD(COMPLIANCE, s), FIELD(TENSION_START, s)};
#ifdef CLOSED
        Link before = link;
#endif
        eliminatePair(step, node, 2, behind, &here, &next, &second, &link);
#ifdef CLOSED
        eliminateFromBorder(step, node, behind.direction, &here, &next, &second, border, &before, &link);
#endif
        here = next;
        next = second;
    }
    addNodeLeft(left, near, here.diagonal, here.right);
    addNodeLeft(left, far, next.diagonal, next.right);
    addBlockLeft(left, near, far, here.upper);
    addTensionLeft(left, tension, near, link.first);
    addTensionLeft(left, tension, far, link.last);
    LEFT_MATRIX(left, tension, tension) -= link.resistance;
    LEFT_RIGHT(left, tension) -= link.right;
#ifdef CLOSED
    for (int k = 0; k < 2; k++) {
        addNodeLeft(left, 2+k, border[k].diagonal, border[k].right);
        addBlockLeft(left, near, 2+k, here.border[k]);
        addBlockLeft(left, far, 2+k, next.border[k]);
        addTensionLeft(left, tension, 2+k, link.border[k]);
    }
    addBlockLeft(left, 2, 3, border[0].upper);
#endif
}

/**
 * Add what is left as it was: the tension in the middle, and of a ring the first two nodes, with that between them.
 * Both ends have had the equations of the nodes in the middle.
 */
inline DEVICE void addUntouched(const Step* step) {
    LOCAL_ARG double* left = LEFT_OF_END(0);
    for (int number = 0; number < 2; number++) {
        const int node = nodeLeft(step, number);
        addNodeLeft(left, number, scaledSymmetric(loadSymmetric(step, ROW_DIAGONAL, node), -1),
                loadVector(step, ROW_RIGHT, node)*-1.0);
    }
    addBlockLeft(left, 0, 1, scaled(loadMatrix(step, ROW_UPPER, nodeLeft(step, 0)), -1));
    addSegmentLeft(step, left, TENSION_BETWEEN, 0, nodeLeft(step, 0));
#ifdef CLOSED
    // They come a second time behind the last node.
    for (int k = 0; k < 2; k++)
        for (int node = k; node < step->nodes; node += step->own)
            addNodeLeft(left, 2+k, loadSymmetric(step, ROW_DIAGONAL, node), loadVector(step, ROW_RIGHT, node));
    addBlockLeft(left, 2, 3, sumOf(loadMatrix(step, ROW_UPPER, 0), loadMatrix(step, ROW_UPPER, step->own)));
    addSegmentLeft(step, left, TENSION_OF_BORDER, 2, 0);
#endif
}

/** A row of what is left that a work-item computes. Where it has fewer than others, it computes the last one, too. */
inline DEVICE int rowOfItem(int number) {
    return min(ITEM+number*ITEMS_OF_CHAIN, NUMBERS_LEFT-1);
}

/** Invert the matrix of what is left. Fixed nodes neither move nor pass anything on. */
inline DEVICE void invertLeft(const Step* step) {
    LOCAL_ARG double* left = LEFT_OF_END(0);
    LOCAL_ARG const double* ofOther = LEFT_OF_END(1);
    EACH(row, NUMBERS_LEFT)
        LEFT_FOUND(row) = row < 3*NODES_LEFT ? PROPERTY(MOBILE, nodeLeft(step, row/3)) : 1;
    WAIT_FOR_ITEMS
    EACH(row, NUMBERS_LEFT) {
        const double mobile = LEFT_FOUND(row);
        for (int column = 0; column < NUMBERS_LEFT; column++)
            LEFT_MATRIX(left, row, column) = mobile*LEFT_FOUND(column)*
                    (LEFT_MATRIX(left, row, column)+LEFT_MATRIX(ofOther, row, column));
        LEFT_MATRIX(left, row, row) += 1-mobile;
    }
    WAIT_FOR_ITEMS
    // Nodes come before the tensions between them, whose stiffness cannot hide what moves nodes then.
    int pivot = 0;
    do {
        const double reciprocal = 1/LEFT_MATRIX(left, pivot, pivot);
        double factors[ROWS_OF_ITEM], numbers[ROWS_OF_ITEM][NUMBERS_LEFT];
        for (int k = 0; k < ROWS_OF_ITEM; k++) {
            const int row = rowOfItem(k);
            factors[k] = LEFT_MATRIX(left, row, pivot)*reciprocal;
            for (int column = 0; column < NUMBERS_LEFT; column++) {
                const double own = LEFT_MATRIX(left, row, column), ofPivot = LEFT_MATRIX(left, pivot, column);
                const double changed = own-factors[k]*ofPivot, divided = ofPivot*reciprocal;
                numbers[k][column] = row == pivot ? divided : changed;
            }
        }
        WAIT_FOR_ITEMS
        for (int k = 0; k < ROWS_OF_ITEM; k++) {
            const int row = ITEM+k*ITEMS_OF_CHAIN;
            for (int column = 0; column < NUMBERS_LEFT && row < NUMBERS_LEFT; column++)
                LEFT_MATRIX(left, row, column) = column != pivot ? numbers[k][column] :
                        row == pivot ? reciprocal : -factors[k];
        }
        WAIT_FOR_ITEMS
    } while (++pivot < NUMBERS_LEFT);
    EACH(row, NUMBERS_LEFT)
        if (LEFT_FOUND(row) == 0)
            LEFT_MATRIX(left, row, row) = 0;
    WAIT_FOR_ITEMS
}

/** Linearise the equations around the nodes, and eliminate these from both ends. */
DEVICE void eliminate(const Step* step, bool compressed) {
    gatherRows(step, compressed);
    EACH(i, SIZE_OF_MIDDLE)
        step->middle[i] = 0;
    WAIT_FOR_ITEMS
    if (ITEM < 2)
        eliminateFromEnd(step, ITEM);
    if (ITEM == 0)
        addUntouched(step);
    WAIT_FOR_ITEMS
    invertLeft(step);
}

inline DEVICE Vector vectorLeft(const Step* step, int number) {
    return make_double3(LEFT_FOUND(3*number), LEFT_FOUND(3*number+1), LEFT_FOUND(3*number+2));
}

inline DEVICE void keepTensionLeft(const Step* step, int s, double tension, bool adds) {
    if (s >= 0 && s < step->segments)
        storeField(step, TENSION, s, tension+(adds ? FIELD(TENSION, s) : 0));
}

/** Find the changes of nodes and the tensions, or add to them, if wanted. */
DEVICE void substitute(const Step* step, bool adds, bool wanted) {
    EACH(row, wanted ? NUMBERS_LEFT : 0) {
        double found = 0;
        for (int column = 0; column < NUMBERS_LEFT; column++)
            found += LEFT_MATRIX(LEFT_OF_END(0), row, column)*
                    (LEFT_RIGHT(LEFT_OF_END(0), column)+LEFT_RIGHT(LEFT_OF_END(1), column));
        LEFT_FOUND(row) = found;
    }
    WAIT_FOR_ITEMS
    if (wanted && ITEM < NODES_LEFT) {
        const int node = nodeLeft(step, ITEM);
        Vector change = vectorLeft(step, ITEM);
        if (adds)
            change = change+loadVector(step, CHANGE, node);
        // The first two nodes of a ring come a second time behind the last one.
        for (int place = node; place < step->nodes; place += step->own)
            storeVector(step, CHANGE, place, change);
    }
    if (wanted && ITEM < 2) {
        const int end = ITEM;
        Found behind;
        behind.next = vectorLeft(step, end);
        behind.second = vectorLeft(step, 1-end);
        behind.tension = LEFT_FOUND(TENSION_OF_END+end);
#ifdef CLOSED
        behind.border[0] = vectorLeft(step, 2);
        behind.border[1] = vectorLeft(step, 3);
        if (end == 0)
            keepTensionLeft(step, 0, LEFT_FOUND(TENSION_OF_BORDER), adds);
#endif
        if (end == 0)
            keepTensionLeft(step, nodeLeft(step, 0), LEFT_FOUND(TENSION_BETWEEN), adds);
        keepTensionLeft(step, segmentBefore(end, nodeLeft(step, end)), behind.tension, adds);
        for (int number = countOfEnd(step, end)-1; number >= 0; number--) {
            const int node = nodeOfEnd(step, end, number), s = segmentBefore(end, node);
            substitutePair(step, node, true, s < step->segments ? s : -1, adds, &behind);
        }
    }
    WAIT_FOR_ITEMS
    EACH(s, wanted ? step->segments : 0)
        keepTension(step, s);
    WAIT_FOR_ITEMS
}

/** Let the change of tensions act along the mean direction as well, with the same elimination, if wanted. */
DEVICE void refine(const Step* step, bool wanted) {
    EACH(node, wanted ? step->own : 0) {
        Vector own = zeroVector();
        if (node < step->segments)
            own = forceOfTurning(step, node);
#ifdef CLOSED
        own = own-forceOfTurning(step, node == 0 ? step->own-1 : node-1);
#else
        if (node > 0)
            own = own-forceOfTurning(step, node-1);
#endif
        storeVector(step, SOLUTION, node, own);
    }
    EACH(row, NUMBERS_LEFT)
        LEFT_RIGHT(LEFT_OF_END(0), row) = LEFT_RIGHT(LEFT_OF_END(1), row) = 0;
    WAIT_FOR_ITEMS
    if (wanted && ITEM < 2) {
        const int end = ITEM, count = countOfEnd(step, end);
        LOCAL_ARG double* left = LEFT_OF_END(end);
        RightSides sides;
        sides.here = sides.next = zeroVector();
        sides.start = 0;
#ifdef CLOSED
        sides.border[0] = sides.border[1] = zeroVector();
#endif
        for (int number = 0; number < count; number++) {
            const int node = nodeOfEnd(step, end, number);
            setRightSide(step, node, loadVector(step, SOLUTION, node),
                    directionOf(step, end, segmentBehind(end, node)), &sides);
        }
        addRightLeft(left, end, sides.here+loadVector(step, SOLUTION, nodeLeft(step, end)));
        addRightLeft(left, 1-end, sides.next);
        LEFT_RIGHT(left, TENSION_OF_END+end) -= sides.start;
#ifdef CLOSED
        addRightLeft(left, 2, sides.border[0]);
        addRightLeft(left, 3, sides.border[1]);
        addRightLeft(left, 2+end, loadVector(step, SOLUTION, end));
#endif
    }
    WAIT_FOR_ITEMS
    substitute(step, true, wanted);
}

/** Blocks of the inverse of what is left. */
inline DEVICE Matrix inverseLeft(LOCAL_ARG const double* left, int one, int other) {
    const int row = 3*one, column = 3*other;
    Matrix m;
    m.x = make_double3(LEFT_MATRIX(left, row, column), LEFT_MATRIX(left, row, column+1),
            LEFT_MATRIX(left, row, column+2));
    m.y = make_double3(LEFT_MATRIX(left, row+1, column), LEFT_MATRIX(left, row+1, column+1),
            LEFT_MATRIX(left, row+1, column+2));
    m.z = make_double3(LEFT_MATRIX(left, row+2, column), LEFT_MATRIX(left, row+2, column+1),
            LEFT_MATRIX(left, row+2, column+2));
    return m;
}

/** What a unit of compliance times start of a tension moves a node by, of those that are left. */
inline DEVICE Vector responseLeft(LOCAL_ARG const double* left, int number, int tension) {
    return make_double3(-LEFT_MATRIX(left, 3*number, tension), -LEFT_MATRIX(left, 3*number+1, tension),
            -LEFT_MATRIX(left, 3*number+2, tension));
}

/** Keep how far a unit force along a segment moves its ends apart, as an end sees it. */
inline DEVICE void keepResponse(const Step* step, int end, int s, Vector response) {
    storeVector(step, SOLUTION, s, response*(end == 0 ? FIELD(COMPLIANCE, s) : -FIELD(COMPLIANCE, s)));
}

/** Add the metric forces of lengths, if wanted. */
DEVICE void addMetricForces(const Step* step, bool wanted) {
    if (wanted && ITEM < 2) {
        LOCAL_ARG const double* left = LEFT_OF_END(0);
        const int end = ITEM, near = end, far = 1-end, tension = TENSION_OF_END+end;
        Responses responses;
        responses.same = lowerPart(inverseLeft(left, near, near));
        responses.sameAfter = lowerPart(inverseLeft(left, far, far));
        responses.other = inverseLeft(left, near, far);
        responses.after = responseLeft(left, near, tension);
        responses.afterNext = responseLeft(left, far, tension);
        responses.own = -LEFT_MATRIX(left, tension, tension);
#ifdef CLOSED
        for (int k = 0; k < 2; k++) {
            responses.borders[k][0] = inverseLeft(left, 2+k, 2);
            responses.borders[k][1] = inverseLeft(left, 2+k, 3);
            responses.next[k] = inverseLeft(left, near, 2+k);
            responses.second[k] = inverseLeft(left, far, 2+k);
            responses.ofBorder[k] = responseLeft(left, 2+k, tension);
        }
#endif
        for (int number = countOfEnd(step, end)-1; number >= 0; number--) {
            const int node = nodeOfEnd(step, end, number);
            Vector here = responseOf(step, node, &responses);
            keepResponse(step, end, segmentBehind(end, node), here-responses.after);
            passResponses(step, node, here, &responses);
        }
#ifdef CLOSED
        keepResponse(step, end, segmentBefore(end, nodeOfEnd(step, end, 0)),
                (end == 0 ? responses.ofBorder[1] : responses.ofBorder[0])-responses.after);
#endif
        if (end == 0) {
            keepResponse(step, 0, nodeLeft(step, 0),
                    responseLeft(left, 0, TENSION_BETWEEN)-responseLeft(left, 1, TENSION_BETWEEN));
#ifdef CLOSED
            keepResponse(step, 0, 0,
                    responseLeft(left, 2, TENSION_OF_BORDER)-responseLeft(left, 3, TENSION_OF_BORDER));
#endif
        }
    }
    WAIT_FOR_ITEMS
    int turn = 0;
    do {
        EACH_IN_TURN(s, wanted ? step->segments : 0, turn)
            addMetricForce(step, s, loadVector(step, SOLUTION, s));
        WAIT_FOR_ITEMS
    } while (++turn < NUM_TURNS);
}
#endif
