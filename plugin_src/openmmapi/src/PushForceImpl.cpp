#include "openmm/internal/PushForceImpl.h"
#include "openmm/OpenMMException.h"
#include <algorithm>

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

StateColumns PushForceImpl::storeState(bool) {
    const vector<CouplingImpulses::Sums>& readers = impulses.getReaders();
    vector<double> times, particles, loads;
    vector<int> counts, between;
    auto add = [&] (const CouplingImpulses::Sums& sums) {
        times.push_back(sums.time);
        particles.insert(particles.end(), sums.particles.begin(), sums.particles.end());
        counts.push_back(sums.loads.size());
        for (const auto& entry : sums.loads) {
            between.insert(between.end(), {entry.first.first, entry.first.second});
            loads.insert(loads.end(), entry.second.force, entry.second.force+3);
            loads.push_back(entry.second.size);
        }
    };
    add(impulses.getLatest());
    for (const CouplingImpulses::Sums& own : readers)
        add(own);
    StateColumns columns;
    columns.put("times", times);
    columns.put("particles", particles);
    columns.put("counts", counts);
    columns.put("between", between);
    columns.put("loads", loads);
    return columns;
}

void PushForceImpl::restoreState(const StateColumns& columns) {
    const vector<double> times = columns.get<double>("times"), particles = columns.get<double>("particles"),
            loads = columns.get<double>("loads");
    const vector<int> counts = columns.get<int>("counts"), between = columns.get<int>("between");
    const size_t size = impulses.getLatest().particles.size();
    if (times.empty() || counts.size() != times.size() || particles.size() != size*times.size())
        throw OpenMMException("loadCheckpoint: The checkpoint has forces of another number of particles");
    vector<CouplingImpulses::Sums> sums(times.size());
    size_t next = 0;
    for (size_t i = 0; i < sums.size(); i++) {
        sums[i].time = times[i];
        sums[i].particles.assign(particles.begin()+i*size, particles.begin()+(i+1)*size);
        for (int k = 0; k < counts[i]; k++, next++) {
            if (2*next+2 > between.size() || 4*next+4 > loads.size())
                throw OpenMMException("loadCheckpoint: The checkpoint lacks forces of contacts or walls");
            CouplingImpulses::Load& load = sums[i].loads[{between[2*next], between[2*next+1]}];
            copy(loads.begin()+4*next, loads.begin()+4*next+3, load.force);
            load.size = loads[4*next+3];
        }
    }
    impulses.restore(sums[0], {sums.begin()+1, sums.end()});
}
