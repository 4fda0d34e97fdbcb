#ifndef CYLCHAIN_BROKEN_COUPLING_H_
#define CYLCHAIN_BROKEN_COUPLING_H_

namespace cylchain {

/** The coupling by which an implicit step of coupled chains has gone wrong. */
struct BrokenCoupling {
    enum Reason {
        /** Newton's method has not found where its places are. */
        NotSolved,
        /** Two capsules pass through each other. */
        Crosses,
        /** Capsules move so far that the periodic box is too narrow to look for contacts. */
        LeavesBox,
        /** A link leaves the range of its potential. */
        LeavesRange
    };
    struct Place {
        /** The chain; for a particle, its number behind those of all chains; -1 for what does not move. */
        int chain = -1;
        int segment = -1;
    };
    Reason reason = NotSolved;
    /** Its force, among those of CoupledForces, or -1 if there is none. */
    int force = -1;
    /** The number of a link. */
    long long link = -1;
    Place places[2];
};

} // namespace cylchain

#endif /*CYLCHAIN_BROKEN_COUPLING_H_*/
