/**
 * The forces and energies of chains at the positions of their nodes: see dynamics/ExplicitLoops-inl.h and
 * dynamics/coordinates.
 */

#ifndef CHAIN_BY_GROUP
inline DEVICE void addTo(const Step* step, GLOBAL double* RESTRICT forces, int node, Vector force) {
    const int place = 3*(node%step->own);
    forces[place] += force.x;
    forces[place+1] += force.y;
    forces[place+2] += force.z;
}

/** Find the forces of a chain on its nodes, and its energies. */
DEVICE void findForces(const Step* step, GLOBAL double* RESTRICT forces, GLOBAL double* RESTRICT energies) {
    double stretching = 0, bending = 0, ofTethers = 0;
    for (int k = 0; k < 3*step->own; k++)
        forces[k] = 0;
    Vector tangentBefore = zeroVector(), before = zeroVector();
    double inverseBefore = 0;
    for (int s = 0; s < step->nodes-1; s++) {
        Vector difference = positionOf(step, s+1)-positionOf(step, s);
        if (step->periodic)
            difference = nearestImage(difference, step->box);
        double length = sqrt(product(difference, difference)), inverse = 1/length;
        Vector t = difference*inverse;
        if (s > 0) {
            double stiffness = PROPERTY(JOINT, s);
#ifdef BENDING_BondDifference
            Vector bend = difference-before, first = bend*stiffness, second = first;
            bending += 0.5*product(bend, first);
#else
            double c = product(tangentBefore, t);
            Vector normal = crossProduct(tangentBefore, t);
            double2 found = bendingSlopeAndEnergy(stiffness, c, product(normal, normal));
            Vector first = (t-tangentBefore*c)*(-found.x*inverseBefore);
            Vector second = (tangentBefore-t*c)*(found.x*inverse);
            bending += found.y;
#endif
            addTo(step, forces, s-1, first*-1.0);
            addTo(step, forces, s, first+second);
            addTo(step, forces, s+1, second*-1.0);
        }
        if (s < step->segments) {
            double2 found = tensionAndEnergy(PROPERTY(STIFFNESS, s), length-PROPERTY(REST_LENGTH, s),
                    PROPERTY(INVERSE_EXTENSION, s));
            stretching += found.y;
            addTo(step, forces, s, t*found.x);
            addTo(step, forces, s+1, t*-found.x);
            if (step->hasPropulsion) {
                Vector inPlane = inSpace(difference);
                Vector push = inPlane*(0.5*PROPERTY(PROPULSION, s)/sqrt(product(inPlane, inPlane)));
                addTo(step, forces, s, push);
                addTo(step, forces, s+1, push);
            }
        }
        tangentBefore = t;
        before = difference;
        inverseBefore = inverse;
    }
    for (int node = 0; node < step->own && step->hasTethers; node++)
        for (int number = step->firstTethers[node]; number < step->firstTethers[node+1]; number++) {
            GLOBAL const double* own = step->tethers+(size_t) number*NUM_TETHER_PROPERTIES;
            Vector d = positionOf(step, node)+step->shift-make_double3(own[0], own[1], own[2]);
            if (step->periodic)
                d = nearestImage(d, step->box);
            addTo(step, forces, node, d*-own[TETHER_STIFFNESS]);
            ofTethers += 0.5*own[TETHER_STIFFNESS]*product(d, d);
        }
    energies[STRETCHING_ENERGY] = stretching;
    energies[BENDING_ENERGY] = bending;
    energies[TETHER_ENERGY] = ofTethers;
}
#endif
