#include "CommonCalcCylinderChainContactForceKernel.h"
#include "ChainTables.h"
#include "openmm/OpenMMException.h"
#include "openmm/common/ContextSelector.h"
#include <algorithm>
#include <stdexcept>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * The skin, over the largest diameter, as on the Reference platform.
 */
static const double SKIN = 0.75;

CommonCalcCylinderChainContactForceKernel::CommonCalcCylinderChainContactForceKernel(string name,
        const Platform& platform, ComputeContext& cc) : CalcCylinderChainContactForceKernel(name, platform), cc(cc),
        coupled(cc), search(NULL), stiffness(0), skin(0), periodic(false), hasList(false) {
}

void CommonCalcCylinderChainContactForceKernel::initialize(const System& system, ContactSearch& search,
        double stiffness, bool periodic) {
    this->search = &search;
    this->stiffness = stiffness;
    this->periodic = periodic;
    positions.resize(system.getNumParticles());
}

void CommonCalcCylinderChainContactForceKernel::makeKernels() {
    vector<int> particles;
    for (const Capsule& capsule : search->getSystem().capsules)
        particles.insert(particles.end(), {capsule.first, capsule.end()});
    coupled.setParticles(particles);
    uploadTo(cc, listPositions, vector<double>(3*coupled.getNumParticles()), "positionsWithPairs");
    uploadTo(cc, summary, vector<uint64_t>(1), "summaryOfContacts");
    uploadPairs();
    movedKernel = coupled.createKernel("countMoved");
    movedKernel->addArg(coupled.getNumParticles());
    movedKernel->addArg();
    for (ComputeArray* array : {&coupled.getPositions(), &listPositions, &summary})
        movedKernel->addArg(*array);
    kernel = coupled.createKernel("computeContacts");
    for (int i = 0; i < 3; i++)
        kernel->addArg();
    coupled.addArguments(kernel);
    for (ComputeArray* array : {&ends, &numbers, &energies})
        kernel->addArg(*array);
}

bool CommonCalcCylinderChainContactForceKernel::isListValid() {
    if (!hasList || skin == 0 || (periodic && coupled.getBoxNumbers() != listBox))
        return false;
    cc.clearBuffer(summary);
    movedKernel->setArg(1, 0.25*skin*skin);
    movedKernel->execute(coupled.getNumParticles());
    vector<uint64_t> moved(1);
    summary.download(moved);
    return moved[0] == 0;
}

void CommonCalcCylinderChainContactForceKernel::findPairs() {
    double diameter = 0;
    for (const Capsule& capsule : search->getSystem().capsules)
        diameter = max(diameter, 2*capsule.radius);
    hasList = false;
    coupled.downloadPositions(positions);
    listBox = coupled.getBoxNumbers();
    const double* x = &positions[0][0];
    // A box that is too small for a skin may be large enough for contacts.

    for (skin = SKIN*diameter; ; skin = 0)
        try {
            search->findPairs(x, x, periodic ? listBox.data() : NULL, skin, pairs);
            break;
        }
        catch (const invalid_argument& error) {
            if (skin == 0 || !periodic)
                throw OpenMMException(string("CylinderChainContactForce: ")+error.what());
        }
    uploadPairs();
    coupled.getPositions().copyTo(listPositions);
    hasList = true;
}

void CommonCalcCylinderChainContactForceKernel::uploadPairs() {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    vector<int> endNumbers;
    vector<double> values;
    for (const ContactPair& pair : pairs) {
        const Capsule &a = capsules[pair.a], &b = capsules[pair.b];
        for (int particle : {a.first, a.end(), b.first, b.end()})
            endNumbers.push_back(coupled.numberOf(particle));
        for (bool ofA : {true, false})
            for (bool atEnd : {false, true}) {
                const int neighbor = search->getNeighbor(ofA ? pair.a : pair.b, atEnd);
                const bool counts = neighbor >= 0 && !search->isExcluded(neighbor, ofA ? pair.b : pair.a);
                endNumbers.push_back(!counts ? -1 : coupled.numberOf(atEnd ? capsules[neighbor].end() :
                        capsules[neighbor].first));
            }
        endNumbers.push_back(pair.side);
        values.insert(values.end(), pair.shift, pair.shift+3);
        values.push_back(a.radius+b.radius);
    }
    uploadTo(cc, ends, endNumbers, "endsOfPairs");
    uploadTo(cc, numbers, values, "numbersOfPairs");
    uploadTo(cc, energies, vector<double>(pairs.size()), "energiesOfPairs");
}

double CommonCalcCylinderChainContactForceKernel::execute(ContextImpl&, bool includeForces, bool includeEnergy) {
    if (search->getSystem().capsules.empty())
        return 0;
    ContextSelector selector(cc);
    if (!kernel)
        makeKernels();
    coupled.gather();
    if (!isListValid())
        findPairs();
    if (pairs.empty())
        return 0;
    kernel->setArg(0, (int) pairs.size());
    kernel->setArg(1, (int) includeForces);
    kernel->setArg(2, stiffness);
    kernel->execute(pairs.size());
    if (includeForces)
        coupled.finishForces();
    return includeEnergy ? sumOfValues(energies, pairs.size()) : 0;
}

void CommonCalcCylinderChainContactForceKernel::copyParametersToContext(ContextImpl&, double stiffness) {
    this->stiffness = stiffness;
    hasList = false;
}
