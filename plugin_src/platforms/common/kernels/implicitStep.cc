/**
 * A step of the implicit schemes, and its division into parts where its equations are not solved: see
 * dynamics/ImplicitStep-inl.h, MetricForces-inl.h, ImplicitPositions-inl.h, ImplicitConvergence-inl.h and
 * DividedStep-inl.h.
 */

/** The friction of a segment's ends against turning, and the stiffness with which its tension turns it back. */
inline DEVICE double2 turningRates(const Step* step, int s) {
    double l0 = PROPERTY(REST_LENGTH, s), perShare = step->h/shareOfForces(step);
    double friction = 0.25*PROPERTY(PERPENDICULAR, s)+PROPERTY(ROTATIONAL, s)/(l0*l0)+0.5*step->nodeFriction+
            TINY_NUMBER;
#ifdef BENDING_BondDifference
    friction += perShare*(PROPERTY(JOINT, s)+PROPERTY(JOINT, s+1));
#endif
    return make_double2(friction, perShare*FIELD(MULTIPLIER, s)*FIELD(INVERSE_LENGTH, s));
}

/** Give friction and its noise to segments that are taut; returns whether any comes near to it. */
DEVICE bool stiffenTautSegments(const Step* step) {
    double greatest = 0;
    for (int s = 0; s < step->segments; s++) {
        double2 rates = turningRates(step, s);
        greatest = fmax(greatest, rates.y/rates.x);
    }
    if (!(greatest > NEARLY_TAUT))
        return false;
    for (int s = 0; s < step->segments; s++) {
        double2 rates = turningRates(step, s);
        double length = FIELD(LENGTH, s), extra = fmax(0.5*rates.y-rates.x, 0.0)*length*length;
        FIELD(EXTRA, s) = extra;
        Vector pair = loadVector(step, RANDOM_PAIR, s)*(sqrt(1+extra/(PROPERTY(ROTATIONAL, s)+TINY_NUMBER))-1);
        addVector(step, RANDOM, s, pair*-1.0);
        addVector(step, RANDOM, s+1, pair);
    }
    return true;
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

/** Give segments other lengths, around the same mean of all nodes; those meant by the equations, or those of REST. */
DEVICE void rebuild(const Step* step, bool toRest) {
    Vector sum = zeroVector(), shifted = zeroVector(), end = loadVector(step, NODE, 0), moved = end;
    double count = 0;
    for (int node = 0; node < step->nodes; node++) {
        if (node > 0) {
            int s = node-1;
            Vector y = loadVector(step, NODE, node), change = y-end;
            Vector difference = loadVector(step, DIFFERENCE, s)+change, rest = loadVector(step, REST, node);
            double length = fmax(product(loadVector(step, NEW_TANGENT, s), difference), 0.5*FIELD(LENGTH, s));
#ifdef STRETCHING_FENE
            double range = (1-1e-9)/(PROPERTY(INVERSE_EXTENSION, s)+TINY_NUMBER), l0 = PROPERTY(REST_LENGTH, s);
            length = fmax(fmin(length, l0+range), l0-range);
#endif
            if (toRest)
                length = sqrt(product(rest, rest));
            moved = moved+change+difference*(length/sqrt(product(difference, difference))-1);
            end = y;
        }
        double mobile = PROPERTY(MOBILE, node);
        sum = sum+end*mobile;
        shifted = shifted+moved*mobile;
        count += mobile;
        storeVector(step, REST, node, moved);
    }
    Vector back = (sum-shifted)*(1/fmax(count, 1.0));
    for (int node = 0; node < step->nodes; node++)
        storeVector(step, NODE, node, loadVector(step, REST, node)+back);
}

/** Begin the second stage where the noise of the first would have taken the chain, had it been that of the step. */
DEVICE void extrapolate(const Step* step) {
    Vector end = loadVector(step, NODE, 0);
    for (int node = 0; node < step->nodes; node++) {
        Vector found = loadVector(step, NODE, node), rest = found-end;
        storeVector(step, NODE, node, found*(1/NOISE_OF_FIRST));
        if (node > 0)
            rest = rest+loadVector(step, DIFFERENCE, node-1);
        storeVector(step, REST, node, rest);
        end = found;
    }
    rebuild(step, true);
}

/** Begin the iteration where the flow carries the chain as a whole. */
DEVICE void carryAlong(const Step* step, Vector first) {
    double time = step->h*shareOfForces(step);
    Vector carried = flowAt(step, first+flowAt(step, first)*(0.5*time))*time;
    for (int node = 0; node < step->nodes; node++)
        addVector(step, NODE, node, carried);
}

/** Whether the last iteration has changed too much for it to be the last. NaN counts as such. */
DEVICE bool isUnfinished(const Step* step) {
    double tighter = step->twoStages ? 1/(TOLERANCE_OF_STAGES*TOLERANCE_OF_STAGES) : 1;
    double ofSegments = NEWTON_TOLERANCE*NEWTON_TOLERANCE;
#ifdef CLOSED
    double perEnergy = 1/(step->kT+TINY_NUMBER);
#else
    double perEnergy = (step->free ? 0 : 1)*(1/(step->kT+TINY_NUMBER));
#endif
    for (int s = 0; s < step->segments; s++) {
        Vector here = loadVector(step, CHANGE, s), difference = loadVector(step, CHANGE, s+1)-here;
        double inverse = 1/PROPERTY(REST_LENGTH, s), square = product(difference, difference);
        double moved = product(here, here)*(ofSegments/(NODE_TOLERANCE*NODE_TOLERANCE));
        double ratio = fmax(square, moved)*(inverse*inverse*(tighter/ofSegments));
        double error = square*inverse*(0.5/LENGTH_TOLERANCE);
        double ofLength = step->kT > 0 ? error*error*FIELD(RESPONSE, s)*perEnergy*tighter : 0;
        // fmax() would take NaN for less than any number.
        if (!(square < 1e300) || !(ratio < 1) || !(ofLength < 1))
            return true;
    }
    return false;
}

/** Whether a segment has changed by more than a step may, or has left the range of its potential. */
DEVICE bool hasChangedTooMuch(const Step* step) {
    for (int s = 0; s < step->segments; s++) {
        Vector before = loadVector(step, DIFFERENCE, s);
        Vector change = loadVector(step, NODE, s+1)-loadVector(step, NODE, s), after = before+change;
        double l0 = PROPERTY(REST_LENGTH, s);
#ifdef BENDING_BondDifference
        double excess = sqrt(product(before, before)*product(after, after))*LEAST_COSINE-product(before, after);
        if (!(excess < 0))
            return true;
#else
        if (!(0.5*product(change, change) < l0*l0))
            return true;
#endif
#ifdef STRETCHING_FENE
        if (!(fabs((sqrt(product(after, after))-l0)*PROPERTY(INVERSE_EXTENSION, s)) < 1))
            return true;
#endif
    }
    return false;
}

/** Solve the equations of a stage by Newton's method; returns whether they are solved. */
DEVICE bool solveStage(const Step* step) {
    bool needsThree = step->stage == ONLY_STAGE || step->flowVaries;
    int least = needsThree ? 3 : step->stage == FIRST_STAGE ? 2 : 1;
    for (int iteration = 0; iteration < NEWTON_ITERATIONS; iteration++) {
        bool isFirst = iteration == 0 && step->stage != SECOND_STAGE;
        bool mayStiffen = isFirst && step->kT > 0, again = true;
        while (again) {
            eliminate(step, iteration < ITERATIONS_WITH_COMPRESSION);
            substitute(step, false);
            again = mayStiffen && stiffenTautSegments(step);
            mayStiffen = false;
        }
        if (!isFirst)
            refine(step);
        else if (step->kT > 0)
            addMetricForces(step);
        for (int node = 0; node < step->nodes; node++)
            addVector(step, NODE, node, loadVector(step, CHANGE, node));
#ifndef CLOSED
        if (step->free)
            rebuild(step, false);
#endif
        if (iteration+1 >= least && !isUnfinished(step))
            return true;
    }
    return false;
}

/** Take a step, or a part of one; returns whether its equations are solved, and no segment has changed too much. */
DEVICE bool takePart(Step* step, GLOBAL const double* forces, bool divided) {
    Vector first = positionOf(step, 0)+loadVector(step, MOVED, 0);
    if (step->hasFlow)
        beginFlow(step, first);
    describeStart(step, forces, divided);
    if (step->kT > 0)
        drawNoise(step);
    bool solved = true;
    for (int stage = 0; stage < (step->twoStages ? 2 : 1); stage++) {
        step->stage = !step->twoStages ? ONLY_STAGE : stage == 0 ? FIRST_STAGE : SECOND_STAGE;
        prepareStage(step);
#ifndef CLOSED
        if (step->stage == SECOND_STAGE && step->free)
            extrapolate(step);
#endif
        if (step->hasFlow && step->free && step->stage != SECOND_STAGE)
            carryAlong(step, first);
        solved = solveStage(step) && solved;
    }
    return solved && !hasChangedTooMuch(step);
}

/**
 * Take a step, in as many parts as it needs; they follow the Brownian path of the step. MOVED is how far nodes move.
 *
 * @return the number of times that the step was divided, or -1 if it cannot be taken
 */
CALLED DEVICE int takeStep(Step* step, GLOBAL const double* forces) {
    const NoiseKey key = step->key;
    const double h = step->h;
    int division = 0;
    bool taken = false;
    for (; division <= LARGEST_DIVISION && !taken; division++) {
        step->h = h/(1<<division);
        step->key.level = key.level+division;
        for (int node = 0; node < step->nodes; node++)
            storeVector(step, MOVED, node, zeroVector());
        taken = true;
        for (int part = 0; part < (1<<division) && taken; part++) {
            step->key.step = (key.step<<division)+part;
            taken = takePart(step, forces, division > 0);
            for (int node = 0; node < step->nodes; node++) {
                Vector y = loadVector(step, NODE, node);
                addVector(step, MOVED, node, y);
                // Where no division helps, those of the whole step say which segment is at fault.
                if (division == 0)
                    storeVector(step, WHOLE, node, y);
            }
        }
    }
    step->h = h;
    step->key = key;
    if (!taken)
        for (int node = 0; node < step->nodes; node++)
            storeVector(step, MOVED, node, loadVector(step, WHOLE, node));
    return taken ? division-1 : -1;
}
