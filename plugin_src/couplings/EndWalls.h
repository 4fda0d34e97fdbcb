#ifndef CYLCHAIN_END_WALLS_H_
#define CYLCHAIN_END_WALLS_H_

#include "couplings/Walls.h"
#include "couplings/Surroundings.h"
#include <vector>

namespace cylchain {

/** A wall, as the ends of chains feel it that it keeps in. */
class EndWalls : public Surroundings {
public:
    /** @param radii  of the nodes of each chain, by its number, negative for chains that the wall does not keep in */
    EndWalls(const Wall& wall, double stiffness, const std::vector<double>& radii) : wall(wall), stiffness(stiffness),
            radii(radii) {
    }
    void begin(const double*, const ChainList&, const double*) override {
        // Nodes are all that it acts on.
    }
    double findChange(const EndChange& change) override;
    void show(int, const std::vector<Vec3d>&, const std::vector<double>&) override {
    }
private:
    double findEnergy(const std::vector<Vec3d>& nodes, int end, int count, double radius) const;
    const Wall wall;
    const double stiffness;
    const std::vector<double> radii;
};

} // namespace cylchain

#endif /*CYLCHAIN_END_WALLS_H_*/
