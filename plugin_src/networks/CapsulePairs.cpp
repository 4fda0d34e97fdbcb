#include "networks/CapsulePairs.h"
#include <algorithm>
#include <cmath>
#include <utility>

using namespace cylchain;
using namespace std;

namespace {

/** Contacts of a pair are the same if their fractions differ by less, in all. */
const double SAME_FRACTIONS = 0.3;

} // namespace

void CapsulePairs::clear() {
    pairs.clear();
    watches.clear();
    slots.clear();
}

void CapsulePairs::begin(vector<ContactPair>& found, int numCapsules) {
    pairs.begin(found, numCapsules);
    watches.clear();
    slots.clear();
    for (vector<Contacts>& ofChunk : contacts)
        ofChunk.clear();
    watchNew();
}

void CapsulePairs::add(const ContactPair& pair) {
    pairs.add(pair);
    watchNew();
}

void CapsulePairs::watchNew() {
    for (int i = watches.size(); i < pairs.size(); i++) {
        const ContactPair& pair = pairs.get(i);
        watches.push_back({pair.a, pair.b, -HUGE_VAL, 0, -1, pair.clearance});
    }
    slots.resize(pairs.size(), -1);
    // Chunks keep their memory from step to step.
    if ((int) contacts.size() < getNumChunks())
        contacts.resize(getNumChunks());
}

double CapsulePairs::getLargestRestGap(int number) const {
    if (!hasContacts(number))
        return 0;
    const PairContact* own = contacts[number/CHUNK][slots[number]].of;
    return max({0.0, own[0].rest.getGap(), own[1].rest.getGap()});
}

void CapsulePairs::updateGaps(int number) {
    for (int i = 0; i < watches[number].count; i++) {
        Contact& contact = getContact(number, i).contact;
        const Vec3d r = getSegments(number, true).between(contact.s, contact.t);
        const double* n = contact.normal;
        contact.gap = r.x*n[0]+r.y*n[1]+r.z*n[2]-radiiOf(pairs.get(number));
    }
}

void CapsulePairs::placeContacts(int number, const Contact* found, int count) {
    int& known = watches[number].count;
    if (!hasContacts(number)) {
        if (count <= 0) {
            known = count;
            return;
        }
        vector<Contacts>& ofChunk = contacts[number/CHUNK];
        slots[number] = ofChunk.size();
        ofChunk.emplace_back();
    }
    PairContact* const own = contacts[number/CHUNK][slots[number]].of;
    int kept = 0;
    for (int i = 0; i < known; i++)
        if (own[i].rest.isBack())
            swap(own[kept++], own[i]);
    int total = kept;
    for (int i = 0; i < count && total < 2; i++) {
        const bool same = any_of(own, own+kept, [&] (const PairContact& other) {
            return fabs(other.contact.s-found[i].s)+fabs(other.contact.t-found[i].t) < SAME_FRACTIONS;
        });
        if (same)
            continue;
        PairContact& next = own[total++];
        next.contact = found[i];
        if (next.rest.isBack())
            next.rest = ContactRest();
    }
    known = total > 0 ? total : count;
}
