#include "couplings/CouplingImpulses.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

/** The most pairs whose sums are kept for nobody. */
static const size_t MOST_PAIRS_UNASKED = 100000;

Push cylchain::pushOfWall(const WallSystem& system, int particle, int face, double force, const double* gradient) {
    Push push;
    push.particles[0] = system.particles[particle].particle;
    push.shares[0] = 1;
    double square = 0;
    for (int k = 0; k < 3; k++) {
        push.force[k] = -force*gradient[k];
        square += gradient[k]*gradient[k];
    }
    push.load = force*sqrt(square);
    push.between = {face, -1};
    return push;
}

double cylchain::findPushes(const WallSystem& system, const double* positions, vector<Push>& pushes) {
    const int faces = countFaces(system.wall);
    double energy = 0;
    for (size_t i = 0; i < system.particles.size(); i++) {
        const WallParticle& own = system.particles[i];
        for (int face = 0; face < faces; face++) {
            double gradient[3];
            const double depth = findDepth(system.wall, face, positions+3*own.particle, own.radius, gradient);
            if (!actsAt(system.wall, depth))
                continue;
            energy += 0.5*system.stiffness*depth*depth;
            pushes.push_back(pushOfWall(system, i, face, system.stiffness*depth, gradient));
        }
    }
    return energy;
}

Push cylchain::pushOfContact(const CapsuleSystem& system, int a, int b, double s, double t, double force,
        const double* direction) {
    Push push;
    const double fractions[] = {s, t};
    int bodies[2];
    for (int side = 0; side < 2; side++) {
        const Capsule& capsule = system.capsules[side == 0 ? a : b];
        const double sign = side == 0 ? 1 : -1;
        push.particles[2*side] = capsule.first;
        push.particles[2*side+1] = capsule.end();
        push.shares[2*side] = sign*(1-fractions[side]);
        push.shares[2*side+1] = sign*fractions[side];
        bodies[side] = capsule.chain >= 0 ? capsule.chain : (int) system.chains.size()+capsule.index;
    }
    double square = 0;
    for (int k = 0; k < 3; k++) {
        push.force[k] = force*direction[k];
        square += direction[k]*direction[k];
    }
    push.load = force*sqrt(square);
    push.between = {bodies[0], bodies[1]};
    return push;
}

void CouplingImpulses::Sums::add(const Push& push, double duration) {
    for (int i = 0; i < 4; i++)
        if (push.shares[i] != 0)
            for (int k = 0; k < 3; k++)
                particles[3*(size_t) push.particles[i]+k] += duration*push.shares[i]*push.force[k];
    Load& load = loads[push.between];
    for (int k = 0; k < 3; k++)
        load.force[k] += duration*push.force[k];
    load.size += duration*push.load;
}

void CouplingImpulses::Sums::add(const Sums& other) {
    time += other.time;
    for (size_t i = 0; i < particles.size(); i++)
        particles[i] += other.particles[i];
    for (const auto& entry : other.loads) {
        Load& own = loads[entry.first];
        for (int k = 0; k < 3; k++)
            own.force[k] += entry.second.force[k];
        own.size += entry.second.size;
    }
}

void CouplingImpulses::Sums::clear() {
    time = 0;
    fill(particles.begin(), particles.end(), 0.0);
    loads.clear();
}

CouplingImpulses::CouplingImpulses(int numParticles) {
    latest.particles.assign(3*(size_t) numParticles, 0.0);
    readers.push_back(latest);
}

void CouplingImpulses::finishStep(double stepSize) {
    for (const Part& part : ofStep)
        latest.add(part.push, part.duration);
    ofStep.clear();
    latest.time += stepSize;
    if (!asked && latest.loads.size() > MOST_PAIRS_UNASKED)
        latest.clear();
}

int CouplingImpulses::addReader() {
    asked = true;
    for (Sums& own : readers)
        own.add(latest);
    latest.clear();
    readers.push_back(latest);
    return readers.size()-1;
}

CouplingImpulses::Sums CouplingImpulses::take(int reader) {
    asked = true;
    for (Sums& own : readers)
        own.add(latest);
    latest.clear();
    const Sums result = readers[reader];
    readers[reader].clear();
    return result;
}

void CouplingImpulses::clear() {
    ofStep.clear();
    latest.clear();
    for (Sums& own : readers)
        own.clear();
}

void CouplingImpulses::restore(const Sums& newLatest, const vector<Sums>& newReaders) {
    clear();
    asked = true;
    latest = newLatest;
    const Sums none = readers[0];
    const size_t count = max(readers.size(), newReaders.size());
    readers = newReaders;
    readers.resize(count, none);
}
