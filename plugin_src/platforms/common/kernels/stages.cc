/**
 * What an implicit step begins with: its segments, bends and tethers at the start, its noise, and what each of its
 * stages makes of these. See dynamics/ImplicitStages-inl.h, ImplicitNoise-inl.h and dynamics/coordinates.
 */

/** The coordinate of a length, and theta of the segment. */
inline DEVICE void describeLength(const Step* step, int s, double length) {
    double l0 = PROPERTY(REST_LENGTH, s);
#ifdef STRETCHING_FENE
    storeField(step, COORDINATE, s, stretchCoordinate(PROPERTY(INVERSE_EXTENSION, s), length-l0).x);
#else
    storeField(step, COORDINATE, s, length-l0);
#endif
    double stretchRate = step->h*PROPERTY(STIFFNESS, s)*l0*l0+TINY_NUMBER;
    double friction = PROPERTY(EXTENSIONAL, s)+step->nodeFriction*(0.25*l0*l0);
    storeField(step, THETA, s, fmax(0.5, 1-friction/stretchRate));
    storeField(step, RANDOM_COORDINATE, s, 0);
    storeField(step, RANDOM_TENSION, s, 0);
    storeField(step, MULTIPLIER, s, 0);
}

/** The bend of the joint between a segment and the one before it, and its theta. */
inline DEVICE void describeBend(const Step* step, int s) {
    storeVector(step, RANDOM_BEND, s, zeroVector());
#ifdef BENDING_BondDifference
    storeVector(step, BEND, s, loadVector(step, DIFFERENCE, s)-loadVector(step, DIFFERENCE, s-1));
    double inverse = 1/PROPERTY(REST_LENGTH, s);
    double friction = step->nodeFriction+4*inverse*inverse*PROPERTY(ROTATIONAL, s);
    double bendRate = 16*step->h*PROPERTY(JOINT, s)+TINY_NUMBER;
    storeField(step, JOINT_THETA, s, fmin(LARGEST_THETA_OF_LINEAR_BENDS, fmax(0.5, 1-friction/bendRate)));
#else
    Vector before = tangentAtStart(step, s-1), behind = tangentAtStart(step, s);
    Vector sum = before+behind, bent = behind-before;
    storeVector(step, BISECTOR, s, sum*(1/sqrt(product(sum, sum)+TINY_NUMBER)));
    storeVector(step, BEND, s, bent*bendFactor(product(bent, bent)).f);
    double l0 = PROPERTY(REST_LENGTH, s);
    double friction = fmin(PROPERTY(ROTATIONAL, s-1), PROPERTY(ROTATIONAL, s))+step->nodeFriction*(0.25*l0*l0);
    double bendRate = 4*step->h*PROPERTY(JOINT, s)+TINY_NUMBER;
    storeField(step, JOINT_THETA, s, fmax(0.5, 1-friction/bendRate));
#endif
}

inline DEVICE void describeTethers(const Step* step, int node, bool divided) {
    for (int number = step->firstTethers[node]; number < step->firstTethers[node+1]; number++) {
        GLOBAL double* tether = step->tetherMemory+(size_t) number*NUM_TETHER_FIELDS;
        Vector start = vectorOfTether(step, node, number);
        if (divided)
            start = start+loadVector(step, MOVED, node);
        double friction = step->nodeFriction;
        for (int side = node-1; side <= node; side++) {
#ifdef CLOSED
            int s = side < 0 ? step->segments-1 : side;
#else
            int s = side;
#endif
            if (s >= 0 && s < step->segments) {
                double length = PROPERTY(REST_LENGTH, s);
                friction += 0.25*PROPERTY(PARALLEL, s)+PROPERTY(EXTENSIONAL, s)/(length*length);
            }
        }
        double stiffness = step->tethers[(size_t) number*NUM_TETHER_PROPERTIES+TETHER_STIFFNESS];
        tether[TETHER_START] = start.x;
        tether[TETHER_START+1] = start.y;
        tether[TETHER_START+2] = start.z;
        tether[TETHER_THETA] = fmax(0.5, 1-friction/(step->h*stiffness+TINY_NUMBER));
        for (int k = 0; k < 3; k++)
            tether[TETHER_RANDOM+k] = 0;
    }
}

/** Describe the start of a step without noise, and its forces from outside. */
DEVICE void describeStart(const Step* step, GLOBAL const double* forces, bool divided) {
    EACH(node, step->nodes) {
        storeVector(step, NODE, node, zeroVector());
        storeVector(step, RANDOM, node, zeroVector());
        storeVector(step, METRIC, node, zeroVector());
        Vector force = zeroVector();
        if (node < step->own)
            force = inSpace(make_double3(forces[3*node], forces[3*node+1], forces[3*node+2]));
        storeVector(step, EXTERNAL, node, force);
    }
    WAIT_FOR_ITEMS
    int turn = 0;
    do {
        EACH_IN_TURN(s, step->nodes-1, turn) {
            Vector difference = vectorOfSegment(step, s);
            if (divided)
                difference = difference+loadVector(step, MOVED, s+1)-loadVector(step, MOVED, s);
            double length = sqrt(product(difference, difference));
            storeVector(step, DIFFERENCE, s, difference);
            storeField(step, LENGTH, s, length);
            storeField(step, INVERSE_LENGTH, s, 1/length);
            storeField(step, EXTRA, s, 0);
            storeVector(step, RANDOM_PAIR, s, zeroVector());
            if (s < step->segments) {
                if (step->hasPropulsion) {
                    Vector push = difference*(0.5*PROPERTY(PROPULSION, s)/length);
                    addVector(step, EXTERNAL, s, push);
                    addVector(step, EXTERNAL, s+1, push);
                }
                describeLength(step, s, length);
            }
        }
        WAIT_FOR_ITEMS
    } while (++turn < NUM_TURNS);
    EACH(node, step->nodes) {
        if (node > 0 && node < step->nodes-1)
            describeBend(step, node);
        if (step->hasTethers && node < step->own)
            describeTethers(step, node, divided);
        if (step->hasFlow)
            storeVector(step, PLACE, node, node == 0 ? positionOf(step, 0)+loadVector(step, MOVED, 0) :
                    loadVector(step, DIFFERENCE, node-1));
    }
    sumAlongChain(step, PLACE, step->hasFlow ? step->nodes : 0);
    WAIT_FOR_ITEMS
}

#ifndef BENDING_BondDifference
/** Draw a bend from the equilibrium of a joint whose stiffness is k k_B T. */
inline DEVICE Vector drawBendInSpace(const Step* step, int s, double k) {
    double a, b;
    Candidate candidate = firstCandidate(step->key, NOISE_BEND, step->chain, s);
    if (k > STIFF_JOINT) {
        for (unsigned int draw = 1; candidate.uniform > bendMeasure(
                (candidate.first*candidate.first+candidate.second*candidate.second)/k); draw++)
            candidate = nextCandidate(step->key, NOISE_BEND, step->chain, s, draw);
        double deviation = 1/sqrt(k);
        a = candidate.first*deviation;
        b = candidate.second*deviation;
    }
    else {
        double2 uniforms;
        double square;
        unsigned int draw = 1;
        do {
            uniforms = drawUniforms(step->key, NOISE_BEND, step->chain, s, draw++);
            square = bendSquare(2*uniforms.x-1);
        } while (uniforms.y > exp(-0.5*k*square));
        double scale = sqrt(square/(candidate.first*candidate.first+candidate.second*candidate.second));
        a = candidate.first*scale;
        b = candidate.second*scale;
    }
    // Two vectors across the bisector and each other: Duff et al., J. Comput. Graph. Tech. 2017, 6, 1.
    Vector n = loadVector(step, BISECTOR, s);
    double sign = n.z < 0 ? -1 : 1, c = -1/(sign+n.z), d = n.x*n.y*c;
    Vector e1 = make_double3(1+sign*n.x*n.x*c, sign*d, -sign*n.x), e2 = make_double3(d, sign+n.y*n.y*c, -n.y);
    return e1*a+e2*b;
}

/** The same in a plane, where a bend has one component, and its angle a uniform measure. */
inline DEVICE Vector drawBendInPlane(const Step* step, int s, double k) {
    bool stiff = k*LEAST_BEND_SQUARE > STIFF_JOINT;
    Candidate candidate = firstCandidate(step->key, NOISE_BEND, step->chain, s);
    double bend = 0;
    for (unsigned int draw = 1;; draw++) {
        double angle = candidate.first/sqrt(k*LEAST_BEND_SQUARE);
        if (!stiff) {
            double2 uniforms = drawUniforms(step->key, NOISE_BEND, step->chain, s, draw);
            angle = PI*(2*uniforms.x-1);
            candidate.uniform = uniforms.y;
        }
        bend = bendOfAngle(angle);
        double excess = bend*bend-(stiff ? LEAST_BEND_SQUARE*angle*angle : 0);
        if (fabs(angle) < PI && candidate.uniform <= exp(-0.5*k*excess))
            break;
        if (stiff)
            candidate = nextCandidate(step->key, NOISE_BEND, step->chain, s, draw);
    }
    Vector n = loadVector(step, BISECTOR, s);
    return make_double3(-n.y*bend, n.x*bend, 0);
}
#endif

/** Draw the random forces of a segment, which belong to its friction. */
inline DEVICE void drawForces(const Step* step, int s, double4 first, double4 second, double amplitude) {
    Vector t = tangentAtStart(step, s), a = inSpace(make_double3(first.x, first.y, first.z));
    Vector b = inSpace(make_double3(first.w, second.x, second.y));
    double across = sqrt(PROPERTY(PERPENDICULAR, s)), along = sqrt(PROPERTY(PARALLEL, s));
    double perLength = amplitude*FIELD(INVERSE_LENGTH, s);
    Vector force = (a*across+t*((along-across)*product(t, a)))*(0.5*amplitude);
    Vector pair = (b-t*product(t, b))*(sqrt(PROPERTY(ROTATIONAL, s))*perLength);
    addVector(step, RANDOM, s, force-pair);
    addVector(step, RANDOM, s+1, force+pair);
    storeVector(step, RANDOM_PAIR, s, pair);
    storeField(step, RANDOM_TENSION, s, product(t, b)*(sqrt(PROPERTY(EXTENSIONAL, s))*perLength));
}

/** Draw the coordinate of a length, given a normal number. */
inline DEVICE double drawLength(const Step* step, int s, double normal) {
    double stiffness = PROPERTY(STIFFNESS, s);
#ifdef STRETCHING_FENE
    // See drawFeneCoordinates() in lanes/NoiseLoops-inl.h.
    double inverse = PROPERTY(INVERSE_EXTENSION, s);
    double deviation = 1/sqrt(stiffness/(inverse*inverse*step->kT+TINY_NUMBER)+1.5);
    Words words = drawWords(step->key.seed, step->key.level, step->key.step, NOISE_LENGTH, step->chain, s, 0);
    double uniform = uniformOf(words.w2, words.w3), x = normal*deviation, y = 0.5*x*x;
    if (uniform > 1-y*y*(1.0/12))
        for (unsigned int draw = 1; uniform > sqrt(y/sinh(y)); draw++) {
            Candidate candidate = nextCandidate(step->key, NOISE_LENGTH, step->chain, s, draw);
            uniform = candidate.uniform;
            x = candidate.first*deviation;
            y = 0.5*x*x;
        }
    return x/(inverse+TINY_NUMBER);
#else
    return normal*sqrt(step->kT/(stiffness+TINY_NUMBER));
#endif
}

inline DEVICE void drawTethers(const Step* step, int node) {
    for (int number = step->firstTethers[node]; number < step->firstTethers[node+1]; number++) {
        GLOBAL const double* own = step->tethers+(size_t) number*NUM_TETHER_PROPERTIES;
        double deviation = sqrt(step->kT/(own[TETHER_STIFFNESS]+TINY_NUMBER));
        double4 n = drawNormals(step->key, NOISE_TETHER, step->chain, (unsigned int) own[TETHER_NUMBER], 0);
        Vector random = inSpace(make_double3(n.x, n.y, n.z)*deviation);
        GLOBAL double* tether = step->tetherMemory+(size_t) number*NUM_TETHER_FIELDS;
        tether[TETHER_RANDOM] = random.x;
        tether[TETHER_RANDOM+1] = random.y;
        tether[TETHER_RANDOM+2] = random.z;
    }
}

/** Draw the noise of a step, if there is any. */
DEVICE void drawNoise(const Step* step) {
    const int nodes = step->kT > 0 ? step->nodes : 0;
    double amplitude = sqrt(2*step->kT/step->h);
    int turn = 0;
    do {
        EACH_IN_TURN(s, nodes, turn) {
            double4 node = make_double4(0, 0, 0, 0);
            bool hasForce = step->nodeFriction > 0 && s < step->own;
#ifndef BENDING_BondDifference
            if (hasForce)
#endif
                node = drawNormals(step->key, NOISE_NODE, step->chain, s, 0);
            if (hasForce)
                addVector(step, RANDOM, s, inSpace(make_double3(node.x, node.y, node.z))*
                        (sqrt(step->nodeFriction)*amplitude));
            if (s < step->segments) {
                double normal = node.w;
                if (step->hasSegmentFriction) {
                    double4 first = drawNormals(step->key, NOISE_SEGMENT, step->chain, s, 0);
                    double4 second = drawNormals(step->key, NOISE_SEGMENT, step->chain, s, 1);
                    drawForces(step, s, first, second, amplitude);
                    normal = second.z;
                }
                storeField(step, RANDOM_COORDINATE, s, drawLength(step, s, normal));
            }
            if (s > 0 && s < step->nodes-1 && PROPERTY(JOINT, s) != 0) {
                double joint = PROPERTY(JOINT, s);
#ifdef BENDING_BondDifference
                double4 n = drawNormals(step->key, NOISE_NODE, step->chain, s, 1);
                storeVector(step, RANDOM_BEND, s, inSpace(make_double3(n.x, n.y, n.z))*
                        sqrt(step->kT/(joint+TINY_NUMBER)));
#else
                if (step->twoStages || FIELD(JOINT_THETA, s) != 0.5) {
#ifdef PLANAR
                    storeVector(step, RANDOM_BEND, s, drawBendInPlane(step, s, joint/step->kT));
#else
                    storeVector(step, RANDOM_BEND, s, drawBendInSpace(step, s, joint/step->kT));
#endif
                }
#endif
            }
            if (step->hasTethers && s < step->own)
                drawTethers(step, s);
        }
        WAIT_FOR_ITEMS
    } while (++turn < NUM_TURNS);
}

inline DEVICE void prepareLength(const Step* step, int s) {
    double theta = FIELD(THETA, s);
    if (step->stage == FIRST_STAGE) {
        storeField(step, IMPLICIT, s, DIAGONAL);
        storeField(step, CONSTANT_COORDINATE, s, -DIAGONAL*NOISE_OF_FIRST*FIELD(RANDOM_COORDINATE, s));
        storeField(step, CONSTANT_TENSION, s, -NOISE_OF_FIRST*FIELD(RANDOM_TENSION, s));
        return;
    }
    storeField(step, IMPLICIT, s, theta);
    storeField(step, CONSTANT_COORDINATE, s,
            (1-theta)*FIELD(COORDINATE, s)-FIELD(RANDOM_COORDINATE, s)*sqrt(2*theta-1));
    storeField(step, CONSTANT_TENSION, s, -FIELD(RANDOM_TENSION, s));
    if (step->stage == SECOND_STAGE)
        storeField(step, MULTIPLIER, s, FIELD(MULTIPLIER, s)*(1/NOISE_OF_FIRST));
}

inline DEVICE void prepareBend(const Step* step, int s) {
    Vector random = loadVector(step, RANDOM_BEND, s), offset = zeroVector();
    double theta = FIELD(JOINT_THETA, s), turning = 0;
    if (step->stage == ONLY_STAGE) {
        offset = loadVector(step, BEND, s)*(1-theta);
        turning = sqrt(2*theta-1);
    }
    else if (step->stage == FIRST_STAGE)
        turning = DIAGONAL*NOISE_OF_FIRST;
    else {
#ifdef BENDING_BondDifference
        Vector here = loadVector(step, NODE, s);
        Vector before = loadVector(step, DIFFERENCE, s-1)+here-loadVector(step, NODE, s-1);
        Vector bent = loadVector(step, DIFFERENCE, s)+loadVector(step, NODE, s+1)-here-before;
        offset = bent*(1-DIAGONAL);
#else
        Vector bent = loadVector(step, NEW_TANGENT, s)-loadVector(step, NEW_TANGENT, s-1);
        offset = bent*(bendFactor(product(bent, bent)).f*(1-DIAGONAL));
#endif
        turning = 2*DIAGONAL;
    }
    storeField(step, JOINT_IMPLICIT, s, step->stage == ONLY_STAGE ? theta : DIAGONAL);
    storeVector(step, CONSTANT_BEND, s, offset);
    storeVector(step, TURNING_BEND, s, random*turning);
}

inline DEVICE void prepareTethers(const Step* step, int node) {
    Vector moved = loadVector(step, NODE, node);
    for (int number = step->firstTethers[node]; number < step->firstTethers[node+1]; number++) {
        GLOBAL double* tether = step->tetherMemory+(size_t) number*NUM_TETHER_FIELDS;
        Vector start = make_double3(tether[TETHER_START], tether[TETHER_START+1], tether[TETHER_START+2]);
        Vector random = make_double3(tether[TETHER_RANDOM], tether[TETHER_RANDOM+1], tether[TETHER_RANDOM+2]);
        Vector offset = start-random*sqrt(2*tether[TETHER_THETA]-1);
        if (step->stage == FIRST_STAGE)
            offset = (start-random*NOISE_OF_FIRST)*DIAGONAL;
        else if (step->stage == SECOND_STAGE)
            offset = start+moved*(1-DIAGONAL)-random*(2*DIAGONAL);
        tether[TETHER_IMPLICIT] = step->stage == ONLY_STAGE ? tether[TETHER_THETA] : DIAGONAL;
        tether[TETHER_CONSTANT] = offset.x;
        tether[TETHER_CONSTANT+1] = offset.y;
        tether[TETHER_CONSTANT+2] = offset.z;
    }
}

/** Describe a stage. The second one begins with the end of the first. */
DEVICE void prepareStage(const Step* step) {
    if (step->stage == SECOND_STAGE) {
        EACH(s, step->nodes-1) {
            Vector difference = loadVector(step, DIFFERENCE, s)+loadVector(step, NODE, s+1)-loadVector(step, NODE, s);
            storeVector(step, NEW_TANGENT, s, difference*(1/sqrt(product(difference, difference))));
        }
    }
    WAIT_FOR_ITEMS
    EACH(s, step->nodes) {
        if (s < step->segments)
            prepareLength(step, s);
        if (s > 0 && s < step->nodes-1)
            prepareBend(step, s);
        if (step->hasTethers && s < step->own)
            prepareTethers(step, s);
    }
    WAIT_FOR_ITEMS
}
