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

/** Give friction and its noise to segments that are taut, if wanted; returns whether any comes near to it. */
DEVICE bool stiffenTautSegments(const Step* step, bool wanted) {
    double greatest = 0;
    EACH(s, wanted ? step->segments : 0) {
        double2 rates = turningRates(step, s);
        greatest = fmax(greatest, rates.y/rates.x);
    }
    const bool any = greatestOfItems(step, greatest) > NEARLY_TAUT;
    int turn = 0;
    do {
        EACH_IN_TURN(s, any ? step->segments : 0, turn) {
            double2 rates = turningRates(step, s);
            double length = FIELD(LENGTH, s), extra = fmax(0.5*rates.y-rates.x, 0.0)*length*length;
            storeField(step, EXTRA, s, extra);
            Vector pair = loadVector(step, RANDOM_PAIR, s)*(sqrt(1+extra/(PROPERTY(ROTATIONAL, s)+TINY_NUMBER))-1);
            addVector(step, RANDOM, s, pair*-1.0);
            addVector(step, RANDOM, s+1, pair);
        }
        WAIT_FOR_ITEMS
    } while (++turn < NUM_TURNS);
    return any;
}

#ifndef CLOSED
/**
 * Give segments of a chain without fixed nodes other lengths, around the same mean of all nodes; those meant by the
 * equations, or those of REST.
 */
DEVICE void rebuild(const Step* step, bool toRest, bool wanted) {
    const int nodes = wanted ? step->nodes : 0;
    // How much further each node is from the one before it, and then, from where it was.
    EACH(node, nodes) {
        Vector further = zeroVector();
        if (node > 0) {
            int s = node-1;
            Vector difference = loadVector(step, DIFFERENCE, s)+
                    (loadVector(step, NODE, node)-loadVector(step, NODE, s));
            double length = fmax(product(loadVector(step, NEW_TANGENT, s), difference), 0.5*FIELD(LENGTH, s));
#ifdef STRETCHING_FENE
            double range = (1-1e-9)/(PROPERTY(INVERSE_EXTENSION, s)+TINY_NUMBER), l0 = PROPERTY(REST_LENGTH, s);
            length = fmax(fmin(length, l0+range), l0-range);
#endif
            if (toRest) {
                Vector rest = loadVector(step, REST, node);
                length = sqrt(product(rest, rest));
            }
            further = difference*(length/sqrt(product(difference, difference))-1);
        }
        storeVector(step, REST, node, further);
    }
    Vector mean = sumAlongChain(step, REST, nodes)*(1.0/step->nodes);
    EACH(node, nodes)
        addVector(step, NODE, node, loadVector(step, REST, node)-mean);
    WAIT_FOR_ITEMS
}

/** Begin the second stage where the noise of the first would have taken the chain, had it been that of the step. */
DEVICE void extrapolate(const Step* step, bool wanted) {
    const int nodes = wanted ? step->nodes : 0;
    EACH(node, nodes) {
        Vector rest = zeroVector();
        if (node > 0)
            rest = loadVector(step, NODE, node)-loadVector(step, NODE, node-1)+
                    loadVector(step, DIFFERENCE, node-1);
        storeVector(step, REST, node, rest);
    }
    WAIT_FOR_ITEMS
    EACH(node, nodes)
        storeVector(step, NODE, node, loadVector(step, NODE, node)*(1/NOISE_OF_FIRST));
    WAIT_FOR_ITEMS
    rebuild(step, true, wanted);
}
#endif

/** Begin the iteration where the flow carries the chain as a whole. */
DEVICE void carryAlong(const Step* step, Vector first) {
    double time = step->h*shareOfForces(step);
    Vector carried = flowAt(step, first+flowAt(step, first)*(0.5*time))*time;
    EACH(node, step->nodes)
        addVector(step, NODE, node, carried);
}

/** Whether the last iteration has changed too much for it to be the last, if wanted. NaN counts as such. */
DEVICE bool isUnfinished(const Step* step, bool wanted) {
    double tighter = step->twoStages ? 1/(TOLERANCE_OF_STAGES*TOLERANCE_OF_STAGES) : 1;
    double ofSegments = NEWTON_TOLERANCE*NEWTON_TOLERANCE;
#ifdef CLOSED
    double perEnergy = 1/(step->kT+TINY_NUMBER);
#else
    double perEnergy = (step->free ? 0 : 1)*(1/(step->kT+TINY_NUMBER));
#endif
    bool unfinished = false;
    EACH(s, wanted ? step->segments : 0) {
        Vector here = loadVector(step, CHANGE, s), difference = loadVector(step, CHANGE, s+1)-here;
        double inverse = 1/PROPERTY(REST_LENGTH, s), square = product(difference, difference);
        double moved = product(here, here)*(ofSegments/(NODE_TOLERANCE*NODE_TOLERANCE));
        double ratio = fmax(square, moved)*(inverse*inverse*(tighter/ofSegments));
        double error = square*inverse*(0.5/LENGTH_TOLERANCE);
        double ofLength = step->kT > 0 ? error*error*FIELD(RESPONSE, s)*perEnergy*tighter : 0;
        // fmax() would take NaN for less than any number.
        if (!(square < 1e300) || !(ratio < 1) || !(ofLength < 1)) {
            unfinished = true;
            break;
        }
    }
    return isTrueOfAny(step, unfinished);
}

/** Whether a segment has changed by more than a step may, or has left the range of its potential. */
DEVICE bool hasChangedTooMuch(const Step* step) {
    bool tooMuch = false;
    EACH(s, step->segments) {
        Vector before = loadVector(step, DIFFERENCE, s);
        Vector change = loadVector(step, NODE, s+1)-loadVector(step, NODE, s), after = before+change;
        double l0 = PROPERTY(REST_LENGTH, s);
#ifdef BENDING_BondDifference
        double excess = sqrt(product(before, before)*product(after, after))*LEAST_COSINE-product(before, after);
        tooMuch = tooMuch || !(excess < 0);
#else
        tooMuch = tooMuch || !(0.5*product(change, change) < l0*l0);
#endif
#ifdef STRETCHING_FENE
        tooMuch = tooMuch || !(fabs((sqrt(product(after, after))-l0)*PROPERTY(INVERSE_EXTENSION, s)) < 1);
#endif
    }
    return isTrueOfAny(step, tooMuch);
}

/** Solve the equations of a stage by Newton's method; returns whether they are solved. */
DEVICE bool solveStage(const Step* step) {
    bool needsThree = step->stage == ONLY_STAGE || step->flowVaries, solved = false;
    int least = needsThree ? 3 : step->stage == FIRST_STAGE ? 2 : 1, iteration = 0;
    do {
        bool isFirst = iteration == 0 && step->stage != SECOND_STAGE;
        bool mayStiffen = isFirst && step->kT > 0, again;
        do {
            eliminate(step, iteration < ITERATIONS_WITH_COMPRESSION);
            substitute(step, false, true);
            again = stiffenTautSegments(step, mayStiffen);
            mayStiffen = false;
        } while (again);
        refine(step, !isFirst);
        addMetricForces(step, isFirst && step->kT > 0);
        EACH(node, step->nodes)
            addVector(step, NODE, node, loadVector(step, CHANGE, node));
        WAIT_FOR_ITEMS
#ifndef CLOSED
        rebuild(step, false, step->free);
#endif
        iteration++;
        solved = !isUnfinished(step, iteration >= least) && iteration >= least;
    } while (iteration < NEWTON_ITERATIONS && !solved);
    return solved;
}

/** Take a step, or a part of one; returns whether its equations are solved, and no segment has changed too much. */
DEVICE bool takePart(Step* step, GLOBAL const double* forces, bool divided) {
    Vector first = positionOf(step, 0)+loadVector(step, MOVED, 0);
    if (step->hasFlow)
        beginFlow(step, first);
    describeStart(step, forces, divided);
    drawNoise(step);
    bool solved = true;
    int stage = 0;
    do {
        step->stage = !step->twoStages ? ONLY_STAGE : stage == 0 ? FIRST_STAGE : SECOND_STAGE;
        prepareStage(step);
#ifndef CLOSED
        extrapolate(step, step->stage == SECOND_STAGE && step->free);
#endif
        if (step->hasFlow && step->free && step->stage != SECOND_STAGE)
            carryAlong(step, first);
        WAIT_FOR_ITEMS
        solved = solveStage(step) && solved;
    } while (++stage < (step->twoStages ? 2 : 1));
    bool tooMuch = hasChangedTooMuch(step);
    return solved && !tooMuch;
}

/**
 * Take a step, in as many parts as it needs; they follow the Brownian path of the step. MOVED is how far nodes move.
 *
 * @return the number of times that the step was divided, or -1 if it cannot be taken
 */
DEVICE int takeStep(Step* step, GLOBAL const double* forces) {
    const NoiseKey key = step->key;
    const double h = step->h;
    int division = 0;
    bool taken;
    do {
        const int parts = 1<<division;
        step->h = h/parts;
        step->key.level = key.level+division;
        EACH(node, step->nodes)
            storeVector(step, MOVED, node, zeroVector());
        WAIT_FOR_ITEMS
        int part = 0;
        do {
            step->key.step = (key.step<<division)+part;
            taken = takePart(step, forces, division > 0);
            EACH(node, step->nodes) {
                Vector y = loadVector(step, NODE, node);
                addVector(step, MOVED, node, y);
                // Where no division helps, those of the whole step say which segment is at fault.
                if (division == 0)
                    storeVector(step, WHOLE, node, y);
            }
            WAIT_FOR_ITEMS
        } while (++part < parts && taken);
    } while (++division <= LARGEST_DIVISION && !taken);
    step->h = h;
    step->key = key;
    if (!taken)
        EACH(node, step->nodes)
            storeVector(step, MOVED, node, loadVector(step, WHOLE, node));
    WAIT_FOR_ITEMS
    return taken ? division-1 : -1;
}
