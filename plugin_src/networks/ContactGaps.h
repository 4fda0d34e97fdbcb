#ifndef CYLCHAIN_CONTACT_GAPS_H_
#define CYLCHAIN_CONTACT_GAPS_H_

#include "couplings/ContactSearch.h"
#include "networks/CapsuleMotion.h"
#include "networks/ContactEquations.h"
#include "networks/CurveSites.h"
#include "networks/ImplicitCouplings.h"
#include "networks/PairList.h"
#include "networks/PlaceResponses.h"
#include <cstddef>
#include <utility>
#include <vector>

namespace cylchain {

/**
 * Contacts of capsules in an implicit step: gaps between two capsules.
 *
 * A pair has one gap for its energy at the start and at the end, each with the contacts that it has then: so a step
 * back has the same gaps. Half of the force acts where they are nearest at the start, half where they are at the end.
 * One that its spring holds in goes on with the contact to the next segment. After a few iterations the places of a gap
 * stay. Where all has converged, gaps that are others by now are found again, and segments that still have crossed
 * fail.
 */
class ContactGaps : public ImplicitCouplings {
public:
    /** Set what touches. */
    void setContacts(const ContactSystem& contacts);
    bool areGaps() const override {
        return true;
    }
    void setNumber(int number) override {
        force = number;
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
        return Rests::Wrong;
    }
    bool followAgain(ReflectedGaps& gaps) override;
    void findFailures(const double* moved, std::vector<bool>& failed) override;
    bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const override;
    void findPushes(const double* moved, std::vector<Push>& pushes) const override;
    void findNeighbours(std::vector<std::pair<int, int> >& neighbours) const override;
private:
    /** Where a capsule is: its place at fraction 0, and by how much the fraction grows along it. */
    struct CapsulePlace {
        PlaceOnChain place;
        double direction;
        /** About how far a force moves the place of it that it moves most. */
        double response;
    };
    /** One gap for the energy of a pair, k gap^2/2 where it is negative: where forces act, and its gradients there. */
    struct PairGap {
        double gap;
        int count;
        double s[2], t[2];
        Vec3d gradients[2];
    };
    /** A pair whose gap may be closed. */
    struct NearPair {
        int pair;
        /** How far the capsules had travelled when it was found, and whether that was in the last iteration. */
        double way = -1;
        bool hasMoved = true;
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
        /** Whether the contact that its pair had is that of segments beside it in the end. */
        bool hasGoneOn(const ContactPair& own) const {
            return last[0] != own.a || last[1] != own.b;
        }
    };
    struct Part {
        std::vector<int> pairs;
    };
    struct Looks;
    void findPairs(const double* moved, const PairFilter& known);
    void findNewPairs(const double* moved);
    static PairGap findPairGap(const SegmentPair& pair, const Contact* contacts, int count, double radii);
    bool mayClose(int pair, double before, double after, double& room) const;
    void drawSurfaces(int first, int last);
    double placeHardSurface(int pair, double begun, Gap& gap) const;
    /** What random numbers of a pair belong to, beside its second capsule. */
    std::uint32_t keyOf(const ContactPair& pair) const {
        return (std::uint32_t) force*0x9E3779B1u+pair.a;
    }
    void selectNear(int firstNew);
    void follow(NearPair& near, bool again = false) const;
    int findContactsBeside(const ContactPair& pair, ContactPair& last, Contact* contacts) const;
    ContactPair pairOfLever(const NearPair& near, int lever) const;
    bool mayClose(const Gap& gap) const;
    bool isOfNeighbor(const NearPair& own, const std::vector<const NearPair*>& deep) const;
    double findEnd(const NearPair& near) const;
    void findCrossed();
    double radiiOf(const ContactPair& pair) const {
        const std::vector<Capsule>& capsules = search->getSystem().capsules;
        return capsules[pair.a].radius+capsules[pair.b].radius;
    }
    bool isHeld(const ContactPair& pair) const {
        return places[pair.a].place.pack < 0 && places[pair.b].place.pack < 0;
    }
    PlaceOnChain placeOf(int capsule, double fraction) const;
    /** Those of steps that do not resolve contacts. */
    ContactEquations hard;
    ContactSearch* search = nullptr;
    const ReflectedGaps* all = nullptr;
    double stiffness = 0, kT = 0;
    int force = 0, iterations = 0;
    const Loop* loop = nullptr;
    const double *begun = nullptr, *box = nullptr;
    const std::vector<CapsuleOnCurve>* onCurves = nullptr;
    const std::vector<CurveSite>* sites = nullptr;
    CouplingImpulses* impulses = nullptr;
    PlaceResponses responses;
    double slack = 0, reach = 0;
    std::vector<CapsulePlace> places;
    PairList pairs;
    /** For each pair, how far both capsules must have travelled before their gap may be closed, or -1 if it is near. */
    std::vector<double> rooms;
    /** For each pair, the exponential variate that its hard surface is found with. */
    std::vector<double> surfaces;
    std::vector<NearPair> near;
    /** Those of the last search. */
    std::vector<ContactPair> found;
    /** Those that have crossed in the end, and whether they are those of the last iteration. */
    std::vector<int> crossed;
    bool crossedAreKnown = false;
    CapsuleMotion motion;
    std::vector<Part> parts;
    /** Whether capsules move too far to look for contacts, in the periodic box or anywhere: the step is divided. */
    bool movesTooFar = false, isEndless = false;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTACT_GAPS_H_*/
