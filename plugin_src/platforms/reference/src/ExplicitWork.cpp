#include "ExplicitWork.h"
#include <algorithm>
#include <cmath>

using namespace OpenMM;
using namespace std;

/**
 * Particles are given to threads in blocks of this size.
 */
static const int BLOCK_SIZE = 1024;

ExplicitWork::ExplicitWork(ParallelLoop& loop) : loop(loop), known(false), count(0), largest(0), worst(-1), finishedSteps(0),
        active(0) {
}

void ExplicitWork::initialize(const vector<int>& particles) {
    this->particles = particles;
    sums.clear();
    known = false;
    count = finishedSteps = 0;
}

void ExplicitWork::beginStep(const vector<Vec3>& forces, const vector<Vec3>& moves, bool followsOn, double kT, int window) {
    const bool measured = (window > 0 && kT > 0);
    if (!measured || sums.empty()) {
        known = false;
        count = 0;
    }
    if (!measured)
        return;
    sums.resize(particles.size());
    const bool pair = (known && followsOn);
    const int numBlocks = (particles.size()+BLOCK_SIZE-1)/BLOCK_SIZE;
    loop.run(numBlocks, [&] (int block) {
        if (pair)
            add(block, forces, moves, 1/kT);
        else
            for (size_t i = block*BLOCK_SIZE; i < min(particles.size(), (size_t) (block+1)*BLOCK_SIZE); i++) {
                sums[i].force = forces[particles[i]];
                if (count == 0) {
                    sums[i].change = sums[i].way = Vec3();
                    sums[i].work = 0;
                }
            }
    });
    known = false;
    if (pair && ++count >= window)
        finish();
}

void ExplicitWork::add(int block, const vector<Vec3>& forces, const vector<Vec3>& moves, double perEnergy) {
    const int end = min((int) particles.size(), (block+1)*BLOCK_SIZE);
    for (int i = block*BLOCK_SIZE; i < end; i++) {
        Sums& own = sums[i];
        const Vec3& force = forces[particles[i]];
        const Vec3& move = moves[particles[i]];
        const Vec3 change = (force-own.force)*perEnergy;
        own.work -= change.dot(move);
        own.change += change;
        own.way += move;
        own.force = force;
    }
}

void ExplicitWork::finish() {
    finishedSteps = count;
    active = 0;
    largest = 0;
    worst = -1;
    for (size_t i = 0; i < particles.size(); i++) {
        Sums& own = sums[i];
        const double work = (own.work+own.change.dot(own.way)/count)/count;
        if (work != 0) {
            active++;
            // Written so that NaN is the largest.
            if (worst == -1 || (!isnan(largest) && !(work <= largest))) {
                largest = work;
                worst = particles[i];
            }
        }
        own.change = own.way = Vec3();
        own.work = 0;
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
