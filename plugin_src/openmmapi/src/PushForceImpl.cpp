#include "openmm/internal/PushForceImpl.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/CheckpointValues.h"
#include <istream>
#include <ostream>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

void PushForceImpl::refuseTwoStages() const {
    throw OpenMMException("CylinderChainIntegrator: Contacts and walls are for scheme Implicit: in the two stages of "
            "ImplicitSecondOrder they would not keep their equilibrium");
}

double PushForceImpl::takeMeanForces(ContextImpl& context, int reader, vector<double>& forces, vector<int>& numbers,
        vector<double>& sums, vector<double>& loads) {
    if (reader < 0 || reader >= (int) impulses.getReaders().size())
        throw OpenMMException("There is no reader "+to_string(reader)+" of forces: call addForceReader() first");
    CouplingImpulses::Sums found = impulses.take(reader);
    const double duration = found.time;
    if (duration == 0) {
        vector<Push> pushes;
        findPushes(context, pushes);
        for (const Push& push : pushes)
            found.add(push, 1);
    }
    const double scale = duration == 0 ? 1 : 1/duration;
    forces = found.particles;
    for (double& force : forces)
        force *= scale;
    for (const auto& entry : found.loads) {
        numbers.insert(numbers.end(), {entry.first.first, entry.first.second});
        for (double force : entry.second.force)
            sums.push_back(scale*force);
        loads.push_back(scale*entry.second.size);
    }
    return duration;
}

static void writeSums(ostream& stream, const CouplingImpulses::Sums& sums) {
    writeValue(stream, sums.time);
    writeValue(stream, (int) sums.particles.size());
    for (double value : sums.particles)
        writeValue(stream, value);
    writeValue(stream, (int) sums.loads.size());
    for (const auto& entry : sums.loads) {
        writeValue(stream, entry.first.first);
        writeValue(stream, entry.first.second);
        writeValue(stream, entry.second);
    }
}

static CouplingImpulses::Sums readSums(istream& stream, size_t size) {
    const char* const within = "the forces of contacts and walls";
    CouplingImpulses::Sums sums;
    sums.time = readValue<double>(stream, within);
    if (readValue<int>(stream, within) != (int) size)
        throw OpenMMException("loadCheckpoint: The checkpoint has forces of another number of particles");
    sums.particles.resize(size);
    for (double& value : sums.particles)
        value = readValue<double>(stream, within);
    for (int i = readValue<int>(stream, within); i > 0; i--) {
        const int first = readValue<int>(stream, within), second = readValue<int>(stream, within);
        sums.loads[{first, second}] = readValue<CouplingImpulses::Load>(stream, within);
    }
    return sums;
}

void PushForceImpl::writeForces(ostream& stream) const {
    writeSums(stream, impulses.getLatest());
    writeValue(stream, (int) impulses.getReaders().size());
    for (const CouplingImpulses::Sums& own : impulses.getReaders())
        writeSums(stream, own);
}

void PushForceImpl::readForces(istream& stream) {
    const size_t size = impulses.getLatest().particles.size();
    const CouplingImpulses::Sums latest = readSums(stream, size);
    vector<CouplingImpulses::Sums> readers;
    for (int i = readValue<int>(stream, "the forces of contacts and walls"); i > 0; i--)
        readers.push_back(readSums(stream, size));
    impulses.restore(latest, readers);
}
