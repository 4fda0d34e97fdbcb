#include "CommonCylinderChains.h"
#include "ChainTables.h"
#include "CommonCylinderChainKernelSources.h"
#include "openmm/OpenMMException.h"
#include <algorithm>
#include <cstdlib>
#include <numeric>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * Chains are in a batch with others that are no longer than this many times as long.
 */
static const double LONGEST_IN_BATCH = 1.5;

/**
 * The memory of all work-items of a batch, in bytes, is no larger than this unless one of them needs more.
 */
static const double LARGEST_WORKSPACE = 1e9;

/**
 * Work-items of a GPU are in groups of this size.
 */
static const int GROUP_SIZE = layout::ITEMS_OF_CHAIN;

/**
 * A group of work-items for each chain takes implicit steps of no more chains than these.  A group takes a step in
 * about a seventh of the time of one work-item, but a GPU can have fewer groups at once.  With an estimate of 0.3 us of
 * an H100 for each chain of 64 segments and step, as many chains as these take the 1.8 ms that one work-item for each
 * of them would, however few they are; see the page on platforms.
 */
static const int MOST_CHAINS_OF_GROUPS = 6000;

/**
 * Chains that one kernel computes.
 */
struct CommonCylinderChains::Batch {
    ChainTable table;
    int items, groupSize;
    ComputeProgram program;
    ComputeArray numbers, properties, places, workspace;
    ComputeKernel advance, forces;
};

/**
 * Arrays whose size changes with the number of tethers.
 */
struct CommonCylinderChains::Arrays {
    ComputeArray firstTethers, tethers, tetherMemory;
};

/**
 * Takes note that OpenMM has changed the order of its particles.
 */
class CommonCylinderChains::ReorderListener : public ComputeContext::ReorderListener {
public:
    explicit ReorderListener(bool& slotsAreValid) : slotsAreValid(slotsAreValid) {
    }
    void execute() {
        slotsAreValid = false;
    }
private:
    bool& slotsAreValid;
};

/**
 * Whether groups take implicit steps.  The variable CYLCHAIN_WORK_ITEMS of the environment, 1 or 32, says how many
 * work-items take those of a chain.
 */
static bool takesGroups(const ComputeContext& cc, size_t numChains) {
    const char* asked = getenv("CYLCHAIN_WORK_ITEMS");
    if (asked == NULL || *asked == 0)
        return !cc.getIsCPU() && numChains <= MOST_CHAINS_OF_GROUPS;
    if (asked != to_string(GROUP_SIZE) && asked != string("1"))
        throw OpenMMException("CYLCHAIN_WORK_ITEMS must be 1 or "+to_string(GROUP_SIZE)+", but is "+asked);
    return asked != string("1");
}

template <class T> static void makeArray(ComputeContext& cc, ComputeArray& array, const vector<T>& values,
        const string& name) {
    // There are no empty arrays.
    array.initialize<T>(cc, max((size_t) 1, values.size()), name);
    if (!values.empty())
        array.upload(values);
}

CommonCylinderChains::CommonCylinderChains(ComputeContext& cc, const CylinderChainDescription& description) : cc(cc),
        description(description), usesGroups(takesGroups(cc, description.getChains().size())), slotsAreValid(false) {
    if (!cc.getSupportsDoublePrecision())
        throw OpenMMException("Filaments need a device that computes in double precision, and this one does not. "
                "Use the CPU platform, or another device");
    const vector<Chain>& chains = description.getChains();
    for (const Chain& chain : chains) {
        firstNodes.push_back(particleOfNode.size());
        particleOfNode.insert(particleOfNode.end(), chain.nodes.begin(), chain.nodes.end());
    }
    const size_t numCoordinates = 3*particleOfNode.size();
    slots.initialize<int>(cc, cc.getNumAtoms(), "slotsOfParticles");
    makeArray(cc, particles, particleOfNode, "particlesOfNodes");
    makeArray(cc, positions, vector<double>(numCoordinates), "positionsOfNodes");
    makeArray(cc, forces, vector<double>(numCoordinates), "forcesOnNodes");
    makeArray(cc, displacements, vector<double>(numCoordinates), "displacementsOfNodes");
    makeArray(cc, energies, vector<double>(layout::NUM_ENERGIES*chains.size()), "energiesOfChains");
    makeArray(cc, taken, vector<int>(chains.size()), "stepsOfChains");
    shiftNumbers.resize(3*chains.size());
    makeArray(cc, shifts, shiftNumbers, "shiftsOfChains");
    flowNumbers.resize(layout::NUM_FLOW_NUMBERS);
    makeArray(cc, flow, flowNumbers, "flow");
    boxNumbers.resize(9);
    makeArray(cc, box, boxNumbers, "boxOfChains");
    counts.resize(layout::NUM_SUMMARY_NUMBERS);
    countsBefore.resize(layout::NUM_SUMMARY_NUMBERS);
    makeArray(cc, summary, counts, "summaryOfSteps");
    makeArray(cc, work, vector<double>(layout::NUM_WORK_NUMBERS*particleOfNode.size()), "workOnNodes");
    cc.addReorderListener(new ReorderListener(slotsAreValid));
    uploadTethers();
    const ComputeProgram program = compile(cc, CommonCylinderChainKernelSources::particles);
    gatherKernel = program->createKernel("gatherNodes");
    scatterKernel = program->createKernel("scatterForces");
    moveKernel = program->createKernel("moveNodes");
}

CommonCylinderChains::~CommonCylinderChains() {
}

void CommonCylinderChains::refuseImplicitSteps(const string& platform, const string& filaments) {
    throw OpenMMException("On the "+platform+" platform, "+filaments+" take explicit steps. Use scheme \"euler\" or "
            "\"midpoint\", with a step of at most filaments.recommended_time_step(\"midpoint\", system=system), or the "
            "CPU platform");
}

ComputeProgram CommonCylinderChains::compile(ComputeContext& cc, const string& source) {
    typedef CommonCylinderChainKernelSources Sources;
    return cc.compileProgram(string(Sources::layout)+Sources::constants+Sources::vectors+Sources::noise+source);
}

ComputeProgram CommonCylinderChains::programFor(const Chain& chain, bool byGroup) {
    typedef CommonCylinderChainKernelSources Sources;
    map<string, string> defines = definesFor(chain);
    if (byGroup)
        defines["CHAIN_BY_GROUP"] = "1";
    else if (cc.getIsCPU())
        defines["CHAIN_BY_CHAIN"] = "1";
    string variant;
    for (const auto& define : defines)
        variant += define.first+" ";
    ComputeProgram& program = programs[variant];
    if (!program)
        program = cc.compileProgram(string(Sources::layout)+Sources::constants+Sources::vectors+Sources::noise+
                Sources::potentials+Sources::workspace+Sources::workItems+Sources::stages+Sources::tensionBand+
                Sources::equations+Sources::metricForces+Sources::solverOfItem+Sources::solverOfGroup+
                Sources::implicitStep+Sources::explicitStep+Sources::chainForces+Sources::chainKernels, defines);
    return program;
}

const vector<unique_ptr<CommonCylinderChains::Batch> >& CommonCylinderChains::getBatches(bool byGroup) {
    vector<unique_ptr<Batch> >& batches = byGroup ? groupBatches : itemBatches;
    if (!batches.empty())
        return batches;
    const vector<Chain>& chains = description.getChains();
    vector<int> order(chains.size());
    iota(order.begin(), order.end(), 0);
    stable_sort(order.begin(), order.end(), [&] (int a, int b) {
        return chains[a].nodes.size() > chains[b].nodes.size();
    });
    vector<vector<int> > members;
    for (int chain : order) {
        auto batch = find_if(members.begin(), members.end(), [&] (const vector<int>& others) {
            const Chain& longest = chains[others[0]];
            return definesFor(longest) == definesFor(chains[chain]) &&
                    longest.nodes.size() <= LONGEST_IN_BATCH*chains[chain].nodes.size();
        });
        if (batch == members.end())
            members.push_back({chain});
        else
            batch->push_back(chain);
    }
    for (const vector<int>& own : members)
        batches.push_back(makeBatch(own, byGroup));
    return batches;
}

unique_ptr<CommonCylinderChains::Batch> CommonCylinderChains::makeBatch(const vector<int>& members, bool byGroup) {
    unique_ptr<Batch> batch(new Batch());
    batch->table = tabulate(description.getChains(), members, firstNodes, byGroup || cc.getIsCPU());
    const ChainTable& table = batch->table;
    const double perChain = (double) sizeof(double)*table.numPlaces*table.numFields;
    const int most = max(1, (int) min(1e9, LARGEST_WORKSPACE/perChain)), blocks = max(1, cc.getNumThreadBlocks());
    batch->groupSize = byGroup || !cc.getIsCPU() ? GROUP_SIZE : 1;
    if (byGroup)
        batch->items = min(min(table.numChains, most), blocks)*GROUP_SIZE;
    else if (cc.getIsCPU())
        batch->items = min(table.numChains, blocks);
    else
        batch->items = (min(table.numChains, most)+GROUP_SIZE-1)/GROUP_SIZE*GROUP_SIZE;
    makeArray(cc, batch->numbers, table.numbers, "chains");
    makeArray(cc, batch->properties, table.properties, "propertiesOfChains");
    makeArray(cc, batch->places, table.places, "places");
    batch->program = programFor(description.getChains()[members[0]], byGroup);
    return batch;
}

void CommonCylinderChains::uploadTethers() {
    TetherTable table = tabulateTethers(description.getChains());
    arrays.reset(new Arrays());
    makeArray(cc, arrays->firstTethers, table.first, "firstTethers");
    makeArray(cc, arrays->tethers, table.properties, "tethers");
    makeArray(cc, arrays->tetherMemory,
            vector<double>(table.properties.size()/layout::NUM_TETHER_PROPERTIES*layout::NUM_TETHER_FIELDS),
            "tetherMemory");
}

void CommonCylinderChains::update() {
    itemBatches.clear();
    groupBatches.clear();
    uploadTethers();
}

ComputeArray& CommonCylinderChains::getSlots() {
    if (!slotsAreValid) {
        const vector<int>& order = cc.getAtomIndex();
        slotOfParticle.resize(cc.getNumAtoms());
        for (int slot = 0; slot < cc.getNumAtoms(); slot++)
            slotOfParticle[order[slot]] = slot;
        slots.upload(slotOfParticle);
        slotsAreValid = true;
    }
    return slots;
}

void CommonCylinderChains::updateBox() {
    Vec3 vectors[3];
    cc.getPeriodicBoxVectors(vectors[0], vectors[1], vectors[2]);
    vector<double> present;
    for (const Vec3& vector : vectors)
        present.insert(present.end(), {vector[0], vector[1], vector[2]});
    if (present != boxNumbers) {
        boxNumbers = present;
        box.upload(boxNumbers);
    }
}

void CommonCylinderChains::updateShifts() {
    // OpenMM wraps whole molecules into the box, but the points of tethers stay where they are.

    vector<double> present(shiftNumbers.size());
    const vector<Chain>& chains = description.getChains();
    if (any_of(chains.begin(), chains.end(), [] (const Chain& chain) {return !chain.tethers.empty();})) {
        getSlots();
        for (size_t chain = 0; chain < chains.size(); chain++) {
            const mm_int4 offset = cc.getPosCellOffsets()[slotOfParticle[chains[chain].nodes[0]]];
            for (int k = 0; k < 3; k++)
                present[3*chain+k] = -(offset.x*boxNumbers[k]+offset.y*boxNumbers[3+k]+offset.z*boxNumbers[6+k]);
        }
    }
    if (present != shiftNumbers) {
        shiftNumbers = present;
        shifts.upload(shiftNumbers);
    }
}

int CommonCylinderChains::describeStep(const StepSettings& settings) {
    updateBox();
    updateShifts();
    vector<double> present(layout::NUM_FLOW_NUMBERS);
    copy(settings.flow.velocity, settings.flow.velocity+3, present.begin()+layout::FLOW_VELOCITY);
    copy(settings.flow.gradient, settings.flow.gradient+9, present.begin()+layout::FLOW_GRADIENT);
    copy(settings.flow.origin, settings.flow.origin+3, present.begin()+layout::FLOW_ORIGIN);
    if (present != flowNumbers) {
        flowNumbers = present;
        flow.upload(flowNumbers);
    }
    return (settings.scheme == Scheme::ImplicitSecondOrder ? layout::TWO_STAGES : 0) |
            (settings.scheme == Scheme::Euler ? layout::IS_EULER : 0) |
            (settings.scheme == Scheme::Midpoint ? layout::IS_MIDPOINT : 0) |
            (settings.flow.present ? layout::HAS_FLOW : 0) | (settings.flow.varies() ? layout::FLOW_VARIES : 0) |
            (settings.flow.box != NULL ? layout::FLOW_IS_PERIODIC : 0) |
            (description.usesPeriodicBoundaryConditions() ? layout::IS_PERIODIC : 0);
}

void CommonCylinderChains::readSummary() {
    // Kernels count on and on, so that nothing has to be set to zero in a step.

    vector<uint64_t> present(layout::NUM_SUMMARY_NUMBERS);
    summary.download(present);
    for (size_t i = 0; i < present.size(); i++)
        counts[i] = present[i]-countsBefore[i];
    countsBefore = present;
}

int CommonCylinderChains::flagsOf(const StepWork& work) {
    return (work.watched ? layout::IS_WATCHED : 0) | (work.followsOn ? layout::FOLLOWS_ON : 0) |
            (work.beginsWindow ? layout::BEGINS_WINDOW : 0);
}

void CommonCylinderChains::copyWork(const ComputeArray& work, const vector<int>& particles, vector<WorkSums>& sums) {
    vector<double> found(work.getSize());
    work.download(found);
    for (size_t i = 0; i < particles.size(); i++) {
        const double* own = &found[layout::NUM_WORK_NUMBERS*i];
        WorkSums& result = sums[particles[i]];
        for (int k = 0; k < 3; k++) {
            result.change[k] = own[layout::WORK_CHANGE+k];
            result.way[k] = own[layout::WORK_WAY+k];
        }
        result.work = own[layout::WORK_DONE];
    }
}

void CommonCylinderChains::getWork(vector<WorkSums>& sums) {
    copyWork(work, particleOfNode, sums);
}

void CommonCylinderChains::gather(bool withForces, const StepWork& work) {
    getSlots();
    if (!gatherHasArguments) {
        gatherHasArguments = true;
        gatherKernel->addArg((int) particleOfNode.size());
        gatherKernel->addArg(cc.getPaddedNumAtoms());
        for (int i = 0; i < 3; i++)
            gatherKernel->addArg();
        gatherKernel->addArg(cc.getPosq());
        if (cc.getUseMixedPrecision())
            gatherKernel->addArg(cc.getPosqCorrection());
        gatherKernel->addArg(cc.getLongForceBuffer());
        for (ComputeArray* array : {&particles, &slots, &positions, &forces, &displacements, &this->work})
            gatherKernel->addArg(*array);
    }
    gatherKernel->setArg(2, (int) withForces);
    gatherKernel->setArg(3, flagsOf(work));
    gatherKernel->setArg(4, work.perEnergy);
    gatherKernel->execute(particleOfNode.size());
}

void CommonCylinderChains::addForces(bool includeForces, ChainEnergy* energy) {
    updateBox();
    updateShifts();
    const int flags = description.usesPeriodicBoundaryConditions() ? layout::IS_PERIODIC : 0;
    for (const unique_ptr<Batch>& batch : getBatches(false)) {
        if (!batch->forces) {
            batch->forces = batch->program->createKernel("computeForces");
            batch->forces->addArg(batch->table.numChains);
            batch->forces->addArg(batch->table.numPlaces);
            batch->forces->addArg(flags);
            for (ComputeArray* array : {&positions, &forces, &energies, &batch->places, &batch->numbers,
                    &batch->properties, &shifts, &arrays->firstTethers, &arrays->tethers, &box})
                batch->forces->addArg(*array);
        }
        batch->forces->execute(batch->table.numChains, batch->groupSize);
    }
    if (includeForces) {
        if (!scatterHasArguments) {
            scatterHasArguments = true;
            scatterKernel->addArg((int) particleOfNode.size());
            scatterKernel->addArg(cc.getPaddedNumAtoms());
            scatterKernel->addArg(cc.getLongForceBuffer());
            for (ComputeArray* array : {&particles, &slots, &forces})
                scatterKernel->addArg(*array);
        }
        scatterKernel->execute(particleOfNode.size());
    }
    if (energy == NULL)
        return;
    vector<double> found(energies.getSize());
    energies.download(found);
    for (size_t chain = 0; chain < description.getChains().size(); chain++) {
        energy->stretching += found[layout::NUM_ENERGIES*chain+layout::STRETCHING_ENERGY];
        energy->bending += found[layout::NUM_ENERGIES*chain+layout::BENDING_ENERGY];
        energy->tethers += found[layout::NUM_ENERGIES*chain+layout::TETHER_ENERGY];
    }
}

int CommonCylinderChains::advance(const StepSettings& settings, int count, bool findsForces, long long& divided) {
    divided = 0;
    stepsTaken.assign(description.getChains().size(), count);
    if (count == 0)
        return 0;
    const int flags = describeStep(settings) | (findsForces ? layout::FINDS_FORCES : 0);
    const bool isImplicit = settings.scheme == Scheme::Implicit || settings.scheme == Scheme::ImplicitSecondOrder;
    const bool byGroup = usesGroups && isImplicit;
    for (const unique_ptr<Batch>& batch : getBatches(byGroup)) {
        if (!batch->advance) {
            const size_t chainsAtOnce = batch->items/(byGroup ? GROUP_SIZE : 1);
            batch->workspace.initialize<double>(cc, chainsAtOnce*batch->table.numPlaces*batch->table.numFields,
                    "workspace");
            batch->advance = batch->program->createKernel("advanceChains");
            batch->advance->addArg(batch->table.numChains);
            batch->advance->addArg(batch->table.numPlaces);
            for (int i = 0; i < 7; i++)
                batch->advance->addArg();
            for (ComputeArray* array : {&positions, &forces, &energies, &displacements, &batch->workspace,
                    &batch->places, &batch->numbers, &batch->properties, &shifts, &arrays->firstTethers,
                    &arrays->tethers, &arrays->tetherMemory, &flow, &box, &taken, &summary})
                batch->advance->addArg(*array);
        }
        const ComputeKernel kernel = batch->advance;
        kernel->setArg(2, count);
        kernel->setArg(3, flags);
        kernel->setArg(4, settings.stepSize);
        kernel->setArg(5, settings.kT);
        kernel->setArg(6, (uint32_t) settings.seed);
        kernel->setArg(7, (uint32_t) settings.level);
        kernel->setArg(8, settings.step);
        kernel->execute(batch->items, batch->groupSize);
    }
    readSummary();
    divided = counts[layout::NUM_DIVIDED_STEPS];
    if (counts[layout::NUM_UNSTABLE_CHAINS] > 0)
        taken.download(stepsTaken);
    return stepsTaken.empty() ? count : *min_element(stepsTaken.begin(), stepsTaken.end());
}

int CommonCylinderChains::getFirstUnstable() const {
    return min_element(stepsTaken.begin(), stepsTaken.end())-stepsTaken.begin();
}

void CommonCylinderChains::moveNodes(double stepSize) {
    getSlots();
    if (!moveHasArguments) {
        moveHasArguments = true;
        moveKernel->addArg((int) particleOfNode.size());
        moveKernel->addArg(1/stepSize);
        moveKernel->addArg(cc.getPosq());
        if (cc.getUseMixedPrecision())
            moveKernel->addArg(cc.getPosqCorrection());
        moveKernel->addArg(cc.getVelm());
        for (ComputeArray* array : {&particles, &slots, &positions, &displacements})
            moveKernel->addArg(*array);
    }
    moveKernel->setArg(1, 1/stepSize);
    moveKernel->execute(particleOfNode.size());
}

void CommonCylinderChains::getDisplacements(vector<Vec3>& result) {
    vector<double> found(displacements.getSize());
    displacements.download(found);
    for (size_t node = 0; node < particleOfNode.size(); node++)
        result[particleOfNode[node]] = Vec3(found[3*node], found[3*node+1], found[3*node+2]);
}
