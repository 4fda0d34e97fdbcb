#include "networks/NetworkStep.h"
#include "networks/BodyStep.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

using namespace cylchain;
using namespace std;

namespace {

/** Several links that turn at one place do so slowly, as do contacts of plectonemes that slide. */
const int NEWTON_ITERATIONS = 50;
/**
 * Contacts that open and close in turn keep Newton's method from ending. After so many iterations, only this share of
 * each change is made.
 */
const int UNDAMPED_ITERATIONS = 14;
const double DAMPING = 0.6;
/** How far an iteration turns segments, in rad, with forces that are found where they have not turned. */
const double LARGEST_TURN = 0.25;
/** Where contacts are softer than this in a step, they are hard ones, which take less time: see ContactRest. */
const double LARGEST_SOFTNESS = 18;
/** A step is divided into at most two to this power, and where contacts are soft, before they are hard ones. */
const int LARGEST_DIVISION = 10, LARGEST_DIVISION_OF_SOFT_CONTACTS = 1;

} // namespace

/** A step, or a part of it, of some chains. */
struct NetworkStep::Attempt {
    const double *positions, *forces, *box;
    StepSettings settings;
    const vector<bool>& taken;
    const Loop& loop;
};

NetworkStep::NetworkStep(const ChainEngine& engine, const vector<Chain>& chains, const PackStepSource& beamEngine,
        const vector<BeamChain>& beams, const vector<RigidBody>& bodies, int particles) : engine(engine),
        beamEngine(beamEngine), bodies(bodies), places(chains, beams, bodies, particles),
        carried(chains, bodies), moved(3*(size_t) particles) {
}

NetworkStep::~NetworkStep() {
}

void NetworkStep::setForces(const CoupledForces& given) {
    setParticles(given.particles);
    ofForces = couplings = given.couplings;
    int numbers[] = {0, 0};
    for (ImplicitCouplings* own : ofForces)
        own->setNumber(numbers[own->areGaps()]++);
    haveGaps = numbers[true] > 0;
}

void NetworkStep::setParticles(const vector<CoupledParticle>& newParticles) {
    const bool same = newParticles.size() == particles.size() &&
            equal(particles.begin(), particles.end(), newParticles.begin(),
                    [] (const CoupledParticle& a, const CoupledParticle& b) {
                        return a.particle == b.particle && a.friction == b.friction;
                    });
    if (same)
        return;
    particles = newParticles;
    places.setParticles(particles);
    steps.clear();
}

void NetworkStep::choosePacks(const StepSettings& settings) {
    const vector<int> chosen = engine.getPacksOfStep(settings);
    if (chosen == packs && !steps.empty())
        return;
    packs = chosen;
    steps.clear();
    chainsOfLanes.clear();
    for (int pack : packs) {
        steps.push_back(engine.createStep(pack));
        chainsOfLanes.push_back(engine.getChainsOfLanes(pack));
    }
    for (int pack = 0; pack < beamEngine.getNumPacks(); pack++) {
        steps.push_back(beamEngine.createStep(pack));
        chainsOfLanes.push_back(beamEngine.getChainsOfLanes(pack));
        for (int& chain : chainsOfLanes.back())
            chain += places.getChains().size();
    }
    // Bodies are numbered behind the chains, and particles behind these.
    auto addStep = [&] (PackStep* step, size_t count, int firstNumber) {
        steps.emplace_back(step);
        chainsOfLanes.emplace_back(count);
        iota(chainsOfLanes.back().begin(), chainsOfLanes.back().end(), firstNumber);
    };
    if (!bodies.empty())
        addStep(new BodyStep(bodies), bodies.size(), places.getNumFilaments());
    if (!particles.empty())
        addStep(new ParticleStep(particles), particles.size(), places.getFirstParticle());
    stepsOfPacks.clear();
    unfinished.clear();
    flags.clear();
    for (size_t pack = 0; pack < steps.size(); pack++) {
        stepsOfPacks.push_back(steps[pack].get());
        unfinished.emplace_back(new bool[chainsOfLanes[pack].size()]);
        flags.emplace_back(new bool[chainsOfLanes[pack].size()]);
    }
    places.setPacks(chainsOfLanes);
}

Instability NetworkStep::step(const double* positions, const double* forces, const double* box,
            const StepSettings& given, double* displacements, const Loop& loop) {
    StepSettings settings = given;
    for (const ImplicitCouplings* own : ofForces)
        if (own->needDoublePrecision(places, settings.stepSize, haveGaps))
            settings.precision = Precision::Double;
    choosePacks(settings);
    iterations = substitutions = 0;
    const size_t numChains = places.getNumChains();
    const vector<bool> apart = findApart(settings);
    vector<bool> together = apart;
    together.flip();
    vector<bool> failed(numChains, false);
    Instability result;
    const Attempt whole = {positions, forces, box, settings, together, loop};
    result.chain = stepApart(whole, apart);
    if (result.chain >= 0)
        return result;
    received.clear();
    mayBeSoft = true;
    const bool taken = takeStep(whole, displacements, failed, result);
    result.iterations = iterations;
    if (!taken) {
        result.chain = find(failed.begin(), failed.end(), true)-failed.begin();
        result.coupling = culprit;
        if (result.chain < (int) places.getChains().size() &&
                carried.findHalvings(settings.stepSize, together) > LARGEST_DIVISION)
            result.body = carried.findBody(result.chain);
        return result;
    }
    for (const Impulse& impulse : received)
        impulse.receiver->add(impulse.push, impulse.duration);
    for (size_t chain = 0; chain < apart.size(); chain++)
        if (apart[chain])
            for (int particle : places.getNodes(chain))
                copy_n(&movesApart[3*particle], 3, displacements+3*particle);
    return result;
}

/** Find the chains that take the step in parts which are known beforehand, if nothing acts on them. */
vector<bool> NetworkStep::findApart(const StepSettings& settings) const {
    vector<bool> apart(places.getNumChains(), false), touched(apart);
    bool any = false;
    for (size_t pack = 0; pack < packs.size(); pack++)
        for (size_t lane = 0; lane < chainsOfLanes[pack].size(); lane++)
            if (chainsOfLanes[pack][lane] >= 0 && engine.isStepDivided(packs[pack], lane, settings))
                any = apart[chainsOfLanes[pack][lane]] = true;
    if (!any)
        return apart;
    for (const ImplicitCouplings* own : ofForces)
        own->findTouched(places, touched);
    for (const pair<int, int>& frame : carried.findPairs())
        touched[frame.first] = true;
    for (size_t chain = 0; chain < apart.size(); chain++)
        apart[chain] = apart[chain] && !touched[chain];
    return apart;
}

/** Let chains take the step by themselves; returns one by which that has gone wrong, or -1. */
int NetworkStep::stepApart(const Attempt& attempt, const vector<bool>& apart) {
    vector<int> own;
    for (size_t pack = 0; pack < packs.size(); pack++)
        if (any_of(chainsOfLanes[pack].begin(), chainsOfLanes[pack].end(), [&] (int chain) {
            return chain >= 0 && apart[chain];
        }))
            own.push_back(packs[pack]);
    if (own.empty())
        return -1;
    movesApart.resize(moved.size());
    vector<int> failed(own.size(), -1);
    attempt.loop(own.size(), [&] (int i) {
        failed[i] = engine.step(own[i], attempt.positions, attempt.forces, attempt.box, attempt.settings,
                movesApart.data()).chain;
    });
    // Others in these packs take the step with their couplings.
    for (int chain : failed)
        if (chain >= 0 && apart[chain])
            return chain;
    return -1;
}

/**
 * Attempt a step, and divide it for those chains that it fails for; false if that fails as well. What lies on top of
 * each other, as filaments that are drawn at random do, comes apart with hard contacts.
 */
bool NetworkStep::takeStep(const Attempt& whole, double* displacements, vector<bool>& failed, Instability& result) {
    if (attempt(whole, displacements, failed)) {
        addImpulses(whole.taken, whole.settings.stepSize);
        return true;
    }
    const vector<bool> divided = findComponents(failed);
    vector<bool> others = whole.taken;
    for (size_t chain = 0; chain < others.size(); chain++)
        others[chain] = others[chain] && !divided[chain];
    addImpulses(others, whole.settings.stepSize);
    result.divided = count(divided.begin(), divided.end(), true);
    const Attempt part = {whole.positions, whole.forces, whole.box, whole.settings, divided, whole.loop};
    const size_t numReceived = received.size();
    if (divide(part, 1, displacements, failed))
        return true;
    if (!areSoft)
        return false;
    received.resize(numReceived);
    mayBeSoft = false;
    return takeStep(part, displacements, failed, result);
}

bool NetworkStep::attempt(const Attempt& given, double* displacements, vector<bool>& failed) {
    const int numPacks = steps.size();
    Attempt attempt = given;
    carried.begin(attempt.positions, attempt.box, attempt.settings);
    attempt.loop(numPacks, [&] (int pack) {
        const vector<int>& chains = chainsOfLanes[pack];
        for (size_t lane = 0; lane < chains.size(); lane++)
            flags[pack][lane] = chains[lane] >= 0 && attempt.taken[chains[lane]];
        steps[pack]->begin(attempt.positions, attempt.forces, attempt.box, attempt.settings, flags[pack].get());
    });
    const CoupledStart start = {attempt.positions, attempt.settings, places, attempt.taken, active};
    gaps.begin(attempt.settings, places);
    chooseCouplings(start);
    for (ImplicitCouplings* own : couplings)
        own->begin(start, attempt.loop);
    copy(attempt.positions, attempt.positions+moved.size(), moved.begin());
    const int numStages = steps.empty() ? 0 : steps[0]->getNumStages();
    bool solved = true;
    for (int stage = 0; stage < numStages && solved; stage++)
        solved = iterate(attempt, stage);

    // Who failed, and where the others are.

    failed.assign(failed.size(), false);
    for (int pack = 0; pack < numPacks; pack++) {
        steps[pack]->findExcessiveChanges(flags[pack].get());
        const vector<int>& chains = chainsOfLanes[pack];
        for (size_t lane = 0; lane < chains.size(); lane++)
            if (chains[lane] >= 0 && attempt.taken[chains[lane]] && (flags[pack][lane] || unfinished[pack][lane]))
                failed[chains[lane]] = true;
    }
    for (ImplicitCouplings* own : couplings)
        own->findFailures(moved.data(), failed);
    carried.findFailures(attempt.settings.stepSize, attempt.taken, failed);
    gaps.findFailures(failed);
    // Where couplings alone have not converged, nobody knows whose they are.
    if (!solved && find(failed.begin(), failed.end(), true) == failed.end())
        failed = attempt.taken;
    attempt.loop(numPacks, [&] (int pack) {
        steps[pack]->getDisplacements(displacements);
    });
    carried.follow(moved.data(), attempt.taken, attempt.settings);
    return find(failed.begin(), failed.end(), true) == failed.end();
}

/** Steps that do not resolve gaps have hard ones. */
void NetworkStep::chooseCouplings(const CoupledStart& start) {
    areSoft = mayBeSoft && haveGaps;
    for (ImplicitCouplings* own : ofForces)
        areSoft = areSoft && own->findLargestSoftness(start) <= LARGEST_SOFTNESS;
    for (size_t i = 0; i < ofForces.size(); i++)
        couplings[i] = areSoft ? ofForces[i] : &ofForces[i]->getHardOnes();
}

bool NetworkStep::iterate(const Attempt& attempt, int stage) {
    const int numPacks = steps.size();
    attempt.loop(numPacks, [&] (int pack) {
        steps[pack]->beginStage(stage);
    });
    for (ImplicitCouplings* own : couplings)
        own->beginStage(stage, steps[0]->getNumStages(), moved.data());
    active.assign(numPacks, 1);
    goingOn.assign(places.getNumChains(), 1);
    vector<size_t>& first = firstEquations;
    first.resize(couplings.size()+1);
    const bool turns = any_of(couplings.begin(), couplings.end(), [] (const ImplicitCouplings* own) {
        return own->needsCompliances();
    });
    CoupledEquations::Demands demands;
    // Beam elements and bodies have double precision alone.
    demands.single = attempt.settings.precision != Precision::Double && beamEngine.getNumPacks() == 0 &&
            bodies.empty();
    for (const ImplicitCouplings* own : couplings) {
        demands.stiffness = max(demands.stiffness, own->getStiffness());
        demands.demandingStiffness = max(demands.demandingStiffness, own->getDemandingStiffness());
        demands.tolerance = min(demands.tolerance, own->getRelativeTolerance());
    }
    for (int iteration = 0; iteration < NEWTON_ITERATIONS; iteration++) {
        if (iteration > 0)
            carried.update(moved.data());
        equations.clear();
        for (size_t i = 0; i < couplings.size(); i++) {
            first[i] = equations.size();
            couplings[i]->linearise(iteration, moved.data(), equations);
        }
        first[couplings.size()] = equations.size();
        gaps.addEquations(equations, attempt.loop);
        // What the first stage takes for taut segments stays as it is for the second one.
        demands.forTensions = iteration == 0 && stage == 0 && steps[0]->getNumStages() > 1;
        if (!coupled.solve(stepsOfPacks, active, equations, attempt.settings.kT, demands, attempt.loop))
            demands.single = false;
        substitutions += coupled.getNumIterations();
        if (iteration == 0 && stage == 0) {
            coupled.findJointStiffness(stepsOfPacks, attempt.loop);
            if (turns) {
                coupled.findCompliances(stepsOfPacks, compliances, attempt.loop);
                for (size_t i = 0; i < couplings.size(); i++)
                    if (couplings[i]->needsCompliances())
                        couplings[i]->setCompliances(compliances.data()+12*first[i]);
            }
        }
        gaps.push(stepsOfPacks, active, goingOn, coupled, demands, attempt.loop);
        ShareOfChange share;
        share.part = iteration < UNDAMPED_ITERATIONS ? 1 : DAMPING;
        if (gaps.size() > 0)
            share.largestTurn = LARGEST_TURN;
        coupled.advance(stepsOfPacks, active, share, unfinished, attempt.loop);
        iterations++;
        attempt.loop(numPacks, [&] (int pack) {
            if (active[pack])
                steps[pack]->getPositions(attempt.positions, moved.data());
        });
        placeSites(moved.data());
        const bool any = finishIteration(first);
        auto findGaps = [&] (bool settled) {
            bool more = false;
            for (ImplicitCouplings* own : couplings)
                more |= own->findGaps(iteration, settled, moved.data(), gaps);
            return more;
        };
        const bool more = findGaps(false), unfinished = gaps.anyUnfinished(attempt.loop);
        if (!any && !unfinished && !(more && (findGaps(true) || gaps.anyUnfinished(attempt.loop)))) {
            bool others = false;
            for (ImplicitCouplings* own : couplings)
                others |= own->followAgain(gaps);
            if (!others || !gaps.anyUnfinished(attempt.loop))
                return true;
        }
        chooseActive();
    }
    return false;
}

/** Let virtual sites on curves follow them. */
void NetworkStep::placeSites(double* positions) const {
    for (const ImplicitCouplings* own : ofForces)
        own->placeSites(positions);
}

/** Find the chains that need another iteration, but for gaps; false if there are none. */
bool NetworkStep::finishIteration(const vector<size_t>& first) {
    PackFlags ofCouplings(active.size(), 0);
    bool unknown = false;
    for (size_t i = 0; i < couplings.size(); i++)
        if (couplings[i]->finishIteration(coupled.getMoves().data()+3*first[i], moved.data()))
            unknown |= !couplings[i]->markUnfinished(ofCouplings);
    bool any = unknown || find(ofCouplings.begin(), ofCouplings.end(), 1) != ofCouplings.end();
    auto anyHas = [&] (Rests rests) {
        return any_of(couplings.begin(), couplings.end(), [&] (const ImplicitCouplings* own) {
            return own->getRests() == rests;
        });
    };
    // Where no couplings take many iterations for a few packs, all packs end together, and rests would not pay.
    const bool rest = !unknown && anyHas(Rests::Worthwhile) && !anyHas(Rests::Wrong) && gaps.allowRests();
    goingOn.assign(goingOn.size(), !rest);
    for (size_t pack = 0; pack < active.size(); pack++)
        for (size_t lane = 0; lane < chainsOfLanes[pack].size(); lane++)
            if (const int chain = chainsOfLanes[pack][lane]; chain >= 0) {
                goingOn[chain] |= ofCouplings[pack] | unfinished[pack][lane];
                any |= unfinished[pack][lane];
            }
    for (const pair<int, int>& frame : carried.findPairs())
        goingOn[places.getNumFilaments()+frame.second] |= goingOn[frame.first];
    return any;
}

/** Let the packs of chains that go on take part in the next iteration. */
void NetworkStep::chooseActive() {
    gaps.markUnfinished(goingOn);
    for (size_t pack = 0; pack < active.size(); pack++)
        active[pack] = any_of(chainsOfLanes[pack].begin(), chainsOfLanes[pack].end(), [&] (int chain) {
            return chain >= 0 && goingOn[chain];
        });
}

/** Take note of the forces on chains that have taken a step, or a part of it. */
void NetworkStep::addImpulses(const vector<bool>& taken, double stepSize) {
    for (size_t i = 0; i < couplings.size(); i++) {
        CouplingImpulses* const receiver = ofForces[i]->getImpulses();
        if (receiver == nullptr)
            continue;
        pushes.clear();
        couplings[i]->findPushes(moved.data(), pushes);
        for (const Push& push : pushes)
            if (any_of(push.chains, push.chains+2, [&] (int chain) {return chain >= 0 && taken[chain];}))
                received.push_back({receiver, push, stepSize});
    }
}

bool NetworkStep::divide(const Attempt& whole, int division, double* displacements, vector<bool>& failed) {
    Attempt half = whole;
    half.settings.stepSize = 0.5*whole.settings.stepSize;
    half.settings.level++;
    half.settings.step *= 2;
    // Recorded forces are means over the halves.
    vector<vector<SegmentForces> >* const recorded = whole.settings.segmentForces;
    vector<vector<SegmentForces> > ofHalf;
    if (recorded != NULL) {
        ofHalf = *recorded;
        half.settings.segmentForces = &ofHalf;
    }
    // Twists of the halves' starts, their changes in a half and in both.
    vector<vector<double> > twists, turned, turnedInAll;
    if (whole.settings.twists != NULL) {
        twists = *whole.settings.twists;
        turned = turnedInAll = *whole.settings.twistChanges;
        half.settings.twists = &twists;
        half.settings.twistChanges = &turned;
    }
    const size_t size = moved.size();
    vector<double> start(whole.positions, whole.positions+size), total(size), part(size);
    half.positions = start.data();
    auto forTaken = [&] (auto function) {
        for (int chain = 0; chain < places.getNumChains(); chain++)
            if (whole.taken[chain])
                for (int particle : places.getNodes(chain))
                    for (int k = 3*particle; k < 3*particle+3; k++)
                        function(k);
    };
    // What is known beforehand need not be tried, and is no reason for hard contacts.
    const int known = carried.findHalvings(ldexp(half.settings.stepSize, division), whole.taken);
    for (int i = 0; i < 2; i++, half.settings.step++) {
        if (division < known || !attempt(half, part.data(), failed)) {
            // Contacts may be hard ones in the step, and soft ones only after some divisions.
            if (division >= LARGEST_DIVISION || (areSoft && division >= known+LARGEST_DIVISION_OF_SOFT_CONTACTS)) {
                // Now, because couplings know positions that last as long as this.
                culprit = findCulprit();
                return false;
            }
            if (!divide(half, division+1, part.data(), failed))
                return false;
        }
        else
            addImpulses(whole.taken, half.settings.stepSize);
        forTaken([&] (int k) {
            start[k] += part[k];
            total[k] += part[k];
        });
        placeSites(start.data());
        for (size_t chain = 0; chain < twists.size(); chain++)
            for (size_t joint = 0; whole.taken[chain] && joint < twists[chain].size(); joint++) {
                twists[chain][joint] += turned[chain][joint];
                turnedInAll[chain][joint] = (i == 0 ? 0 : turnedInAll[chain][joint])+turned[chain][joint];
            }
        for (size_t chain = 0; recorded != NULL && chain < recorded->size(); chain++)
            for (size_t s = 0; whole.taken[chain] && s < ofHalf[chain].size(); s++) {
                SegmentForces& mean = (*recorded)[chain][s];
                if (i == 0)
                    mean = SegmentForces();
                mean.add(ofHalf[chain][s], 0.5);
            }
    }
    forTaken([&] (int k) {
        displacements[k] = total[k];
    });
    for (size_t chain = 0; chain < turnedInAll.size(); chain++)
        if (whole.taken[chain])
            (*whole.settings.twistChanges)[chain] = turnedInAll[chain];
    return true;
}

/** Find the coupling by which the last attempt has failed: one that is known to be wrong comes first. */
BrokenCoupling NetworkStep::findCulprit() const {
    BrokenCoupling result;
    for (size_t i = 0; i < couplings.size(); i++) {
        BrokenCoupling culprit;
        if (!couplings[i]->findCulprit(moved.data(), equations.data()+firstEquations[i], culprit))
            continue;
        culprit.force = i;
        if (result.force < 0 || (result.reason == BrokenCoupling::NotSolved &&
                culprit.reason != BrokenCoupling::NotSolved))
            result = culprit;
    }
    return result;
}

vector<bool> NetworkStep::findComponents(const vector<bool>& failed) const {
    vector<pair<int, int> > pairs = carried.findPairs();
    for (pair<int, int>& frame : pairs)
        frame.second += places.getNumFilaments();
    for (const ImplicitCouplings* own : couplings)
        own->findNeighbours(pairs);
    vector<int> root(failed.size());
    iota(root.begin(), root.end(), 0);
    auto rootOf = [&] (int chain) {
        while (root[chain] != chain)
            chain = root[chain] = root[root[chain]];
        return chain;
    };
    for (const pair<int, int>& joined : pairs)
        root[rootOf(joined.first)] = rootOf(joined.second);
    vector<bool> ofRoot(failed.size()), result(failed.size());
    for (size_t chain = 0; chain < failed.size(); chain++)
        if (failed[chain])
            ofRoot[rootOf(chain)] = true;
    for (size_t chain = 0; chain < failed.size(); chain++)
        result[chain] = ofRoot[rootOf(chain)];
    return result;
}
