#include "openmm/internal/LinkerDescription.h"
#include "openmm/OpenMMException.h"
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <tuple>

using namespace cylchain;
using namespace std;

namespace OpenMM {

static void refuseLinkers(const string& message) {
    throw OpenMMException("CylinderChainBindingForce: "+message);
}

LinkerColumns::LinkerColumns(const LinkerState& state) : nextNumber(state.nextNumber) {
    for (const Linker& linker : state.linkers) {
        numbers.push_back(linker.number);
        types.push_back(linker.type);
        anchors.push_back(linker.anchor);
        for (const HandPlace& hand : linker.hands) {
            chains.push_back(hand.chain);
            places.push_back(hand.position);
        }
    }
}

static void checkLinkerColumn(const char* name, size_t size, size_t expected) {
    if (size != expected)
        refuseLinkers(string("There must be ")+to_string(expected)+" "+name+", but there are "+to_string(size));
}

vector<Linker> LinkerColumns::getLinkers() const {
    const size_t count = numbers.size();
    checkLinkerColumn("types", types.size(), count);
    checkLinkerColumn("anchors", anchors.size(), count);
    checkLinkerColumn("chains", chains.size(), 2*count);
    checkLinkerColumn("places", places.size(), 2*count);
    vector<Linker> linkers;
    linkers.reserve(count);
    for (size_t i = 0; i < count; i++) {
        if (numbers[i] < 0 || (i > 0 && numbers[i] <= numbers[i-1]))
            refuseLinkers("The numbers of linkers must ascend from 0 on");
        Linker linker;
        linker.number = numbers[i];
        linker.type = types[i];
        linker.anchor = anchors[i];
        for (int side = 0; side < 2; side++)
            if (chains[2*i+side] != -1) {
                linker.hands[side].chain = chains[2*i+side];
                linker.hands[side].position = places[2*i+side];
            }
        linkers.push_back(linker);
    }
    if (nextNumber < 0 || (count > 0 && nextNumber <= numbers.back()))
        refuseLinkers("The next number must be above those of all linkers");
    return linkers;
}

FreeColumns::FreeColumns(const LinkerState& state) {
    for (size_t i = 0; 3*i < state.positions.size(); i++)
        if (!isnan(state.positions[3*i])) {
            numbers.push_back(state.linkers[i].number);
            places.insert(places.end(), &state.positions[3*i], &state.positions[3*i]+3);
        }
}

void FreeColumns::give(LinkerState& state) const {
    checkLinkerColumn("coordinates of unbound linkers", places.size(), 3*numbers.size());
    if (numbers.empty())
        return;
    state.positions.resize(3*state.linkers.size(), NO_POSITION);
    size_t i = 0;
    for (size_t k = 0; k < numbers.size(); k++) {
        if (k > 0 && numbers[k] <= numbers[k-1])
            refuseLinkers("The numbers of unbound linkers must ascend");
        while (i < state.linkers.size() && static_cast<int>(state.linkers[i].number) < numbers[k])
            i++;
        if (i == state.linkers.size() || static_cast<int>(state.linkers[i].number) != numbers[k] ||
                state.linkers[i].isHeld(0) || state.linkers[i].isHeld(1))
            refuseLinkers("There is no unbound linker with the number "+to_string(numbers[k]));
        for (int axis = 0; axis < 3; axis++) {
            if (!isfinite(places[3*k+axis]))
                refuseLinkers("The position of linker "+to_string(numbers[k])+" must be finite");
            state.positions[3*i+axis] = places[3*k+axis];
        }
    }
}

StateColumns storeLinkers(const LinkerState& state) {
    const LinkerColumns linkers(state);
    vector<double> clocks;
    clocks.reserve(state.linkers.size());
    for (size_t i = 0; i < state.linkers.size(); i++)
        clocks.push_back(state.getClock(i));
    vector<uint64_t> events;
    for (const LinkerEvents& own : state.events)
        events.insert(events.end(), {own.bindings, own.unbindings});
    StateColumns columns;
    columns.put("nextNumber", linkers.nextNumber);
    columns.put("steps", state.steps);
    columns.put("events", events);
    columns.put("numbers", linkers.numbers);
    columns.put("types", linkers.types);
    columns.put("anchors", linkers.anchors);
    columns.put("chains", linkers.chains);
    columns.put("places", linkers.places);
    columns.put("clocks", clocks);
    const FreeColumns unbound(state);
    if (!unbound.numbers.empty()) {
        columns.put("unboundNumbers", unbound.numbers);
        columns.put("unboundPlaces", unbound.places);
    }
    return columns;
}

LinkerState restoreLinkers(const StateColumns& columns) {
    LinkerColumns linkers;
    linkers.nextNumber = columns.getOne<int>("nextNumber");
    linkers.numbers = columns.get<int>("numbers");
    linkers.types = columns.get<int>("types");
    linkers.anchors = columns.get<int>("anchors");
    linkers.chains = columns.get<int>("chains");
    linkers.places = columns.get<double>("places");
    LinkerState state;
    state.linkers = linkers.getLinkers();
    state.nextNumber = linkers.nextNumber;
    state.steps = columns.getOne<uint64_t>("steps");
    state.clocks = columns.get<double>("clocks");
    const vector<uint64_t> events = columns.get<uint64_t>("events");
    checkLinkerColumn("events", events.size(), events.size()/2*2);
    for (size_t i = 0; i < events.size(); i += 2)
        state.events.push_back({events[i], events[i+1]});
    if (columns.has("unboundNumbers")) {
        FreeColumns unbound;
        unbound.numbers = columns.get<int>("unboundNumbers");
        unbound.places = columns.get<double>("unboundPlaces");
        unbound.give(state);
    }
    return state;
}

void checkLinkers(const vector<Linker>& linkers, const LinkerSystem& system, const Contours* contours) {
    // Sites by chain, spacing and number.
    set<tuple<int, double, long long> > sites;
    for (const Linker& linker : linkers) {
        const string name = "Linker "+to_string(linker.number);
        if (linker.type < 0 || linker.type >= (int) system.types.size())
            refuseLinkers(name+" has an illegal type: "+to_string(linker.type));
        const LinkerType& type = system.types[linker.type];
        if (linker.anchor < -1 || linker.anchor >= (int) system.anchors.size())
            refuseLinkers(name+" has an illegal anchor: "+to_string(linker.anchor));
        if ((linker.anchor == -1) != (type.hands[0] >= 0))
            refuseLinkers(name+(linker.anchor == -1 ? " has no anchor, but those of its type have one" :
                    " has an anchor, but those of its type have two hands"));
        if (type.concentration >= 0 && !linker.isHeld(0) && !linker.isHeld(1))
            refuseLinkers(name+" is not bound, but those of its type are only counted while they are bound: their "
                    "concentration is given");
        if (type.loadsPairs() && linker.isHeld(0) != linker.isHeld(1))
            refuseLinkers(name+" has one hand bound, but those of its type bind and unbind both at once");
        for (int side = 0; side < 2; side++) {
            const HandPlace& place = linker.hands[side];
            if (!place.isBound()) {
                if (place.chain < -1)
                    refuseLinkers(name+" is bound to an illegal filament: "+to_string(place.chain));
                continue;
            }
            if (type.hands[side] < 0)
                refuseLinkers(name+" has an anchor in the place of its first hand, but is bound with it");
            const Hand& hand = system.hands[type.hands[side]];
            if (!binary_search(hand.chains.begin(), hand.chains.end(), place.chain))
                refuseLinkers(name+" is bound to filament "+to_string(place.chain)+", to which its hand does not bind");
            const double begin = contours == NULL ? 0 : contours->getBegin(place.chain);
            if (!(place.position >= begin-1e-9*fabs(begin)))
                refuseLinkers(name+" is bound at an illegal position along filament "+to_string(place.chain));
            if (contours == NULL)
                continue;
            const double length = contours->getLength(place.chain), end = begin+length;
            if (!(place.position <= end+1e-9*(fabs(begin)+length)))
                refuseLinkers(name+" is bound "+to_string(place.position)+" nm along filament "+to_string(place.chain)+
                        (begin == 0 ? ", which is only "+to_string(length)+" nm long" : ", which has grown to between "+
                        to_string(begin)+" and "+to_string(end)+" nm"));
            if (hand.siteSpacing > 0) {
                const long long site = (long long) floor(place.position/hand.siteSpacing);
                if (site < ceil(begin/hand.siteSpacing-1e-9) || site >= floor(end/hand.siteSpacing+1e-9) ||
                        !sites.insert(make_tuple(place.chain, hand.siteSpacing, site)).second)
                    refuseLinkers(name+" is bound to site "+to_string(site)+" of filament "+to_string(place.chain)+
                            ", which does not exist or is taken");
            }
        }
    }
}

} // namespace OpenMM
