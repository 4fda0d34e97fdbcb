#include "networks/ParticleStep.h"
#include "lanes/Noise.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/StageWeights.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** The inverse of a symmetric matrix (xx, xy, xz, yy, yz, zz). */
void invert(const double* m, double* result) {
    const double c[] = {m[3]*m[5]-m[4]*m[4], m[2]*m[4]-m[1]*m[5], m[1]*m[4]-m[2]*m[3], m[0]*m[5]-m[2]*m[2],
            m[1]*m[2]-m[0]*m[4], m[0]*m[3]-m[1]*m[1]};
    const double determinant = m[0]*c[0]+m[1]*c[1]+m[2]*c[2];
    for (int k = 0; k < 6; k++)
        result[k] = c[k]/determinant;
}

} // namespace

ParticleStep::ParticleStep(const vector<CoupledParticle>& particles) : particles(particles),
        taken(particles.size()) {
    for (vector<double>* values : {&forces, &noise, &drift, &moved, &change, &right})
        values->resize(3*particles.size());
    inverse.resize(6*particles.size());
}

void ParticleStep::begin(const double* positions, const double* allForces, const double*,
        const StepSettings& newSettings, const bool* newTaken) {
    settings = newSettings;
    const size_t count = particles.size();
    vector<uint32_t> chains(count, 0), parts(count);
    vector<double> normals(4*count);
    for (size_t i = 0; i < count; i++)
        parts[i] = particles[i].particle;
    drawNormals({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step}, NoiseKind::Particle,
            chains.data(), parts.data(), count, normals.data());
    for (size_t i = 0; i < count; i++) {
        taken[i] = newTaken[i];
        const double* position = positions+3*particles[i].particle;
        const double amplitude = sqrt(2*settings.kT*particles[i].friction/settings.stepSize);
        double velocity[3] = {};
        if (settings.flow.present) {
            // The velocity half-way, so that particles keep to closed streamlines.
            double halfway[3];
            settings.flow.getVelocity(position, velocity);
            for (int k = 0; k < 3; k++)
                halfway[k] = position[k]+0.5*settings.stepSize*velocity[k];
            settings.flow.getVelocity(halfway, velocity);
        }
        for (int k = 0; k < 3; k++) {
            forces[3*i+k] = allForces[3*particles[i].particle+k];
            noise[3*i+k] = amplitude*normals[4*i+k];
            drift[3*i+k] = settings.stepSize*velocity[k];
            moved[3*i+k] = 0;
        }
    }
}

int ParticleStep::getNumStages() const {
    return settings.scheme == Scheme::ImplicitSecondOrder ? 2 : 1;
}

void ParticleStep::beginStage(int stage) {
    const bool first = getNumStages() == 2 && stage == 0;
    shareOfForces = first ? DIAGONAL : 1;
    shareOfNoise = first ? NOISE_OF_FIRST : 1;
}

void ParticleStep::solve(int particle, const double* force, double* move) const {
    multiply(&inverse[6*particle], force, move);
}

void ParticleStep::eliminate(const CouplingTerm* newTerms, int count, double* moves) {
    terms = newTerms;
    numTerms = count;
    for (size_t i = 0; i < particles.size(); i++) {
        const double perStep = particles[i].friction/settings.stepSize;
        for (size_t k = 3*i; k < 3*i+3; k++)
            right[k] = shareOfForces*forces[k]+shareOfNoise*noise[k]-perStep*(moved[k]-shareOfForces*drift[k]);
        const double diagonal[] = {perStep, 0, 0, perStep, 0, perStep};
        copy(diagonal, diagonal+6, &inverse[6*i]);
    }
    for (int i = 0; i < numTerms; i++) {
        for (int k = 0; k < 6; k++)
            inverse[6*terms[i].lane+k] += terms[i].stiffness[k];
        for (int k = 0; k < 3; k++)
            right[3*terms[i].lane+k] += terms[i].force[k];
    }
    for (size_t i = 0; i < particles.size(); i++) {
        double matrix[6];
        copy_n(&inverse[6*i], 6, matrix);
        invert(matrix, &inverse[6*i]);
        solve(i, &right[3*i], &change[3*i]);
    }
    gatherMoves(moves);
}

/** Find how places move from the changes of particles. */
void ParticleStep::gatherMoves(double* moves) const {
    for (int i = 0; i < numTerms; i++)
        for (int k = 0; k < 3; k++)
            moves[TermBlocks::place(i, k)] = change[3*terms[i].lane+k];
}

/** Find the forces on particles from those on places. */
template <class Number> void ParticleStep::gatherForces(const Number* onPlaces) {
    fill(right.begin(), right.end(), 0.0);
    for (int i = 0; i < numTerms; i++)
        for (int k = 0; k < 3; k++)
            right[3*terms[i].lane+k] += onPlaces[TermBlocks::place(i, k)];
}

template <class Number> void ParticleStep::respondAs(const Number* onPlaces, Number* moves) {
    gatherForces(onPlaces);
    for (int i = 0; i < numTerms; i++) {
        double move[3];
        solve(terms[i].lane, &right[3*terms[i].lane], move);
        for (int k = 0; k < 3; k++)
            moves[TermBlocks::place(i, k)] = move[k];
    }
}

void ParticleStep::respond(const double* onPlaces, double* moves) {
    respondAs(onPlaces, moves);
}

void ParticleStep::respond(const float* onPlaces, float* moves) {
    respondAs(onPlaces, moves);
}

void ParticleStep::findCompliances(double* compliances) {
    for (int i = 0; i < numTerms; i++)
        copy_n(&inverse[6*terms[i].lane], 6, compliances+6*i);
}

void ParticleStep::advance(const double* onPlaces, const ShareOfChange& share, bool* unfinished, double* moves) {
    if (onPlaces != NULL) {
        gatherForces(onPlaces);
        for (size_t i = 0; i < particles.size(); i++) {
            double added[3];
            solve(i, &right[3*i], added);
            for (int k = 0; k < 3; k++)
                change[3*i+k] += added[k];
        }
        gatherMoves(moves);
    }
    for (size_t i = 0; i < particles.size(); i++) {
        // The equations are linear: couplings decide whether another iteration is needed.
        unfinished[i] = false;
        for (int k = 0; k < 3 && taken[i]; k++)
            moved[3*i+k] += share.part*change[3*i+k];
    }
}

void ParticleStep::findExcessiveChanges(bool* failed) const {
    for (size_t i = 0; i < particles.size(); i++)
        failed[i] = !(isfinite(moved[3*i]) && isfinite(moved[3*i+1]) && isfinite(moved[3*i+2]));
}

void ParticleStep::getPositions(const double* start, double* positions) const {
    for (size_t i = 0; i < particles.size(); i++)
        for (int k = 0; k < 3 && taken[i]; k++) {
            const int place = 3*particles[i].particle+k;
            positions[place] = start[place]+moved[3*i+k];
        }
}

void ParticleStep::getDisplacements(double* displacements) const {
    for (size_t i = 0; i < particles.size(); i++)
        for (int k = 0; k < 3 && taken[i]; k++)
            displacements[3*particles[i].particle+k] = moved[3*i+k];
}
