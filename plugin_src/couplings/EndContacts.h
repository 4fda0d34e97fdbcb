#ifndef CYLCHAIN_END_CONTACTS_H_
#define CYLCHAIN_END_CONTACTS_H_

#include "couplings/ContactBodies.h"
#include "couplings/ContactSearch.h"
#include "couplings/Surroundings.h"
#include <vector>

namespace cylchain {

/**
 * Contacts, as the ends of chains feel them that may touch: the energy is that of a ContactSearch over all capsules
 * near an end. A change by which capsules would pass through each other cannot be.
 */
class EndContacts : public Surroundings {
public:
    /**
     * @param bodies    what touches each other
     * @param growing   the number of the chain that grows which each chain of the bodies is, or -1
     * @param periodic  whether distances are those of nearest periodic images
     */
    EndContacts(const ContactBodies& bodies, const std::vector<int>& growing, double stiffness, bool periodic) :
            bodies(bodies), growing(growing), stiffness(stiffness), periodic(periodic) {
    }
    void begin(const double* positions, const ChainList& chains, const double* box) override;
    double findChange(const EndChange& change) override;
    void show(int chain, const std::vector<Vec3d>& nodes, const std::vector<double>& along) override;
private:
    /** A body: its nodes, those of a closed chain with the first once more, or the centre of a sphere. */
    struct Body {
        std::vector<Vec3d> nodes;
        double radius = 0;
        Vec3d centre = {0, 0, 0};
        double extent = 0;
        void bound();
        int countCapsules() const {
            return nodes.size() > 1 ? nodes.size()-1 : 1;
        }
        Vec3d endOf(int capsule) const {
            return nodes[nodes.size() > 1 ? capsule+1 : 0];
        }
    };
    /** Capsules near an end, with positions of their own. */
    struct Neighborhood {
        CapsuleSystem system;
        std::vector<double> before, after;
        std::vector<int> chainOf;
    };
    /** A capsule of a body that an end may touch, or one beside such in its chain. */
    struct NearCapsule {
        int body, capsule;
        bool mayTouch;
    };
    typedef std::vector<NearCapsule> Near;
    int findBody(int chain) const;
    void findNear(const EndChange& change, int own, Near& near) const;
    Vec3d toNearestImage(const Vec3d& along) const;
    bool isAlone(const EndChange& change, const Near& near, int own) const;
    void addOthers(const Near& near, Neighborhood& all, int own) const;
    void addRun(Neighborhood& all, int body, int first, int last, const std::vector<Vec3d>& nodes,
            const std::vector<Vec3d>& after, int numCapsules) const;
    double findEnergy(const EndChange& change, const Near& near, int own, const std::vector<Vec3d>& nodes) const;
    bool crosses(const EndChange& change, const Near& near, int own) const;
    const ContactBodies bodies;
    const std::vector<int> growing;
    const double stiffness;
    const bool periodic;
    const double* box = nullptr;
    std::vector<Body> known;
    double largestRadius = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_END_CONTACTS_H_*/
