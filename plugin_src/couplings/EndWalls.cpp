#include "couplings/EndWalls.h"

using namespace cylchain;
using namespace std;

/** Find the energy of so many nodes at an end. */
double EndWalls::findEnergy(const vector<Vec3d>& nodes, int end, int count, double radius) const {
    double energy = 0, gradient[3];
    for (int i = 0; i < count; i++) {
        const Vec3d& node = nodes[end == 1 ? nodes.size()-1-i : i];
        const double x[] = {node.x, node.y, node.z};
        for (int face = 0; face < countFaces(wall); face++) {
            const double depth = findDepth(wall, face, x, radius, gradient);
            if (actsAt(wall, depth))
                energy += 0.5*stiffness*depth*depth;
        }
    }
    return energy;
}

double EndWalls::findChange(const EndChange& change) {
    const double radius = radii[change.chain];
    if (radius < 0)
        return 0;
    return findEnergy(change.after, change.end, change.countNodes(change.segmentsAfter), radius)-
            findEnergy(change.before, change.end, change.countNodes(change.segmentsBefore), radius);
}
