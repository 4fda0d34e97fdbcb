#include "networks/BodyStep.h"
#include "lanes/Noise.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/BodyEquations.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace cylchain::BodyEquations;
using namespace std;

namespace {

/** A change that is left out may do this much work, in k_B T. */
const double LEAST_WORK = 1e-5;
/** Without noise, as if k_B T were this much, in kJ/mol. */
const double COLD = 1e-3;
/** The largest turn of an iteration, and that of a step in which something holds a body off its centre, in rad. */
const double LARGEST_TURN_OF_ITERATION = 1, LARGEST_TURN_OF_STEP = 6;
const double UNITY[] = {1, 0, 0, 1, 0, 1};
/** Of forces on places: what less of them does to a body is lost. */
const double LEAST_SHARE_OF_FORCES = 1e-12;

/** Add the products of a force with its place in the frame of the body, row by row. */
void addProducts(const double* force, const double* place, double* products) {
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            products[3*row+column] += force[row]*place[column];
}

/** Find the torque of forces with such products. */
void findTorque(const double* products, const RigidFrame& frame, double* torque) {
    double turned[9];
    for (int row = 0; row < 3; row++)
        frame.turn(products+3*row, turned+3*row);
    torque[0] = turned[7]-turned[5];
    torque[1] = turned[2]-turned[6];
    torque[2] = turned[3]-turned[1];
}

/** Find the sum of F.a of such forces. */
double traceOfProducts(const double* products, const RigidFrame& frame) {
    double sum = 0;
    for (int row = 0; row < 3; row++)
        for (int k = 0; k < 3; k++)
            sum += products[3*row+k]*frame.rotation[3*row+k];
    return sum;
}

/** The square root of a symmetric, positive definite matrix that is a triangle: times a vector. */
void multiplyByRoot(const double* m, const double* v, double* result) {
    const double xx = sqrt(m[0]), yx = m[1]/xx, zx = m[2]/xx, yy = sqrt(m[3]-yx*yx), zy = (m[4]-zx*yx)/yy,
            zz = sqrt(m[5]-zx*zx-zy*zy);
    result[0] = xx*v[0];
    result[1] = yx*v[0]+yy*v[1];
    result[2] = zx*v[0]+zy*v[1]+zz*v[2];
}

} // namespace

BodyStep::BodyStep(const vector<RigidBody>& bodies) : bodies(bodies), states(bodies.size()),
        right(6*bodies.size()), found(6*bodies.size()) {
    for (const RigidBody& own : bodies)
        finders.emplace_back(own);
}

void BodyStep::begin(const double* newPositions, const double* forces, const double*, const StepSettings& newSettings,
        const bool* taken) {
    settings = newSettings;
    positions = newPositions;
    joints.clear();
    going.clear();
    for (size_t i = 0; i < bodies.size(); i++) {
        State& body = states[i];
        body.taken = taken[i];
        if (!body.taken) {
            fill_n(body.inverse, 36, 0.0);
            fill_n(body.change, 6, 0.0);
            continue;
        }
        going.push_back(i);
        body = State();
        body.taken = true;
        body.start = body.now = finders[i].find(bodies[i], positions);
        sumForces(bodies[i], forces, body);
        if (settings.flow.present)
            describeFlow(bodies[i], body);
    }
    drawNoise();
}

void BodyStep::sumForces(const RigidBody& own, const double* forces, State& body) const {
    for (size_t i = 0; i < own.particles.size(); i++) {
        const double* const force = forces+3*own.particles[i];
        for (int k = 0; k < 3; k++)
            body.force[k] += force[k];
        addProducts(force, &own.places[3*i], body.moments);
    }
}

/** The velocity half-way, so that bodies keep to closed streamlines, and half the curl. */
void BodyStep::describeFlow(const RigidBody& own, State& body) const {
    double halfway[3], velocity[3];
    settings.flow.getVelocity(body.start.centre, velocity);
    for (int k = 0; k < 3; k++)
        halfway[k] = body.start.centre[k]+(own.planar && k == 2 ? 0 : 0.5*settings.stepSize*velocity[k]);
    settings.flow.getVelocity(halfway, velocity);
    const double* const gradient = settings.flow.gradient;
    const double curl[] = {gradient[7]-gradient[5], gradient[2]-gradient[6], gradient[3]-gradient[1]};
    for (int k = 0; k < 3; k++) {
        body.drift[k] = settings.stepSize*velocity[k];
        body.spin[k] = 0.5*settings.stepSize*curl[k];
    }
}

void BodyStep::drawNoise() {
    // The first particle has the noise of the motion, the second that of the turn.
    const size_t count = 2*bodies.size();
    vector<uint32_t> noChains(count, 0), parts(count);
    vector<double> normals(4*count);
    for (size_t i = 0; i < count; i++)
        parts[i] = bodies[i/2].particles[i%2];
    drawNormals({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step}, NoiseKind::Particle,
            noChains.data(), parts.data(), count, normals.data());
    const double amplitude = sqrt(2*settings.kT/settings.stepSize);
    for (size_t i = 0; i < bodies.size(); i++) {
        const double* const own = &normals[8*i];
        multiplyByRoot(bodies[i].rotationalFriction, own+4, states[i].randomTorque);
        for (int k = 0; k < 3; k++) {
            states[i].randomForce[k] = amplitude*sqrt(bodies[i].friction)*own[k];
            states[i].randomTorque[k] *= amplitude;
        }
    }
}

/** Find the friction against turning, and the noise of it, in a frame half-way between those before and now. */
void BodyStep::describeHalfway(const RigidBody& own, State& body) const {
    double half[3];
    GibbsVector::halve(body.turned, half);
    RigidFrame halfway;
    GibbsVector::turn(half, body.start, halfway);
    halfway.turnMatrix(own.rotationalFriction, body.rotationalFriction);
    halfway.turn(body.randomTorque, body.turnedRandomTorque);
}

/** Add the friction of a body, over the length of the step. */
void BodyStep::addFriction(const RigidBody& own, const State& body, double* matrix) const {
    addBlock(UNITY, own.friction/settings.stepSize, 0, matrix);
    addBlock(body.rotationalFriction, 1/settings.stepSize, 3, matrix);
}

/** Find where places are against centres now. */
void BodyStep::findArms() {
    arms.resize(3*(size_t) numTerms);
    for (int i = 0; i < numTerms; i++)
        states[terms[i].lane].now.turn(&bodies[terms[i].lane].places[3*terms[i].node], &arms[3*i]);
}

void BodyStep::eliminate(const CouplingTerm* newTerms, int count, double* moves) {
    terms = newTerms;
    numTerms = count;
    for (int i : going) {
        states[i].held = false;
        fill_n(states[i].pulls, 9, 0.0);
    }
    for (int i = 0; i < numTerms; i++) {
        const double* const place = &bodies[terms[i].lane].places[3*terms[i].node];
        states[terms[i].lane].held |= dot(place, place) > 0;
    }
    for (int i : going) {
        State& body = states[i];
        if (settings.bodyTorques != NULL)
            copy_n(settings.bodyTorques+3*i, 3, body.frameTorque);
        if (!body.held)
            turnFreely(bodies[i], body);
        describeHalfway(bodies[i], body);
    }
    findArms();
    // Those before the first iteration are of another step.
    for (int i = 0; i < numTerms; i++)
        if (State& body = states[terms[i].lane]; body.settled)
            addProducts(expectedForces+3*i, &bodies[terms[i].lane].places[3*terms[i].node], body.pulls);
    findMetricTorques();
    knowsProjections = false;
    for (int i : going) {
        State& body = states[i];
        setRight(bodies[i], body, &right[6*i]);
        fill_n(body.matrix, 36, 0.0);
        addFriction(bodies[i], body, body.matrix);
        // As the body turns, so do the arms of forces: what makes these longer is left out.
        addBlock(UNITY, 0.5*max(0.0, traceOfProducts(body.pulls, body.now)), 3, body.matrix);
    }
    for (int i = 0; i < numTerms; i++) {
        addStiffness(terms[i].stiffness, &arms[3*i], states[terms[i].lane].matrix);
        addForce(terms[i].force, &arms[3*i], &right[6*terms[i].lane]);
    }
    for (int i : going) {
        State& body = states[i];
        invertSix(body.matrix, bodies[i].planar, body.held, body.inverse);
        multiplySix(body.inverse, &right[6*i], body.change);
    }
    gatherMoves(moves);
}

/** What is left of the balance of forces and torques, without the forces of couplings. */
void BodyStep::setRight(const RigidBody& own, const State& body, double* result) const {
    double lag[3], drag[3];
    for (int k = 0; k < 3; k++)
        lag[k] = (body.turned[k]-body.spin[k])/settings.stepSize;
    multiply(body.rotationalFriction, lag, drag);
    // Forces have the mean of the arms before and now. Those of couplings are to have the arm of now in the equations,
    // which are consistent then: forces that an iteration finds because turns are no shifts vanish in the next one.
    double before[3], now[3], pullsBefore[3], pullsNow[3];
    findTorque(body.moments, body.start, before);
    findTorque(body.moments, body.now, now);
    findTorque(body.pulls, body.start, pullsBefore);
    findTorque(body.pulls, body.now, pullsNow);
    for (int k = 0; k < 3; k++) {
        result[k] = body.force[k]+body.randomForce[k]-own.friction/settings.stepSize*(body.moved[k]-body.drift[k]);
        result[3+k] = 0.5*(before[k]+now[k]+pullsBefore[k]-pullsNow[k])+body.turnedRandomTorque[k]-drag[k]+
                body.metricTorque[k]+body.frameTorque[k];
    }
}

/** Turn a body that nothing holds off its centre. */
void BodyStep::turnFreely(const RigidBody& own, State& body) const {
    double torque[3], friction[6], random[3];
    body.start.turn(body.randomTorque, random);
    body.start.turnMatrix(own.rotationalFriction, friction);
    findTorque(body.moments, body.start, torque);
    for (int k = 0; k < 3; k++)
        torque[k] += random[k]+body.frameTorque[k];
    double matrix[36] = {}, inverse[36], all[6] = {}, vector[6];
    addBlock(UNITY, 1, 0, matrix);
    addBlock(friction, 1/settings.stepSize, 3, matrix);
    copy_n(torque, 3, all+3);
    invertSix(matrix, own.planar, true, inverse);
    multiplySix(inverse, all, vector);
    for (int k = own.planar ? 2 : 0; k < 3; k++)
        vector[3+k] += body.spin[k];
    GibbsVector::fromRotationVector(vector+3, body.turned);
    GibbsVector::turn(body.turned, body.start, body.now);
}

void BodyStep::setJointStiffness(const double* stiffness) {
    joints.assign(terms, terms+numTerms);
    for (int i = 0; i < numTerms; i++)
        copy_n(stiffness+6*i, 6, joints[i].stiffness);
    for (State& body : states)
        body.settled = false;
}

/** Find how forces and torques on bodies are those of forces on their places, of which these are the least. */
void BodyStep::findProjections() {
    for (int i : going)
        fill_n(states[i].projection, 36, 0.0);
    for (int i = 0; i < numTerms; i++)
        addStiffness(UNITY, &arms[3*i], states[terms[i].lane].projection);
    for (int i : going) {
        double* const own = states[i].projection;
        double regular[36];
        const double lengths[] = {own[0], own[21]+own[28]+own[35]};
        copy_n(own, 36, regular);
        for (int k = 0; k < 6; k++)
            regular[7*k] += LEAST_SHARE_OF_FORCES*(lengths[k/3]+(lengths[k/3] > 0 ? 0 : 1));
        invertSix(regular, own);
    }
    knowsProjections = true;
}

/** Take off what forces of places of a body against each other do not move it by. */
template <class Number> void BodyStep::project(Number* onPlaces) {
    if (!knowsProjections)
        findProjections();
    gatherForces(onPlaces);
    for (int i : going)
        multiplySix(states[i].projection, &right[6*i], &found[6*i]);
    for (int i = 0; i < numTerms; i++) {
        double force[3];
        findMove(&found[6*terms[i].lane], &arms[3*i], force);
        for (int k = 0; k < 3; k++)
            onPlaces[TermBlocks::place(i, k)] = force[k];
    }
}

void BodyStep::keepWhatMoves(double* onPlaces) {
    project(onPlaces);
}

void BodyStep::keepWhatMoves(float* onPlaces) {
    project(onPlaces);
}

void BodyStep::findMetricTorques() {
    if (joints.empty())
        return;
    vector<double> matrices(36*bodies.size());
    vector<double> halfway(3*joints.size());
    for (int i : going) {
        fill_n(states[i].metricTorque, 3, 0.0);
        addFriction(bodies[i], states[i], &matrices[36*i]);
    }
    for (size_t i = 0; i < joints.size(); i++) {
        const CouplingTerm& joint = joints[i];
        const double* const place = &bodies[joint.lane].places[3*joint.node];
        double before[3], now[3];
        states[joint.lane].start.turn(place, before);
        states[joint.lane].now.turn(place, now);
        for (int k = 0; k < 3; k++)
            halfway[3*i+k] = 0.5*(before[k]+now[k]);
        addStiffness(joint.stiffness, &halfway[3*i], &matrices[36*joint.lane]);
    }
    for (int i : going) {
        double inverse[36];
        invertSix(&matrices[36*i], bodies[i].planar, states[i].held, inverse);
        copy_n(inverse, 36, &matrices[36*i]);
    }
    for (size_t i = 0; i < joints.size(); i++) {
        const double* const k = joints[i].stiffness;
        double c[6];
        findCompliance(&matrices[36*joints[i].lane], &halfway[3*i], c);
        const double a[] = {k[1]*c[2]+k[3]*c[4]+k[4]*c[5]-c[1]*k[2]-c[3]*k[4]-c[4]*k[5],
                k[2]*c[0]+k[4]*c[1]+k[5]*c[2]-c[2]*k[0]-c[4]*k[1]-c[5]*k[2],
                k[0]*c[1]+k[1]*c[3]+k[2]*c[4]-c[0]*k[1]-c[1]*k[3]-c[2]*k[4]};
        for (int axis = 0; axis < 3; axis++)
            states[joints[i].lane].metricTorque[axis] += settings.kT*a[axis];
    }
}

/** Find how places move from the changes of bodies. */
void BodyStep::gatherMoves(double* moves) const {
    for (int i = 0; i < numTerms; i++) {
        double move[3];
        findMove(states[terms[i].lane].change, &arms[3*i], move);
        for (int k = 0; k < 3; k++)
            moves[TermBlocks::place(i, k)] = move[k];
    }
}

/** Find the forces on bodies from those on places. */
template <class Number> void BodyStep::gatherForces(const Number* onPlaces) {
    fill(right.begin(), right.end(), 0.0);
    for (int i = 0; i < numTerms; i++) {
        double force[3];
        for (int k = 0; k < 3; k++)
            force[k] = onPlaces[TermBlocks::place(i, k)];
        addForce(force, &arms[3*i], &right[6*terms[i].lane]);
    }
}

template <class Number> void BodyStep::respondAs(const Number* onPlaces, Number* moves) {
    gatherForces(onPlaces);
    for (int i : going)
        multiplySix(states[i].inverse, &right[6*i], &found[6*i]);
    for (int i = 0; i < numTerms; i++) {
        double move[3];
        findMove(&found[6*terms[i].lane], &arms[3*i], move);
        for (int k = 0; k < 3; k++)
            moves[TermBlocks::place(i, k)] = move[k];
    }
}

void BodyStep::respond(const double* onPlaces, double* moves) {
    respondAs(onPlaces, moves);
}

void BodyStep::respond(const float* onPlaces, float* moves) {
    respondAs(onPlaces, moves);
}

void BodyStep::findCompliances(double* compliances) {
    for (int i = 0; i < numTerms; i++)
        findCompliance(states[terms[i].lane].inverse, &arms[3*i], compliances+6*i);
}

void BodyStep::advance(const double* onPlaces, const ShareOfChange& share, bool* unfinished, double* moves) {
    if (onPlaces != NULL) {
        gatherForces(onPlaces);
        for (int i : going) {
            double added[6];
            multiplySix(states[i].inverse, &right[6*i], added);
            for (int k = 0; k < 6; k++)
                states[i].change[k] += added[k];
        }
        gatherMoves(moves);
    }
    fill_n(unfinished, bodies.size(), false);
    for (int i : going) {
        unfinished[i] = isUnfinished(states[i]);
        makeChange(states[i], share);
        states[i].settled = true;
    }
}

/** The equations of a body that nothing holds off its centre are linear. */
bool BodyStep::isUnfinished(const State& body) const {
    if (!body.held)
        return false;
    if (!body.settled)
        return true;
    double forces[6], work = 0;
    multiplySix(body.matrix, body.change, forces);
    for (int k = 0; k < 6; k++)
        work += forces[k]*body.change[k];
    // What comes after this change is less by the turn, and by the part of the equations that is left out.
    const double less = min(1.0, sqrt(dot(body.turned, body.turned))+sqrt(dot(body.change+3, body.change+3)));
    return !(work*less*less < LEAST_WORK*max(settings.kT, COLD));
}

void BodyStep::makeChange(State& body, const ShareOfChange& share) const {
    for (int k = 0; k < 3; k++)
        body.moved[k] += share.part*body.change[k];
    if (!body.held)
        return;
    double turn[3];
    copy_n(body.change+3, 3, turn);
    const double angle = sqrt(dot(turn, turn)), most = min(share.largestTurn, LARGEST_TURN_OF_ITERATION);
    const double part = min(share.part, angle > most ? most/angle : 1);
    for (double& component : turn)
        component *= part;
    // Half a turn or more is told by findExcessiveChanges().
    GibbsVector::follow(turn, body.turned);
    GibbsVector::turn(body.turned, body.start, body.now);
}

void BodyStep::findExcessiveChanges(bool* failed) const {
    fill_n(failed, bodies.size(), false);
    for (int i : going) {
        const State& body = states[i];
        const double turn = dot(body.turned, body.turned);
        failed[i] = !isfinite(dot(body.moved, body.moved)) || !isfinite(turn) ||
                (body.held && turn > LARGEST_TURN_OF_STEP*LARGEST_TURN_OF_STEP);
    }
}

template <class Function> void BodyStep::visitPlaces(Function function) const {
    for (int i : going) {
        const State& body = states[i];
        for (size_t place = 0; place < bodies[i].particles.size(); place++) {
            double arm[3];
            body.now.turn(&bodies[i].places[3*place], arm);
            for (int k = 0; k < 3; k++)
                function(3*bodies[i].particles[place]+k, body.start.centre[k]+body.moved[k]+arm[k]);
        }
    }
}

void BodyStep::getPositions(const double* start, double* result) const {
    visitPlaces([&] (int number, double end) {
        result[number] = start[number]+(end-positions[number]);
    });
}

void BodyStep::getDisplacements(double* displacements) const {
    visitPlaces([&] (int number, double end) {
        displacements[number] = end-positions[number];
    });
}
