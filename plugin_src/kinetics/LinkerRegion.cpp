#include "kinetics/LinkerRegion.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

const int MOST_POSITIONS = 1000000;
/** The level of noise to which first positions belong: the events of linkers are at level 0. */
const uint32_t LEVEL_OF_FIRST_POSITIONS = 31;

} // namespace

bool LinkerRegion::isBeyond(const double* center, double radius) const {
    for (const Wall& wall : walls)
        for (int face = 0; face < countFaces(wall); face++) {
            double gradient[3];
            if (findDepth(wall, face, center, 0, gradient) >= radius)
                return true;
        }
    return false;
}

bool LinkerRegion::draw(RandomNumbers& random, bool planar, double* position) const {
    // The box around a closed wall, or else a cell of the periodic box around the middle of a wall.
    double origin[3] = {0, 0, 0}, edges[9] = {}, lower[3], upper[3];
    if (findBounds(walls, lower, upper))
        for (int k = 0; k < 3; k++) {
            origin[k] = lower[k];
            edges[4*k] = upper[k]-lower[k];
        }
    else {
        if (box == nullptr)
            return false;
        copy(box, box+9, edges);
        if (!walls.empty())
            for (int k = 0; k < 3; k++)
                origin[k] = walls[0].point[k]-0.5*(edges[k]+edges[3+k]+edges[6+k]);
    }
    for (int i = 0; i < MOST_POSITIONS; i++) {
        copy(origin, origin+3, position);
        for (int axis = 0; axis < 3; axis++) {
            const double share = random.uniform();
            for (int k = 0; k < 3; k++)
                position[k] += share*edges[3*axis+k];
        }
        if (planar)
            position[2] = 0;
        if (encloses(position))
            return true;
    }
    return false;
}

void cylchain::drawAround(RandomNumbers& random, const double* center, double radius, bool planar, double* position) {
    double shift[3], square;
    do {
        square = 0;
        for (int k = 0; k < 3; k++) {
            shift[k] = planar && k == 2 ? 0 : 2*random.uniform()-1;
            square += shift[k]*shift[k];
        }
    } while (square > 1);
    for (int k = 0; k < 3; k++)
        position[k] = center[k]+radius*shift[k];
    if (planar)
        position[2] = 0;
}

bool cylchain::placeFreeLinkers(LinkerState& state, const LinkerSystem& system, const double* box, uint32_t seed,
        uint32_t force) {
    if (!system.anyDiffuses()) {
        state.positions.clear();
        return true;
    }
    const NoiseKey key = {seed, LEVEL_OF_FIRST_POSITIONS, state.steps};
    state.positions.resize(3*state.linkers.size(), NO_POSITION);
    for (size_t i = 0; i < state.linkers.size(); i++) {
        const Linker& linker = state.linkers[i];
        const LinkerType& type = system.types[linker.type];
        double* const position = &state.positions[3*i];
        if (!system.isFree(linker)) {
            fill(position, position+3, NO_POSITION);
            continue;
        }
        if (!isnan(position[0]))
            continue;
        RandomNumbers random(key, force, linker.number);
        if (!LinkerRegion(system.wallsOf(type), box).draw(random, type.planar, position))
            return false;
    }
    return true;
}
