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
static const int GROUP_SIZE = 32;

/**
 * Work-items of a chain where several chains can share a group.
 */
static const int ITEMS_OF_PART = 8;

/**
 * Several work-items for each chain take a step sooner than one, but a GPU has work-items for so many chains at once.
 * On an H200, parts of groups are faster than whole ones for more chains than so many times the nodes of one (250 of 10
 * segments, 1600 of 64), and one work-item is faster than parts for more chains than 5000 of any length.  Where there
 * are no parts, one work-item is faster than a group for more than 100 times the nodes of one, but for long chains.
 */
static const double CHAINS_OF_WHOLE_GROUPS_PER_NODE = 25, CHAINS_OF_GROUPS_PER_NODE = 100;
static const int MOST_CHAINS_OF_PARTS = 5000, MOST_CHAINS_OF_GROUPS = 6000;

/**
 * The numbers of places for which programs of several work-items are compiled are multiples of this.
 */
static const int PLACES_TOGETHER = 8;

/**
 * Chains that one kernel computes.
 */
struct CommonCylinderChains::Batch {
    ChainTable table;
    int itemsOfChain, chainsOfGroup, groupSize, numGroups;
    /** The places for which a chain has memory; the fields of them that are in the memory of a group. */
    int placesOfMemory, localFields;
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
 * How many work-items take the implicit steps of a chain: what the variable CYLCHAIN_WORK_ITEMS of the environment
 * says, 1, 8 or 32, or what is fastest.
 */
static int findItemsOfSteps(const ComputeContext& cc, const WorkItemGroups& groups, const vector<Chain>& chains) {
    const char* asked = getenv("CYLCHAIN_WORK_ITEMS");
    if (asked != NULL && *asked != 0) {
        for (int items : {1, ITEMS_OF_PART, GROUP_SIZE})
            if (asked == to_string(items))
                return items;
        throw OpenMMException("CYLCHAIN_WORK_ITEMS must be 1, "+to_string(ITEMS_OF_PART)+" or "+
                to_string(GROUP_SIZE)+", but is "+asked);
    }
    if (cc.getIsCPU() || chains.empty())
        return 1;
    double nodes = 0;
    for (const Chain& chain : chains)
        nodes += chain.nodes.size()/(double) chains.size();
    if (!groups.waitInParts)
        return chains.size() > min(CHAINS_OF_GROUPS_PER_NODE*nodes, (double) MOST_CHAINS_OF_GROUPS) ? 1 : GROUP_SIZE;
    if (chains.size() > MOST_CHAINS_OF_PARTS)
        return 1;
    return chains.size() > CHAINS_OF_WHOLE_GROUPS_PER_NODE*nodes ? ITEMS_OF_PART : GROUP_SIZE;
}

template <class T> static void makeArray(ComputeContext& cc, ComputeArray& array, const vector<T>& values,
        const string& name) {
    // There are no empty arrays.
    array.initialize<T>(cc, max((size_t) 1, values.size()), name);
    if (!values.empty())
        array.upload(values);
}

CommonCylinderChains::CommonCylinderChains(ComputeContext& cc, const WorkItemGroups& groups,
        const CylinderChainDescription& description) : cc(cc), description(description), groups(groups),
        itemsOfSteps(findItemsOfSteps(cc, groups, description.getChains())), slotsAreValid(false) {
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

ComputeProgram CommonCylinderChains::programFor(const Chain& chain, const Batch& batch) {
    typedef CommonCylinderChainKernelSources Sources;
    map<string, string> defines = definesFor(chain);
    defines["ITEMS_OF_CHAIN"] = to_string(batch.itemsOfChain);
    if (batch.itemsOfChain > 1) {
        defines["CHAIN_BY_GROUP"] = "1";
        defines["CHAINS_OF_GROUP"] = to_string(batch.chainsOfGroup);
        defines["NUM_PLACES"] = to_string(batch.placesOfMemory);
        defines["NUM_LOCAL_FIELDS"] = to_string(batch.localFields);
    }
    else if (cc.getIsCPU())
        defines["CHAIN_BY_CHAIN"] = "1";
    string variant;
    for (const auto& define : defines)
        variant += define.first+"="+define.second+" ";
    ComputeProgram& program = programs[variant];
    if (!program)
        program = cc.compileProgram(string(Sources::layout)+Sources::constants+Sources::vectors+Sources::noise+
                Sources::potentials+Sources::workspace+Sources::workItems+Sources::stages+Sources::tensionBand+
                Sources::equations+Sources::metricForces+Sources::solverOfItem+Sources::solverOfGroup+
                Sources::implicitStep+Sources::explicitStep+Sources::chainForces+Sources::chainKernels, defines);
    return program;
}

const vector<unique_ptr<CommonCylinderChains::Batch> >& CommonCylinderChains::getBatches(int items) {
    vector<unique_ptr<Batch> >& own = batches[items];
    if (!own.empty())
        return own;
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
    for (const vector<int>& alike : members)
        own.push_back(makeBatch(alike, items));
    return own;
}

unique_ptr<CommonCylinderChains::Batch> CommonCylinderChains::makeBatch(const vector<int>& members, int items) {
    unique_ptr<Batch> batch(new Batch());
    batch->table = tabulate(description.getChains(), members, firstNodes, items > 1 || cc.getIsCPU());
    const ChainTable& table = batch->table;
    const bool isRing = description.getChains()[members[0]].closed;
    batch->itemsOfChain = items;
    const bool fillsGroup = items > 1 ? groups.waitInParts : !cc.getIsCPU();
    batch->chainsOfGroup = fillsGroup ? GROUP_SIZE/items : 1;
    batch->groupSize = batch->chainsOfGroup*items;
    batch->placesOfMemory = table.numPlaces;
    batch->localFields = 0;
    if (items > 1) {
        // Programs are compiled for a number of places: chains of similar lengths share one.
        batch->placesOfMemory = (table.numPlaces+PLACES_TOGETHER-1)/PLACES_TOGETHER*PLACES_TOGETHER;
        const int others = layout::NUM_EXCHANGED*items+
                (isRing ? layout::SIZE_OF_MIDDLE_OF_RING : layout::SIZE_OF_MIDDLE_OF_OPEN_CHAIN);
        const int free = (groups.localMemory/(int) sizeof(double)-1)/batch->chainsOfGroup-others;
        batch->localFields = max(0, min(table.numFields, free/batch->placesOfMemory));
    }
    const double perChain = (double) sizeof(double)*batch->placesOfMemory*table.numFields;
    const int most = min(table.numChains, max(1, (int) min(1e9, LARGEST_WORKSPACE/perChain)));
    batch->numGroups = (most+batch->chainsOfGroup-1)/batch->chainsOfGroup;
    if (items > 1 || cc.getIsCPU())
        batch->numGroups = min(batch->numGroups, max(1, cc.getNumThreadBlocks()));
    makeArray(cc, batch->numbers, table.numbers, "chains");
    makeArray(cc, batch->properties, table.properties, "propertiesOfChains");
    makeArray(cc, batch->places, table.places, "places");
    batch->program = programFor(description.getChains()[members[0]], *batch);
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
    batches.clear();
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
    for (const unique_ptr<Batch>& batch : getBatches(1)) {
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
    for (const unique_ptr<Batch>& batch : getBatches(isImplicit ? itemsOfSteps : 1)) {
        if (!batch->advance) {
            const size_t chainsAtOnce = (size_t) batch->numGroups*batch->chainsOfGroup;
            const size_t perChain = (size_t) batch->placesOfMemory*(batch->table.numFields-batch->localFields);
            batch->workspace.initialize<double>(cc, max((size_t) 1, chainsAtOnce*perChain), "workspace");
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
        kernel->execute(batch->numGroups*batch->groupSize, batch->groupSize);
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
