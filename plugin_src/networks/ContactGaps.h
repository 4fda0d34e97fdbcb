#ifndef CYLCHAIN_CONTACT_GAPS_H_
#define CYLCHAIN_CONTACT_GAPS_H_

#include "couplings/ContactSearch.h"
#include "networks/CandidatePairs.h"
#include "networks/CapsulePlaces.h"
#include "networks/ContactEquations.h"
#include "networks/ImplicitCouplings.h"
#include "networks/PlaceResponses.h"
#include <array>
#include <utility>
#include <vector>

namespace cylchain {

/**
 * Contacts of capsules in an implicit step: gaps between two capsules.
 *
 * A pair has one gap for its energy at the start and at the end, each with the contacts that it has then: so a step
 * back has the same gaps. Half of the force acts where they are nearest at the start, half where they are at the end.
 * Where the contact goes on to the next segment within the step, so does its gap: with the spring or the hard surface
 * that it has, and in place of one of the pair there. After a few iterations the places of a gap stay. Where all has
 * converged, gaps that are others by now are found again, and segments that still have crossed fail.
 */
class ContactGaps : public ImplicitCouplings {
public:
    /** Set what touches. */
    void setContacts(const ContactSystem& contacts);
    bool areGaps() const override {
        return true;
    }
    void setNumber(int number) override {
        candidates.setForce(number);
    }
    CouplingImpulses* getImpulses() const override {
        return impulses;
    }
    double findLargestSoftness(const CoupledStart& start) override;
    ImplicitCouplings& getHardOnes() override {
        return hard;
    }
    void placeSites(double* positions) const override;
    void begin(const CoupledStart& start, const Loop& loop) override;
    bool findGaps(int iteration, bool settled, const double* moved, ReflectedGaps& gaps) override;
    Rests getRests() const override {
        return Rests::Worthwhile;
    }
    bool followAgain(ReflectedGaps& gaps) override;
    void findFailures(const double* moved, std::vector<bool>& failed) override;
    bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const override;
    void findPushes(const double* moved, std::vector<Push>& pushes) const override;
    void findNeighbours(std::vector<std::pair<int, int> >& neighbours) const override;
private:
    /** One gap for the energy of a pair, k gap^2/2 where it is negative: where forces act, and its gradients there. */
    struct PairGap {
        double gap;
        int count;
        double s[2], t[2];
        Vec3d gradients[2];
    };
    /** A pair whose gap may be closed, by its number among the candidates. */
    struct NearPair {
        int pair;
        /** How far the capsules had travelled when it was found. */
        double way = -1;
        /** At the start, and whether the pair has the contact then. */
        PairGap start;
        bool touchedAtStart = false;
        /** The gap, its number or -1, and by how much it is longer from the hard surface than from the soft one. */
        Gap gap;
        int number = -1;
        double depth = 0;
        /** Those that touch in the end: of the pair, or beside them. */
        int last[2] = {};
        /** Where its levers are, and what these lack of the gap. */
        double fractions[4][2] = {}, offset = 0;
        /** How often it has been found again when all had converged. */
        int timesAgain = 0;
        /** Whether its contact may be that of a neighbor. */
        bool ofNeighbor = false;
    };
    static PairGap findPairGap(const SegmentPair& pair, const Contact* contacts, int count, double radii);
    bool follow(NearPair& near, bool again = false) const;
    int findContactsBeside(const ContactPair& pair, ContactPair& last, Contact* contacts) const;
    ContactPair pairOfLever(const NearPair& near, int lever) const;
    bool mayClose(const Gap& gap) const;
    std::array<int, 3> around(int capsule) const;
    bool mayGoOn(const NearPair& own) const;
    void findGoing();
    bool isOfNeighbor(const NearPair& own) const;
    double findEnd(const NearPair& near) const;
    /** Those of steps that do not resolve contacts. */
    ContactEquations hard;
    ContactSearch* search = nullptr;
    const ReflectedGaps* all = nullptr;
    double stiffness = 0, kT = 0;
    int iterations = 0;
    const Loop* loop = nullptr;
    const double* begun = nullptr;
    const std::vector<CapsuleOnCurve>* onCurves = nullptr;
    const std::vector<CurveSite>* sites = nullptr;
    CouplingImpulses* impulses = nullptr;
    PlaceResponses responses;
    CapsulePlaces places;
    /** About how far a force moves the place of each capsule that it moves most. */
    std::vector<double> responsesOfCapsules;
    CandidatePairs candidates;
    std::vector<NearPair> near;
    /** For each of them, whether its gap has been found anew, and whether its contact may become that of neighbors. */
    std::vector<char> areFound, goOn;
    /** The capsules of pairs whose contacts go on, either way round, in order. */
    std::vector<std::pair<int, int> > going;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTACT_GAPS_H_*/
