#include "openmm/internal/ExplicitWork.h"
#include <algorithm>
#include <cmath>

using namespace OpenMM;
using namespace std;

/**
 * Particles are given to threads in blocks of this size.
 */
static const int BLOCK_SIZE = 1024;

ExplicitWork::ExplicitWork(ParallelLoop& loop) : loop(loop), known(false), count(0), largest(0), worst(-1),
        finishedSteps(0), active(0) {
}

void ExplicitWork::initialize(const vector<int>& particles) {
    this->particles = particles;
    sums.clear();
    known = false;
    count = finishedSteps = 0;
}

void ExplicitWork::beginStep(const vector<Vec3>& forces, const vector<Vec3>& moves, bool followsOn, double kT,
        int window) {
    const bool pair = (known && followsOn);
    forcesBefore.resize(particles.size());
    if (pair)
        sums.resize(particles.size());
    const int numBlocks = (particles.size()+BLOCK_SIZE-1)/BLOCK_SIZE;
    loop.run(numBlocks, [&] (int block) {
        const int end = min((int) particles.size(), (block+1)*BLOCK_SIZE);
        for (int i = block*BLOCK_SIZE; i < end; i++) {
            const Vec3& force = forces[particles[i]];
            if (pair)
                add(i, force, moves[particles[i]], 1/kT);
            forcesBefore[i] = force;
        }
    });
    known = false;
    if (pair && ++count >= window)
        finish();
}

StepWork ExplicitWork::beginStep(bool followsOn, double kT, int window) {
    StepWork work;
    work.watched = true;
    work.followsOn = (known && followsOn);
    work.beginsWindow = (count == 0);
    work.perEnergy = 1/kT;
    known = false;
    if (work.followsOn)
        work.endsWindow = (++count >= window);
    return work;
}

void ExplicitWork::finish(const vector<WorkSums>& sumsOfParticles) {
    sums.resize(particles.size());
    for (size_t i = 0; i < particles.size(); i++)
        sums[i] = sumsOfParticles[particles[i]];
    finish();
}

void ExplicitWork::stop() {
    known = false;
    count = 0;
    sums.clear();
}

void ExplicitWork::add(int particle, const Vec3& force, const Vec3& move, double perEnergy) {
    WorkSums& own = sums[particle];
    const Vec3 change = (force-forcesBefore[particle])*perEnergy;
    own.work -= change.dot(move);
    own.change += change;
    own.way += move;
}

void ExplicitWork::finish() {
    finishedSteps = count;
    active = 0;
    largest = 0;
    worst = -1;
    for (size_t i = 0; i < particles.size(); i++) {
        WorkSums& own = sums[i];
        const double work = (own.work+own.change.dot(own.way)/count)/count;
        if (work != 0) {
            active++;
            // Written so that NaN is the largest.
            if (worst == -1 || (!isnan(largest) && !(work <= largest))) {
                largest = work;
                worst = particles[i];
            }
        }
        own = WorkSums();
    }
    count = 0;
}

void ExplicitWork::endStep() {
    known = true;
}

void ExplicitWork::interrupt() {
    known = false;
}

void ExplicitWork::take(double& work, int& particle, int& steps, int& particles) {
    work = largest;
    particle = worst;
    steps = finishedSteps;
    particles = active;
    finishedSteps = 0;
}
