#include "networks/CarriedFrames.h"
#include "mechanics/PeriodicBox.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/BodyEquations.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** How far the twist of its frames may turn a body in a step, over the twist: it has 1 % too much energy then. */
const double LARGEST_SHARE_OF_TWIST = 0.1;

/** The square of a couple for a torque of one, beyond which joints are so nearly folded that no step would do. */
const double LARGEST_COUPLE = 4;

/** Find how fast torques turn a body, in its own frame. */
void findMobility(const RigidBody& body, double* mobility) {
    const double one[] = {1, 0, 0, 1, 0, 1};
    double matrix[36] = {}, inverse[36];
    BodyEquations::addBlock(one, 1, 0, matrix);
    BodyEquations::addBlock(body.rotationalFriction, 1, 3, matrix);
    BodyEquations::invertSix(matrix, body.planar, true, inverse);
    for (int row = 3; row < 6; row++)
        for (int column = row; column < 6; column++)
            *mobility++ = inverse[6*row+column];
}

/** Carry a vector from the direction a to b by parallel transport. */
void carry(const double* vector, const double* a, const double* b, double* result) {
    double axis[3], once[3], twice[3];
    cross(a, b, axis);
    cross(axis, vector, once);
    cross(axis, once, twice);
    for (int k = 0; k < 3; k++)
        result[k] = vector[k]+once[k]+twice[k]/(1+dot(a, b));
}

/** Find the angle about an axis from one vector across it to another. */
double findAngle(const double* from, const double* to, const double* axis) {
    double across[3];
    cross(from, to, across);
    return atan2(dot(across, axis), dot(from, to));
}

/** Find any vector across a direction. */
void findAcross(const double* direction, double* result) {
    double axis[3] = {};
    const double sizes[] = {fabs(direction[0]), fabs(direction[1]), fabs(direction[2])};
    axis[min_element(sizes, sizes+3)-sizes] = 1;
    cross(direction, axis, result);
}

} // namespace

CarriedFrames::CarriedFrames(const vector<Chain>& chains, const vector<RigidBody>& bodies) : chains(chains),
        bodies(bodies), starts(bodies.size()) {
    for (const RigidBody& body : bodies)
        finders.emplace_back(body);
    for (size_t chain = 0; chain < chains.size(); chain++)
        for (int end = 0; end < 2; end++) {
            const Chain& own = chains[chain];
            const int body = own.twist.ends[end].body;
            if (body < 0 || !own.twist.isPresent() || own.nodes.empty())
                continue;
            const size_t first = end == 0 ? 0 : own.nodes.size()-2;
            frames.push_back({(int) chain, end, body, {own.nodes[first], own.nodes[first+1]}, {}});
            findMobility(bodies[body], frames.back().mobility);
        }
    if (isEmpty())
        return;
    torques.resize(3*bodies.size());
    ofJoints.resize(2*chains.size());
    rates.resize(bodies.size());
    directions.resize(chains.size());
    for (const Frame& frame : frames) {
        vector<double>& own = directions[frame.chain];
        own.clear();
        for (const EndFrame& end : chains[frame.chain].twist.ends)
            own.insert(own.end(), end.direction, end.direction+3);
    }
}

double& CarriedFrames::twistOf(const Frame& frame, vector<vector<double> >& twists) const {
    return frame.end == 0 ? twists[frame.chain].front() : twists[frame.chain].back();
}

void CarriedFrames::findTangent(const Frame& frame, const double* positions, double* tangent) const {
    for (int k = 0; k < 3; k++)
        tangent[k] = positions[3*frame.nodes[1]+k]-positions[3*frame.nodes[0]+k];
    if (box != NULL)
        takeToNearestImage(tangent, box);
    const double length = sqrt(dot(tangent, tangent));
    for (int k = 0; k < 3; k++)
        tangent[k] /= length;
}

void CarriedFrames::begin(const double* positions, const double* newBox, StepSettings& settings) {
    if (isEmpty() || settings.twists == NULL)
        return;
    box = newBox;
    fill(rates.begin(), rates.end(), 0.0);
    for (const Frame& frame : frames) {
        starts[frame.body] = finders[frame.body].find(bodies[frame.body], positions);
        const EndFrame& own = chains[frame.chain].twist.ends[frame.end];
        starts[frame.body].turn(own.direction, &directions[frame.chain][3*frame.end]);
        ofJoints[2*frame.chain+frame.end] = own.stiffness*twistOf(frame, *settings.twists);
        double couple[3], ofBody[3], turned[3];
        findCouple(frame, positions, couple);
        starts[frame.body].turnBack(couple, ofBody);
        multiply(frame.mobility, ofBody, turned);
        rates[frame.body] += own.stiffness*dot(ofBody, turned)*min(1.0, LARGEST_COUPLE/dot(couple, couple));
    }
    update(positions);
    settings.endDirections = &directions;
    settings.endTorques = ofJoints.data();
    settings.bodyTorques = torques.data();
}

/** Find the couple on the body for a torque of one, at a minus end. */
void CarriedFrames::findCouple(const Frame& frame, const double* positions, double* couple) const {
    const double* const direction = &directions[frame.chain][3*frame.end];
    double tangent[3];
    findTangent(frame, positions, tangent);
    for (int k = 0; k < 3; k++)
        couple[k] = (direction[k]+tangent[k])/(1+dot(direction, tangent));
}

void CarriedFrames::update(const double* positions) {
    fill(torques.begin(), torques.end(), 0.0);
    for (const Frame& frame : frames) {
        const double onBody = ofJoints[2*frame.chain+frame.end]*(frame.end == 0 ? 1 : -1);
        double couple[3];
        findCouple(frame, positions, couple);
        for (int k = 0; k < 3; k++)
            torques[3*frame.body+k] += onBody*couple[k];
    }
}

void CarriedFrames::follow(const double* positions, const vector<bool>& taken, const StepSettings& settings) const {
    for (const Frame& frame : frames) {
        if (settings.endDirections == NULL || !taken[frame.chain])
            continue;
        // A vector of the frame, as the last segment has it before and now.
        const double* const own = chains[frame.chain].twist.ends[frame.end].direction;
        const double* const before = &directions[frame.chain][3*frame.end];
        const RigidFrame end = finders[frame.body].find(bodies[frame.body], positions);
        double ofBody[3], now[3], vector[3], tangent[3], carriedBefore[3], carried[3];
        findTangent(frame, positions, tangent);
        findAcross(own, ofBody);
        starts[frame.body].turn(ofBody, vector);
        carry(vector, before, tangent, carriedBefore);
        end.turn(own, now);
        end.turn(ofBody, vector);
        carry(vector, now, tangent, carried);
        const double angle = findAngle(carriedBefore, carried, tangent);
        twistOf(frame, *settings.twistChanges) += frame.end == 0 ? -angle : angle;
    }
}

int CarriedFrames::findHalvings(double stepSize, const vector<bool>& taken) const {
    double largest = 0;
    for (const Frame& frame : frames)
        if (taken[frame.chain])
            largest = max(largest, rates[frame.body]*stepSize);
    return largest > LARGEST_SHARE_OF_TWIST ? (int) ceil(log2(largest/LARGEST_SHARE_OF_TWIST)) : 0;
}

void CarriedFrames::findFailures(double stepSize, const vector<bool>& taken, vector<bool>& failed) const {
    for (const Frame& frame : frames)
        if (taken[frame.chain] && rates[frame.body]*stepSize > LARGEST_SHARE_OF_TWIST)
            failed[frame.chain] = true;
}

int CarriedFrames::findBody(int chain) const {
    for (const Frame& frame : frames)
        if (frame.chain == chain)
            return frame.body;
    return -1;
}

vector<pair<int, int> > CarriedFrames::findPairs() const {
    vector<pair<int, int> > pairs;
    pairs.reserve(frames.size());
    for (const Frame& frame : frames)
        pairs.emplace_back(frame.chain, frame.body);
    return pairs;
}
