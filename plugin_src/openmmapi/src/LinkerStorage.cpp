#include "openmm/internal/LinkerStorage.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/CheckpointValues.h"
#include "openmm/internal/CylinderChainBindingForceImpl.h"
#include "openmm/internal/LinkerDescription.h"
#include "openmm/serialization/SerializationNode.h"
#include <algorithm>
#include <istream>
#include <ostream>
#include <string>
#include <vector>

using namespace cylchain;
using namespace std;

namespace OpenMM {

static const char* const CHAIN_PROPERTIES[] = {"chain1", "chain2"};
static const char* const PLACE_PROPERTIES[] = {"place1", "place2"};
/** The name of a node with events of a type of linkers. */
static const char* const EVENTS = "Events";

void writeLinkerState(SerializationNode& node, const LinkerState& state) {
    const LinkerColumns columns(state);
    node.setIntProperty("nextNumber", columns.nextNumber).setLongProperty("steps", state.steps);
    for (const LinkerEvents& events : state.events)
        node.createChildNode(EVENTS).setLongProperty("bindings", events.bindings)
                .setLongProperty("unbindings", events.unbindings);
    for (size_t i = 0; i < columns.numbers.size(); i++) {
        SerializationNode& linker = node.createChildNode("Linker");
        linker.setIntProperty("number", columns.numbers[i]).setIntProperty("type", columns.types[i]);
        if (columns.anchors[i] >= 0)
            linker.setIntProperty("anchor", columns.anchors[i]);
        if (state.getClock(i) > 0)
            linker.setDoubleProperty("clock", state.getClock(i));
        for (int side = 0; side < 2; side++)
            if (columns.chains[2*i+side] >= 0)
                linker.setIntProperty(CHAIN_PROPERTIES[side], columns.chains[2*i+side])
                        .setDoubleProperty(PLACE_PROPERTIES[side], columns.places[2*i+side]);
    }
}

LinkerState readLinkerState(const SerializationNode& node) {
    LinkerColumns columns;
    LinkerState state;
    columns.nextNumber = node.getIntProperty("nextNumber");
    for (const SerializationNode& linker : node.getChildren()) {
        if (linker.getName() == EVENTS) {
            state.events.push_back({(uint64_t) linker.getLongProperty("bindings"),
                    (uint64_t) linker.getLongProperty("unbindings")});
            continue;
        }
        state.clocks.push_back(linker.getDoubleProperty("clock", 0));
        columns.numbers.push_back(linker.getIntProperty("number"));
        columns.types.push_back(linker.getIntProperty("type"));
        columns.anchors.push_back(linker.getIntProperty("anchor", -1));
        for (int side = 0; side < 2; side++) {
            columns.chains.push_back(linker.getIntProperty(CHAIN_PROPERTIES[side], -1));
            columns.places.push_back(linker.getDoubleProperty(PLACE_PROPERTIES[side], 0));
        }
    }
    state.linkers = columns.getLinkers();
    state.nextNumber = columns.nextNumber;
    state.steps = node.getLongProperty("steps", 0);
    return state;
}

static vector<CylinderChainBindingForceImpl*> findBindingForces(ContextImpl& context) {
    vector<CylinderChainBindingForceImpl*> forces;
    for (ForceImpl* impl : context.getForceImpls()) {
        CylinderChainBindingForceImpl* force = dynamic_cast<CylinderChainBindingForceImpl*>(impl);
        if (force != NULL)
            forces.push_back(force);
    }
    return forces;
}

static void giveStates(const vector<LinkerState>& states, const vector<uint32_t>& seeds, ContextImpl& context) {
    const vector<CylinderChainBindingForceImpl*> forces = findBindingForces(context);
    if (states.size() != forces.size())
        throw OpenMMException("CylinderChainIntegrator: The State or checkpoint has the linkers of "+
                to_string(states.size())+" CylinderChainBindingForces, but the System has "+
                to_string(forces.size()));
    for (size_t i = 0; i < forces.size(); i++) {
        forces[i]->setState(states[i]);
        if (!seeds.empty())
            forces[i]->setSeed(seeds[i]);
    }
}

static const char* const WITHIN_LINKERS = "the linkers of a CylinderChainBindingForce";

void writeLinkers(ostream& stream, ContextImpl& context) {
    const vector<CylinderChainBindingForceImpl*> forces = findBindingForces(context);
    writeValue(stream, (int) forces.size());
    for (CylinderChainBindingForceImpl* force : forces) {
        const LinkerState& state = force->getState();
        for (uint64_t value : {(uint64_t) force->getSeed(), (uint64_t) state.nextNumber, state.steps,
                (uint64_t) state.events.size()})
            writeValue(stream, value);
        for (const LinkerEvents& events : state.events) {
            writeValue(stream, events.bindings);
            writeValue(stream, events.unbindings);
        }
        writeValue(stream, (uint64_t) state.linkers.size());
        for (size_t i = 0; i < state.linkers.size(); i++) {
            const Linker& linker = state.linkers[i];
            writeValue(stream, linker.number);
            writeValue(stream, linker.type);
            writeValue(stream, linker.anchor);
            writeValue(stream, state.getClock(i));
            for (const HandPlace& hand : linker.hands) {
                writeValue(stream, hand.chain);
                writeValue(stream, hand.position);
            }
        }
    }
}

void readLinkers(istream& stream, ContextImpl& context, bool withClocks, bool withTypes) {
    vector<LinkerState> states;
    vector<uint32_t> seeds;
    const int count = readValue<int>(stream, WITHIN_LINKERS);
    for (int i = 0; i < count; i++) {
        LinkerState state;
        seeds.push_back(readValue<uint64_t>(stream, WITHIN_LINKERS));
        state.nextNumber = readValue<uint64_t>(stream, WITHIN_LINKERS);
        state.steps = readValue<uint64_t>(stream, WITHIN_LINKERS);
        // Earlier versions have not counted events of each type: counts begin anew.
        const uint64_t types = withTypes ? readValue<uint64_t>(stream, WITHIN_LINKERS) : 1;
        for (uint64_t j = 0; j < types; j++) {
            LinkerEvents events;
            events.bindings = readValue<uint64_t>(stream, WITHIN_LINKERS);
            events.unbindings = readValue<uint64_t>(stream, WITHIN_LINKERS);
            if (withTypes)
                state.events.push_back(events);
        }
        const uint64_t linkers = readValue<uint64_t>(stream, WITHIN_LINKERS);
        for (uint64_t j = 0; j < linkers; j++) {
            // One by one, so that a checkpoint which is cut off cannot ask for more memory than it has.
            Linker linker;
            linker.number = readValue<uint32_t>(stream, WITHIN_LINKERS);
            linker.type = readValue<int>(stream, WITHIN_LINKERS);
            linker.anchor = readValue<int>(stream, WITHIN_LINKERS);
            if (withClocks)
                state.clocks.push_back(readValue<double>(stream, WITHIN_LINKERS));
            for (HandPlace& hand : linker.hands) {
                hand.chain = readValue<int>(stream, WITHIN_LINKERS);
                hand.position = readValue<double>(stream, WITHIN_LINKERS);
            }
            state.linkers.push_back(linker);
        }
        states.push_back(state);
    }
    giveStates(states, seeds, context);
}

void writeLinkers(SerializationNode& node, ContextImpl& context) {
    for (CylinderChainBindingForceImpl* force : findBindingForces(context))
        writeLinkerState(node.createChildNode("Linkers"), force->getState());
}

void readLinkers(const SerializationNode& node, ContextImpl& context) {
    vector<LinkerState> states;
    for (const SerializationNode& child : node.getChildren())
        if (child.getName() == "Linkers")
            states.push_back(readLinkerState(child));

    // That of a System without such Forces, or of an earlier version, says nothing about linkers.

    if (!states.empty())
        giveStates(states, {}, context);
}

} // namespace OpenMM
