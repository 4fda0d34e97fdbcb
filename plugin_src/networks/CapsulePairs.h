#ifndef CYLCHAIN_CAPSULE_PAIRS_H_
#define CYLCHAIN_CAPSULE_PAIRS_H_

#include "couplings/ContactSearch.h"
#include "networks/ContactRest.h"
#include "networks/PairList.h"
#include <vector>

namespace cylchain {

/** One of the two contacts that a pair of capsules may have. */
struct PairContact {
    /** Where it touches. */
    Contact contact;
    ContactRest rest;
    /** By how much its gap has changed while one of its packs took no part. */
    double drift;
    /** What isLastChange() takes for its change in the iteration before. */
    double changeBefore;
    /** Whether it touched in the last iteration. */
    bool touched;
};

/** The pairs of capsules that may touch in a step, and their contacts. */
class CapsulePairs {
public:
    /** What tells whether a pair is looked at: many are not. */
    struct Watch {
        int a, b;
        /** How far both capsules must have travelled before they may touch. */
        double due;
        /** They touch where they did, as long as they have not travelled this far. */
        double samePlace;
        /** The number of its contacts; -1 if they are too far apart, or if that is not known. */
        int count;
        /** How far they must have travelled before they may cross. */
        float clearance;
    };
    /** Pairs that a thread looks at together: threads may give contacts to pairs of different chunks. */
    static constexpr int CHUNK = 128;
    /** Set what finds the pairs. It must exist as long as this is used. */
    void setSearch(const ContactSearch* newSearch) {
        search = newSearch;
    }
    void clear();
    /** See PairList. */
    void begin(std::vector<ContactPair>& found, int numCapsules);
    bool isKnown(int a, int b) const {
        return pairs.isKnown(a, b);
    }
    void add(const ContactPair& pair);
    int getNumPairs() const {
        return pairs.size();
    }
    int getNumChunks() const {
        return (getNumPairs()+CHUNK-1)/CHUNK;
    }
    const ContactPair& getPair(int number) const {
        return pairs.get(number);
    }
    /** Get the sum of the radii of a pair. */
    double radiiOf(const ContactPair& pair) const {
        const std::vector<Capsule>& capsules = search->getSystem().capsules;
        return capsules[pair.a].radius+capsules[pair.b].radius;
    }
    Watch& getWatch(int number) {
        return watches[number];
    }
    const Watch& getWatch(int number) const {
        return watches[number];
    }
    /** Get whether a pair has had contacts in this step. */
    bool hasContacts(int number) const {
        return slots[number] >= 0;
    }
    /** Get a contact of a pair that has had one. */
    PairContact& getContact(int number, int which) {
        return contacts[number/CHUNK][slots[number]].of[which];
    }
    const PairContact& getContact(int number, int which) const {
        return contacts[number/CHUNK][slots[number]].of[which];
    }
    /** The gap below which a pair may push before it comes near: that of its contacts which the step resolves. */
    double getLargestRestGap(int number) const;
    /** Find the gaps of a pair's contacts where they were. */
    void updateGaps(int number);
    /** Take the contacts of a pair that were found, instead of those that do not come back. */
    void placeContacts(int number, const Contact* found, int count);
    /** Get the axes of a pair at the beginning of the step, or where an iteration has led them. */
    SegmentPair getSegments(int number, bool atEnd) const {
        return search->getSegments(pairs.get(number), atEnd);
    }
private:
    void watchNew();
    /** The contacts of a pair. */
    struct Contacts {
        PairContact of[2];
    };
    const ContactSearch* search = nullptr;
    PairList pairs;
    std::vector<Watch> watches;
    /** Where the contacts of each pair are among those of its chunk, or -1: most pairs never come near. */
    std::vector<int> slots;
    std::vector<std::vector<Contacts> > contacts;
};

} // namespace cylchain

#endif /*CYLCHAIN_CAPSULE_PAIRS_H_*/
