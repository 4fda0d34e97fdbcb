#include "couplings/LinkTable.h"
#include <algorithm>
#include <cstring>

using namespace cylchain;
using namespace std;

static bool precedes(const LinkEntry& entry, uint32_t number) {
    return entry.link.number < number;
}

/** A bijection of 64 bits in which each depends on all others: the finalizer of SplitMix64. */
static uint64_t mix(uint64_t bits) {
    bits = (bits^(bits>>30))*0xbf58476d1ce4e5b9;
    bits = (bits^(bits>>27))*0x94d049bb133111eb;
    return bits^(bits>>31);
}

static uint64_t bitsOf(double value) {
    // Both zeros are the same.
    value += 0.0;
    uint64_t bits;
    memcpy(&bits, &value, sizeof(bits));
    return bits;
}

static uint64_t combine(uint64_t digest, uint64_t bits) {
    return mix(digest+0x9e3779b97f4a7c15+mix(bits));
}

static uint64_t digestOf(const LinkEntry& entry) {
    const Link& link = entry.link;
    uint64_t digest = combine(link.number, static_cast<uint64_t>(link.model)*2+(entry.active ? 1 : 0));
    for (double value : {link.stiffness, link.restLength, link.maximumExtension})
        digest = combine(digest, bitsOf(value));
    for (const Place* place : {&link.first, &link.second}) {
        digest = combine(digest, static_cast<uint64_t>(static_cast<uint32_t>(place->first))<<32|
                static_cast<uint32_t>(place->second));
        digest = combine(digest, bitsOf(place->fraction));
        for (double coordinate : place->point)
            digest = combine(digest, bitsOf(coordinate));
    }
    return digest;
}

const LinkEntry* LinkTable::find(uint32_t number) const {
    const auto found = lower_bound(entries.begin(), entries.end(), number, precedes);
    return found == entries.end() || found->link.number != number ? nullptr : &*found;
}

uint64_t LinkTable::getDigest() const {
    return combine(combine(sum, entries.size()), nextNumber)>>12;
}

void LinkTable::add(const LinkEntry& entry, int sign) {
    sum += sign > 0 ? digestOf(entry) : -digestOf(entry);
}

LinkChange LinkTable::apply(const LinkChange& change) {
    LinkChange back;
    back.nextNumber = nextNumber;
    nextNumber = change.nextNumber;

    // What goes is marked by its place among the entries, and taken out at once.

    vector<size_t> gone;
    for (uint32_t number : change.removed) {
        const LinkEntry* entry = find(number);
        if (entry == nullptr)
            continue;
        gone.push_back(entry-entries.data());
        back.put.push_back(*entry);
        add(*entry, -1);
    }
    if (!gone.empty()) {
        size_t end = gone[0], next = 0;
        for (size_t i = gone[0]; i < entries.size(); i++) {
            if (next < gone.size() && gone[next] == i)
                next++;
            else
                entries[end++] = entries[i];
        }
        entries.resize(end);
    }

    const size_t before = entries.size();
    for (const LinkEntry& entry : change.put) {
        const auto last = entries.begin()+before;
        const auto found = lower_bound(entries.begin(), last, entry.link.number, precedes);
        if (found != last && found->link.number == entry.link.number) {
            back.put.push_back(*found);
            add(*found, -1);
            *found = entry;
        }
        else {
            back.removed.push_back(entry.link.number);
            entries.push_back(entry);
        }
        add(entry, 1);
    }
    const auto byNumber = [] (const LinkEntry& a, const LinkEntry& b) {return a.link.number < b.link.number;};
    if (!is_sorted(entries.begin()+(before > 0 ? before-1 : 0), entries.end(), byNumber))
        inplace_merge(entries.begin(), entries.begin()+before, entries.end(), byNumber);
    sort(back.put.begin(), back.put.end(), byNumber);
    return back;
}

LinkChange LinkTable::changeTo(const LinkTable& other) const {
    LinkChange change;
    change.nextNumber = other.nextNumber;
    for (const LinkEntry& entry : entries)
        if (other.find(entry.link.number) == nullptr)
            change.removed.push_back(entry.link.number);
    for (const LinkEntry& entry : other.entries) {
        const LinkEntry* own = find(entry.link.number);
        if (own == nullptr || digestOf(*own) != digestOf(entry))
            change.put.push_back(entry);
    }
    return change;
}

void LinkHistory::change(const LinkChange& change) {
    const uint64_t digest = table.getDigest();
    note(digest, table.apply(change));
}

bool LinkHistory::goBack(uint64_t digest) {
    const uint64_t present = table.getDigest();
    if (digest == present)
        return true;
    size_t first = changes.size();
    while (first > 0 && changes[first-1].first != digest)
        first--;
    if (first == 0)
        return false;
    first--;

    // All the way is one change, so that one can go forth again.

    vector<uint32_t> touched;
    for (size_t i = first; i < changes.size(); i++) {
        const LinkChange& back = changes[i].second;
        touched.insert(touched.end(), back.removed.begin(), back.removed.end());
        for (const LinkEntry& entry : back.put)
            touched.push_back(entry.link.number);
    }
    sort(touched.begin(), touched.end());
    touched.erase(unique(touched.begin(), touched.end()), touched.end());
    LinkChange forth;
    forth.nextNumber = table.getNextNumber();
    for (uint32_t number : touched) {
        const LinkEntry* entry = table.find(number);
        if (entry == nullptr)
            forth.removed.push_back(number);
        else
            forth.put.push_back(*entry);
    }
    for (size_t i = changes.size(); i-- > first;)
        table.apply(changes[i].second);
    note(present, move(forth));
    return true;
}

void LinkHistory::note(uint64_t digest, LinkChange back) {
    held += back.size();
    changes.emplace_back(digest, move(back));
    while (changes.size() > CHANGES || (held > LINKS && changes.size() > 1)) {
        held -= changes.front().second.size();
        changes.pop_front();
    }
}
