#ifndef CYLCHAIN_COUPLING_IMPULSES_H_
#define CYLCHAIN_COUPLING_IMPULSES_H_

#include "couplings/Capsules.h"
#include "couplings/Walls.h"
#include <map>
#include <utility>
#include <vector>

namespace cylchain {

/** The force of a contact, or of a wall on a particle. */
struct Push {
    /** What it acts on, and with which share; a share of zero is none. */
    int particles[4] = {};
    double shares[4] = {};
    double force[3] = {};
    /** Its size, as it counts for the load. */
    double load = 0;
    /**
     * Between what: the face of a wall and -1, or the two bodies of a contact, which are chains, and spheres with
     * numbers behind those.
     */
    std::pair<int, int> between = {0, -1};
    /** The chains of the step that it belongs to, or -1. */
    int chains[2] = {-1, -1};
};

/** The force of a wall on one of its particles, along the gradient of the depth beyond a face. */
Push pushOfWall(const WallSystem& system, int particle, int face, double force, const double* gradient);

/** Find the forces of a wall where particles are, and return their energy. */
double findPushes(const WallSystem& system, const double* positions, std::vector<Push>& pushes);

/** The force of a contact of two capsules, on the first one at a fraction s of it, and against it on the other. */
Push pushOfContact(const CapsuleSystem& system, int a, int b, double s, double t, double force,
        const double* direction);

/**
 * The impulses of a force, which are its integral over time, of the steps since somebody has asked for them.
 *
 * Several may ask in turn: each of these readers has the sums since it has asked last. Until somebody asks, sums begin
 * again where there are too many pairs of what pushes each other.
 */
class CouplingImpulses {
public:
    struct Load {
        double force[3] = {};
        /** The sum of the sizes of forces. */
        double size = 0;
    };
    struct Sums {
        double time = 0;
        /** Three for each particle of the System. */
        std::vector<double> particles;
        /** By what pushes what: see Push::between. */
        std::map<std::pair<int, int>, Load> loads;
        void add(const Push& push, double duration);
        void add(const Sums& other);
        void clear();
    };
    explicit CouplingImpulses(int numParticles = 0);
    /** Begin a step: what was added since the last one has been finished has not happened. */
    void beginStep() {
        ofStep.clear();
    }
    /** Take note of a force that acts for a part of the step. */
    void add(const Push& push, double duration) {
        ofStep.push_back({push, duration});
    }
    /** Finish a step. */
    void finishStep(double stepSize);
    /** Add somebody who asks; returns the number. Number 0 is there from the beginning. */
    int addReader();
    /** Get the sums since a reader has asked last. */
    Sums take(int reader);
    /** Begin again, for all. */
    void clear();
    /** What there is to store: the sums since anybody has asked, which are not among those of readers, and these. */
    const Sums& getLatest() const {
        return latest;
    }
    const std::vector<Sums>& getReaders() const {
        return readers;
    }
    /** Go on from sums that were stored. Readers that have come later begin with nothing. */
    void restore(const Sums& latest, const std::vector<Sums>& readers);
private:
    struct Part {
        Push push;
        double duration;
    };
    std::vector<Part> ofStep;
    Sums latest;
    std::vector<Sums> readers;
    bool asked = false;
};

} // namespace cylchain

#endif /*CYLCHAIN_COUPLING_IMPULSES_H_*/
