#ifndef CYLCHAIN_END_LINKS_H_
#define CYLCHAIN_END_LINKS_H_

#include "couplings/Contours.h"
#include "couplings/Surroundings.h"
#include <functional>
#include <map>
#include <utility>
#include <vector>

namespace cylchain {

/** Where a link holds: at a length along a chain, or a place that does not grow. */
struct LinkEnd {
    int chain = -1;
    double along = 0;
    Place place = {};
};

/** A link of which an end may be on a chain that grows. */
struct GrowingLink {
    LinkEnd ends[2];
    double stiffness, restLength;
};

/**
 * Harmonic links that hold chains at lengths along these, as the ends of chains feel them. A link whose place is gone
 * with a monomer has no energy any more.
 */
class EndLinks : public Surroundings {
public:
    /**
     * @param find              finds the links, at the start of a step
     * @param periodic          whether their two places are taken as nearest images
     * @param nearestParticles  whether the two particles of a place are
     */
    EndLinks(const std::function<void(std::vector<GrowingLink>&)>& find, bool periodic, bool nearestParticles) :
            find(find), periodic(periodic), nearestParticles(nearestParticles) {
    }
    void begin(const double* positions, const ChainList& chains, const double* box) override;
    double findChange(const EndChange& change) override;
    void show(int chain, const std::vector<Vec3d>& nodes, const std::vector<double>& along) override;
    void move(int chain, int other, double beyond) override;
private:
    /** The nodes of a chain that has changed in this step, and where they are along it. */
    struct Changed {
        std::vector<Vec3d> nodes;
        std::vector<double> along;
    };
    void sortByChains();
    bool locateEnd(const LinkEnd& end, const EndChange* change, bool isAfter, Vec3d& place) const;
    double findEnergy(const GrowingLink& link, const EndChange& change, bool isAfter) const;
    const std::function<void(std::vector<GrowingLink>&)> find;
    const bool periodic, nearestParticles;
    std::vector<GrowingLink> links;
    /** The numbers of links with an end on each chain. */
    std::map<int, std::vector<int> > ofChain;
    std::map<int, Changed> changed;
    const double *positions = nullptr, *box = nullptr;
};

} // namespace cylchain

#endif /*CYLCHAIN_END_LINKS_H_*/
