/**
 * The linear equations of an iteration of an implicit step: see dynamics/ImplicitEquations-inl.h and
 * dynamics/coordinates, whose names these are.
 */

/** A new segment, and the one between the old nodes and the new. */
typedef struct {
    Vector difference, tangent, middleTangent;
    double length, inverse, middleInverse;
} Geometry;

inline DEVICE Geometry newGeometry(const Step* step, int s) {
    Geometry result;
    Vector before = loadVector(step, DIFFERENCE, s);
    result.difference = before+(loadVector(step, NODE, s+1)-loadVector(step, NODE, s));
    Vector middle = (before+result.difference)*0.5;
    result.length = sqrt(product(result.difference, result.difference));
    result.inverse = 1/result.length;
    result.middleInverse = 1/sqrt(product(middle, middle));
    result.tangent = result.difference*result.inverse;
    result.middleTangent = middle*result.middleInverse;
    return result;
}

/** The friction of a segment's ends against turning, over its rotational friction. */
inline DEVICE double turningFactor(const Step* step, int s, const Geometry* geometry) {
    double squareOfSine = 0.5-0.5*product(tangentAtStart(step, s), geometry->tangent);
    return (1-squareOfSine*(0.25+0.09375*squareOfSine))*(FIELD(INVERSE_LENGTH, s)*geometry->inverse);
}

/** The forces of a node in a stage, but for those of the flow. */
inline DEVICE Vector forcesOn(const Step* step, int node) {
    double ofNoise = shareOfNoise(step);
    return loadVector(step, EXTERNAL, node)*shareOfForces(step)+loadVector(step, RANDOM, node)*ofNoise+
            loadVector(step, METRIC, node)*(ofNoise*ofNoise);
}

/**
 * Add the drag of the flow, at the middle of the step, on a segment at rest. Its part along the segment is a tension,
 * which is returned.
 */
inline DEVICE double addDragOfFlow(const Step* step, int s, const Geometry* geometry, Row* here, Row* after) {
    Vector direction = geometry->middleTangent;
    Vector u1 = flowAt(step, loadVector(step, PLACE, s)+loadVector(step, NODE, s)*0.5);
    Vector u2 = flowAt(step, loadVector(step, PLACE, s+1)+loadVector(step, NODE, s+1)*0.5);
    Vector sum = u1+u2, difference = u2-u1;
    double across = 0.25*PROPERTY(PERPENDICULAR, s), along = 0.25*PROPERTY(PARALLEL, s), share = shareOfForces(step);
    double turn = PROPERTY(ROTATIONAL, s)*turningFactor(step, s, geometry);
    double stretch = PROPERTY(EXTENSIONAL, s)*FIELD(INVERSE_LENGTH, s)*geometry->inverse;
    Vector carried = sum*across+direction*((along-across)*product(direction, sum));
    Vector pair = (difference-direction*product(direction, difference))*turn;
    here->right = here->right+(carried-pair)*share;
    after->right = after->right+(carried+pair)*share;
    return stretch*product(direction, difference)*share;
}

/** Find the tension of a segment with a length, and its response to that. */
inline DEVICE double findTension(const Step* step, int s, double length, double tensionOfFlow) {
    double drag = PROPERTY(EXTENSIONAL, s)*FIELD(INVERSE_LENGTH, s)/step->h, before = FIELD(LENGTH, s);
    double stiffness = PROPERTY(STIFFNESS, s), implicit = FIELD(IMPLICIT, s);
#ifdef STRETCHING_FENE
    FeneTension law = {stiffness, PROPERTY(INVERSE_EXTENSION, s), PROPERTY(REST_LENGTH, s), before, implicit,
            FIELD(CONSTANT_COORDINATE, s), drag, FIELD(CONSTANT_TENSION, s)};
    double own = length, given = FIELD(MULTIPLIER, s);
    if (given != 0)
        own = feneLength(law, given+tensionOfFlow, own);
    double2 found = feneTension(law, own);
    storeField(step, RESPONSE, s, found.y);
    return found.x+found.y*(length-own)-tensionOfFlow;
#else
    double extension = length-PROPERTY(REST_LENGTH, s);
    storeField(step, RESPONSE, s, stiffness*implicit+drag*before/(length*length));
    return stiffness*(implicit*extension+FIELD(CONSTANT_COORDINATE, s))+drag*(length-before)/length+
            FIELD(CONSTANT_TENSION, s)-tensionOfFlow;
#endif
}

/** Add a segment, its friction and its length, to the equations of its nodes. */
inline DEVICE void addSegment(const Step* step, int s, const Geometry* geometry, bool compressed, Row* here,
        Row* after) {
    double perStep = 1/step->h;
    double acrossTrans = 0.25*PROPERTY(PERPENDICULAR, s), alongTrans = 0.25*PROPERTY(PARALLEL, s);
    double acrossTurn = (PROPERTY(ROTATIONAL, s)+FIELD(EXTRA, s))*turningFactor(step, s, geometry);
    double sameAcross = (acrossTrans+acrossTurn)*perStep, otherAcross = (acrossTrans-acrossTurn)*perStep;
    double along = alongTrans*perStep;
    Vector direction = geometry->middleTangent, first = loadVector(step, NODE, s);
    Vector second = loadVector(step, NODE, s+1);
    double first1 = product(direction, first), second1 = product(direction, second);
    Symmetric block = withAxial(zeroSymmetric(), sameAcross, along-sameAcross, direction);
    here->upper = axial(otherAcross, along-otherAcross, direction);
    here->right = here->right-first*sameAcross-second*otherAcross-
            direction*((along-sameAcross)*first1+(along-otherAcross)*second1);
    after->right = forcesOn(step, s+1)-second*sameAcross-first*otherAcross-
            direction*((along-sameAcross)*second1+(along-otherAcross)*first1);

    double tensionOfFlow = 0;
    if (step->hasFlow)
        tensionOfFlow = addDragOfFlow(step, s, geometry, here, after);
    Vector t = geometry->tangent, turned = direction-t;
    double tension = findTension(step, s, geometry->length, tensionOfFlow), multiplier = FIELD(MULTIPLIER, s);
    double response = FIELD(RESPONSE, s), shift = fmin(0.5*response, alongTrans*perStep);
    storeVector(step, NEW_TANGENT, s, t);
    storeVector(step, TURNED, s, turned);
    storeField(step, MULTIPLIER_BEFORE, s, multiplier);
    storeField(step, SHIFT, s, shift);
    storeField(step, COMPLIANCE, s, 1/(response-shift+TINY_NUMBER));
    storeField(step, TENSION_START, s, tension);
    double least = compressed ? -UNBOUNDED : acrossTurn*(-COMPRESSION*perStep);
    double turning = 0.5*fmax(multiplier*geometry->inverse, least);
    block = withAxial(block, turning, shift-turning, t);
    here->upper = differenceOf(here->upper, axial(turning, shift-turning, t));
    here->right = here->right+turned*multiplier;
    after->right = after->right-turned*multiplier;
    after->diagonal = block;
    here->diagonal = sumOfSymmetric(here->diagonal, block);
}

/** Add what a node has by itself: friction, with the drag of the flow on it, and tethers. */
inline DEVICE void addNode(const Step* step, int node, Row* row) {
    Vector moved = loadVector(step, NODE, node);
    if (step->nodeFriction > 0) {
        double friction = step->nodeFriction/step->h;
        row->diagonal = withDiagonal(row->diagonal, friction);
        row->right = row->right-moved*friction;
        if (step->hasFlow)
            row->right = row->right+flowAt(step, loadVector(step, PLACE, node)+moved*0.5)*
                    (step->nodeFriction*shareOfForces(step));
    }
    if (!step->hasTethers)
        return;
    for (int number = step->firstTethers[node]; number < step->firstTethers[node+1]; number++) {
        GLOBAL const double* tether = step->tetherMemory+(size_t) number*NUM_TETHER_FIELDS;
        double stiffness = step->tethers[(size_t) number*NUM_TETHER_PROPERTIES+TETHER_STIFFNESS];
        double implicit = stiffness*tether[TETHER_IMPLICIT];
        Vector offset = make_double3(tether[TETHER_CONSTANT], tether[TETHER_CONSTANT+1], tether[TETHER_CONSTANT+2]);
        row->right = row->right-moved*implicit-offset*stiffness;
        row->diagonal = withDiagonal(row->diagonal, implicit);
    }
}

/** Add the bend of the joint between a segment and the one before it. */
inline DEVICE void addBend(const Step* step, int s, const Geometry* geometry1, const Geometry* geometry2, Row* before,
        Row* here, Row* after) {
    double stiffness = PROPERTY(JOINT, s), implicit = FIELD(JOINT_IMPLICIT, s);
    Vector offset = loadVector(step, CONSTANT_BEND, s), turning = loadVector(step, TURNING_BEND, s);
#ifdef BENDING_BondDifference
    Vector bend = geometry2->difference-geometry1->difference;
    Vector force = (bend*implicit+offset-turning)*stiffness;
    before->right = before->right-force;
    here->right = here->right+force*2.0;
    after->right = after->right-force;
    double scale = stiffness*implicit;
    before->diagonal = withDiagonal(before->diagonal, scale);
    here->diagonal = withDiagonal(here->diagonal, 4*scale);
    after->diagonal = withDiagonal(after->diagonal, scale);
    before->second = axial(scale, 0, zeroVector());
    before->upper = differenceOf(before->upper, axial(2*scale, 0, zeroVector()));
    here->upper = differenceOf(here->upper, axial(2*scale, 0, zeroVector()));
#else
    Vector t1 = geometry1->middleTangent, t2 = geometry2->middleTangent;
    double perLength1 = geometry1->middleInverse, perLength2 = geometry2->middleInverse;
    Vector newBent = geometry2->tangent-geometry1->tangent, bent = t2-t1;
    BendFactor newFactor = bendFactor(product(newBent, newBent)), factor = bendFactor(product(bent, bent));
    // The random bend turns with the joint.
    Vector sum = tangentAtStart(step, s-1)+tangentAtStart(step, s)+geometry1->tangent+geometry2->tangent;
    Vector bisectorBefore = loadVector(step, BISECTOR, s);
    double sumLength = sqrt(product(sum, sum)+LEAST_NUMBER*LEAST_NUMBER), projection = product(bisectorBefore, sum);
    double perSum = 1/sumLength, perOne = 1/(sumLength+projection+LEAST_NUMBER);
    Vector axis = crossProduct(bisectorBefore, sum*perSum);
    Vector turned = turning*(projection*perSum)+crossProduct(axis, turning)+
            axis*(product(axis, turning)*sumLength*perOne);

    Vector u = newBent*(newFactor.f*implicit)+offset-turned;
    double twist = factor.slope*product(u, bent);
    Vector force1 = t2*twist-u*factor.f, force2 = u*factor.f+t1*twist;
    force1 = (force1-t1*product(t1, force1))*(stiffness*perLength1);
    force2 = (force2-t2*product(t2, force2))*(stiffness*perLength2);
    before->right = before->right+force1;
    here->right = here->right-force1+force2;
    after->right = after->right-force2;

    double scale = stiffness*implicit*factor.f*factor.f;
    double scale1 = scale*perLength1*perLength1, scale2 = scale*perLength2*perLength2;
    Symmetric first = withAxial(zeroSymmetric(), scale1, -scale1, t1);
    Symmetric last = withAxial(zeroSymmetric(), scale2, -scale2, t2);
    Vector projected = t2-t1*product(t1, t2);
    // -(1-t1 t1)(1-t2 t2)
    Matrix mixed = scaled(differenceOf(axial(1, -1, t1), outer(projected, t2)), -scale*perLength1*perLength2);
    Matrix both = sumOf(mixed, transposed(mixed));
    before->second = scaled(mixed, -1);
    before->diagonal = sumOfSymmetric(before->diagonal, first);
    here->diagonal = sumOfSymmetric(sumOfSymmetric(here->diagonal, first), sumOfSymmetric(last,
            lowerPart(scaled(both, -1))));
    after->diagonal = sumOfSymmetric(after->diagonal, last);
    before->upper = differenceOf(sumOf(before->upper, mixed), fullMatrix(first));
    here->upper = differenceOf(sumOf(here->upper, mixed), fullMatrix(last));
#endif
}
