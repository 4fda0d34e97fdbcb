#include "openmm/internal/CylinderChainBindingForceImpl.h"
#include "couplings/Contours.h"
#include "couplings/EndLinks.h"
#include "couplings/Walls.h"
#include "openmm/CylinderChainException.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/CylinderChainForceImpl.h"
#include "openmm/internal/CylinderChainWallForceImpl.h"
#include "openmm/internal/LinkDescription.h"
#include "openmm/internal/LinkerDescription.h"
#include "openmm/internal/OSRngSeed.h"
#include "openmm/internal/StateDigest.h"
#include "openmm/reference/SimTKOpenMMRealType.h"
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

using namespace OpenMM;
using namespace std;

/** A site is known by a number of 32 bits, and a spacing by one of four. */
static const double MOST_SITES = 1e9;
static const size_t MOST_SPACINGS = 16;
/** Numbers of linkers are below 2^31, also of those that come out of their concentration in one more step. */
static const uint32_t LAST_NUMBER = 2000000000;

static double digestOf(const cylchain::LinkerState& state) {
    StateDigest digest;
    digest.mix(state.steps);
    digest.mix(state.nextNumber);
    // Before the first step, there are no counts of events.
    for (size_t type = 0; type < state.events.size(); type++)
        if (state.events[type].bindings+state.events[type].unbindings > 0) {
            digest.mix(type);
            digest.mix(state.events[type].bindings);
            digest.mix(state.events[type].unbindings);
        }
    return digest.get();
}

static void require(bool condition, const string& message) {
    if (!condition)
        throw OpenMMException("CylinderChainBindingForce: "+message);
}

CylinderChainBindingForceImpl::CylinderChainBindingForceImpl(const CylinderChainBindingForce& owner) :
        SpringForceImpl(owner), owner(owner), seed(0), number(0), upToDate(false), wasExcluded(false),
        hasStepped(false), timeBefore(0), stepSize(0), countBefore(0) {
}

void CylinderChainBindingForceImpl::initialize(ContextImpl& context) {
    initializeLinks(context, owner.usesPeriodicBoundaryConditions());
    const System& ofContext = context.getSystem();

    // Each such Force of a System has a parameter of its own.

    const CylinderChainForce* chains = NULL;
    int before = 0;
    for (int i = 0; i < ofContext.getNumForces(); i++) {
        const Force* force = &ofContext.getForce(i);
        if (force == &owner)
            number = before;
        if (dynamic_cast<const CylinderChainBindingForce*>(force) != NULL)
            before++;
        if (dynamic_cast<const CylinderChainForce*>(force) != NULL)
            chains = dynamic_cast<const CylinderChainForce*>(force);
    }
    require(chains != NULL, "The System has no CylinderChainForce with chains to bind to");
    parameter = "CylinderChainLinkers"+to_string(number);
    const CylinderChainDescription description(ofContext, *chains);
    contours.reset(new cylchain::Contours(description.getList()));
    system = {};
    set<double> spacings;
    for (int i = 0; i < owner.getNumHands(); i++) {
        system.hands.push_back(owner.getHand(i));
        const cylchain::Hand& hand = system.hands.back();
        require(hand.chains.empty() || hand.chains.back() < contours->getNumChains(),
                "Hand "+to_string(i)+" binds to a chain that does not exist");
        for (int chain : hand.chains)
            require(hand.siteSpacing == 0 || contours->getLength(chain)/hand.siteSpacing < MOST_SITES, "Chain "+
                    to_string(chain)+" would have more than a thousand million sites of hand "+to_string(i)+
                    ": sites so near to each other cannot be told apart");
        require(hand.slidingFriction == 0 || (hand.siteSpacing == 0 && hand.speed == 0), "Hand "+to_string(i)+
                " slides: it has neither sites nor a speed");
        if (hand.siteSpacing > 0)
            spacings.insert(hand.siteSpacing);
        require(spacings.size() <= MOST_SPACINGS, "Hands have more than "+to_string(MOST_SPACINGS)+
                " different spacings of sites");
    }
    checkReaches(context);
    for (int i = 0; i < owner.getNumLinkerTypes(); i++) {
        system.types.push_back(owner.getLinkerType(i));
        const cylchain::LinkerType& type = system.types.back();
        require(type.hands[0] < 0 || type.volume > 0 || type.concentration >= 0 || type.diffuses() ||
                ofContext.usesPeriodicBoundaryConditions(), "Linkers of type "+to_string(i)+
                " need a volume or a concentration, since there is no periodic box");
    }
    for (int i = 0; i < owner.getNumAnchors(); i++) {
        cylchain::Place place;
        Vec3 point;
        owner.getAnchor(i, place.first, point);
        require(place.first < ofContext.getNumParticles(), "Anchor "+to_string(i)+
                " is at a particle that does not exist");
        for (int k = 0; k < 3; k++)
            place.point[k] = point[k];
        system.anchors.push_back(place);
    }
    for (int i = 0; i < owner.getNumBranchJoints(); i++)
        for (int type : owner.getBranchJoint(i).types)
            require(type >= 0 && type < owner.getNumLinkerTypes() && system.types[type].hands[0] >= 0 &&
                    system.types[type].concentration == 0, "The joint of branches "+to_string(i)+" needs linkers with "
                    "two hands that come from no concentration");
    checkHelices(description.getList());
    system.barriers = owner.getBarriers();
    for (const cylchain::Barrier& barrier : system.barriers)
        require(barrier.chain < contours->getNumChains() && barrier.position <= contours->getLength(barrier.chain),
                "There is a barrier on a chain that does not exist, or beyond the end of one");
    state = owner.getState();
    state.events.resize(system.types.size());
    checkDiffusion();
    checkLinkers(state.linkers, system, contours.get());
    const CylinderChainIntegrator* integrator = findIntegrator();
    seed = (uint32_t) (integrator == NULL ? owner.getRandomNumberSeed() : integrator->getRandomNumberSeed());
    if (seed == 0)
        seed = (uint32_t) osrngseed();
    linkerKernel = context.getPlatform().createKernel(UpdateCylinderChainLinkersKernel::Name(), context);
    linkerKernel.getAs<UpdateCylinderChainLinkersKernel>().initialize(system, description.getList(),
            owner.usesPeriodicBoundaryConditions(), nearestParticles);
    placeUnbound(state);
    upToDate = false;
}

void CylinderChainBindingForceImpl::checkDiffusion() const {
    for (size_t i = 0; i < system.types.size(); i++) {
        const cylchain::LinkerType& type = system.types[i];
        require(!type.diffuses() || (type.volume == 0 && type.concentration < 0), "Linkers of type "+to_string(i)+
                " diffuse: they have neither a volume, which is that of the walls or the box, nor a concentration");
    }
}

void CylinderChainBindingForceImpl::updateWalls() {
    system.walls.clear();
    for (const ForceImpl* impl : context->getForceImpls()) {
        const CylinderChainWallForceImpl* wall = dynamic_cast<const CylinderChainWallForceImpl*>(impl);
        // Linkers are on both sides of what holds filaments on its surface.
        if (wall != NULL && wall->getWall().side != cylchain::WallSide::Surface)
            system.walls.push_back(wall->getWall());
    }
    linkerKernel.getAs<UpdateCylinderChainLinkersKernel>().setWalls(system.walls);
}

void CylinderChainBindingForceImpl::placeUnbound(cylchain::LinkerState& changed) {
    if (!system.anyDiffuses()) {
        changed.positions.clear();
        return;
    }
    updateWalls();
    for (const cylchain::LinkerType& type : system.types)
        require(!type.diffuses() ||
                cylchain::isBounded(system.wallsOf(type), owner.usesPeriodicBoundaryConditions()),
                "Linkers that diffuse need a region: add a CylinderChainWallForce that is closed (a sphere, a capsule, "
                "a torus, a box or an ellipsoid), or a cylinder with a slab across it, or have a periodic box, with "
                "nothing but slabs and cylinders in it");
    for (size_t i = 0; 3*i < changed.positions.size(); i++) {
        const cylchain::LinkerType& type = system.types[changed.linkers[i].type];
        const double* position = &changed.positions[3*i];
        require(std::isnan(position[0]) || cylchain::encloses(system.wallsOf(type), position),
                "Linker "+to_string(changed.linkers[i].number)+" is outside of the walls");
    }
    require(linkerKernel.getAs<UpdateCylinderChainLinkersKernel>().placeFree(*context, changed, seed, number),
            "There is no room for linkers that diffuse within all walls");
}

void CylinderChainBindingForceImpl::checkReaches(ContextImpl& context) const {
    if (!owner.usesPeriodicBoundaryConditions())
        return;
    Vec3 box[3];
    context.getPeriodicBoxVectors(box[0], box[1], box[2]);
    const double width = min(min(box[0][0], box[1][1]), box[2][2]);
    for (size_t i = 0; i < system.hands.size(); i++)
        require(2*system.hands[i].reach < width, "The reach of hand "+to_string(i)+
                " must be less than half of the periodic box, which is "+to_string(width)+" nm wide");
}

const CylinderChainIntegrator* CylinderChainBindingForceImpl::findIntegrator() const {
    return dynamic_cast<const CylinderChainIntegrator*>(&context->getIntegrator());
}

double CylinderChainBindingForceImpl::getTemperature() const {
    const CylinderChainIntegrator* integrator = findIntegrator();
    return integrator == NULL ? owner.getTemperature() : integrator->getTemperature();
}

map<string, double> CylinderChainBindingForceImpl::getDefaultParameters() {
    return {{parameter, digestOf(state)}};
}

vector<string> CylinderChainBindingForceImpl::getKernelNames() {
    return {UpdateCylinderChainLinkersKernel::Name(), CalcCylinderChainLinkForceKernel::Name()};
}

void CylinderChainBindingForceImpl::follow() const {
    const bool isKnown = (context->getParameter(parameter) == digestOf(state));
    if (isKnown && !isAtAnotherTime())
        return;
    string message = "CylinderChainBindingForce: Where the linkers of this Context are is not known: it has got a "
            "State or checkpoint of another time, or of another Context, that does not say it. Give it the linkers "
            "that belong to it by setLinkersInContext(), or in_context(context).set_linkers() of Filaments in "
            "Python. The checkpoints of a CylinderChainIntegrator, and States that hold its parameters "
            "(getState(integratorParameters=True)), restore linkers themselves";
    if (isKnown)
        message += ". If you have set both time and step count yourself, give it the linkers that it had before: "
                "in_context(context).set_linkers(linkers) of Filaments, with its linkers() of that time";
    throw CylinderChainException(CylinderChainException::UnknownLinks, {}, message);
}

bool CylinderChainBindingForceImpl::isAtAnotherTime() const {
    if (!hasStepped)
        return false;
    const long long count = context->getStepCount()-countBefore;
    const double time = context->getTime()-timeBefore, rounding = 1e-6*stepSize;
    return count != 0 && count != 1 && fabs(time) > rounding && fabs(time-stepSize) > rounding;
}

void CylinderChainBindingForceImpl::accept() {
    upToDate = false;
    context->setParameter(parameter, digestOf(state));
}

void CylinderChainBindingForceImpl::updateContextState(ContextImpl& context, bool& forcesInvalid) {
    follow();
    const double size = context.getIntegrator().getStepSize();
    if (!(size > 0))
        return;
    checkReaches(context);
    if (system.anyDiffuses())
        updateWalls();
    require(state.nextNumber <= LAST_NUMBER, "Two thousand million linkers have come out of their concentrations, and "
            "there are no more numbers for others. Give them new ones, from zero on: read them by "
            "getLinkersInContext(), and set them by setLinkersInContext()");
    const bool pulled = !getLinks().empty();
    const vector<cylchain::Linker> before = anyOnHelix ? state.linkers : vector<cylchain::Linker>();
    const long long failed = linkerKernel.getAs<UpdateCylinderChainLinkersKernel>().execute(context, state,
            BOLTZ*getTemperature(), size, seed, number,
            [this] (const cylchain::Hand& hand, const cylchain::HandPlace& place) {
        return describeTwist(place.chain).findTorque(place.position, hand.helix.range);
    }, links);
    findTurnedPairs(before, size);
    accept();
    hasStepped = true;
    timeBefore = context.getTime();
    countBefore = context.getStepCount();
    stepSize = size;
    upToDate = true;
    if (removeBrokenBranches())
        accept();
    require(failed >= -1, "More than ten million linkers of type "+to_string(-2-failed)+" come out of their "
            "concentration within a step: use a smaller step, or look at the concentration and the rates");
    require(failed == -1, "The hands of linker "+to_string(failed)+" bind, unbind or walk more than a hundred thousand "
            "times within a step: use a smaller step, or look at the rates");
    // An implicit step computes the forces itself.
    if (!wasExcluded && (pulled || !links.empty()))
        forcesInvalid = true;
}

void CylinderChainBindingForceImpl::checkHelices(const cylchain::ChainList& chains) {
    anyOnHelix = false;
    for (size_t i = 0; i < system.hands.size(); i++) {
        const cylchain::Hand& hand = system.hands[i];
        if (hand.helix.pitch == 0)
            continue;
        anyOnHelix = true;
        require(hand.siteSpacing == 0 && hand.slidingFriction == 0, "Hand "+to_string(i)+
                " follows a helix: it has no sites, and does not slide");
        for (int chain : hand.chains)
            require(chains.getKind(chain) == cylchain::ChainKind::StraightSegments &&
                    chains.getChain(chain).twist.isPresent(), "Hand "+to_string(i)+" follows the helix of "+
                    chains.getNameInSentence(chain)+", which has no twist");
        for (int chain : hand.chains)
            require(!chains.getChain(chain).twist.isBentAtRest(), "Hand "+to_string(i)+" follows the helix of "+
                    chains.getNameInSentence(chain)+", which has bends at rest, and cannot be turned as yet");
    }
    for (ForceImpl* impl : context->getForceImpls())
        if (anyOnHelix && dynamic_cast<CylinderChainForceImpl*>(impl) != NULL)
            chainImpl = dynamic_cast<CylinderChainForceImpl*>(impl);
}

cylchain::TwistedContour CylinderChainBindingForceImpl::describeTwist(int chain) const {
    const cylchain::ChainList& list = chainImpl->getDescription().getList();
    return {*contours, chain, list.getChain(chain), chainImpl->getTwists()[list.getIndex(chain)]};
}

void CylinderChainBindingForceImpl::findTurnedPairs(const vector<cylchain::Linker>& before, double size) {
    turnedPairs.clear();
    if (!anyOnHelix)
        return;
    // Linkers are in the order of their numbers.
    auto old = before.begin();
    for (const cylchain::Linker& linker : state.linkers) {
        while (old != before.end() && old->number < linker.number)
            old++;
        for (int side = 0; side < 2; side++) {
            const cylchain::HandPlace& place = linker.hands[side];
            if (!place.isBound())
                continue;
            const cylchain::Hand& hand = system.hands[system.types[linker.type].hands[side]];
            if (hand.helix.pitch == 0)
                continue;
            double walked = 0;
            if (old != before.end() && old->number == linker.number && old->hands[side].chain == place.chain) {
                walked = place.position-old->hands[side].position;
                if (contours->isClosed(place.chain))
                    walked -= contours->getLength(place.chain)*round(walked/contours->getLength(place.chain));
                // One that has come further has let go, and bound elsewhere.
                if (fabs(walked) > 2.001*fabs(hand.speed)*size)
                    walked = 0;
            }
            turnedPairs.push_back({place.chain, describeTwist(place.chain).describe(hand.helix, place.position, walked,
                    size)});
        }
    }
}

bool CylinderChainBindingForceImpl::addTurnedPairs(vector<vector<cylchain::TurnedPair> >& pairs) const {
    for (const auto& own : turnedPairs)
        cylchain::addTurnedPair(pairs[chainImpl->getDescription().getList().getIndex(own.first)], own.second);
    return !turnedPairs.empty();
}

const vector<cylchain::Link>& CylinderChainBindingForceImpl::getLinks() {
    follow();
    if (!upToDate) {
        linkerKernel.getAs<UpdateCylinderChainLinkersKernel>().describe(state, links);
        upToDate = true;
    }
    return links;
}

const cylchain::LinkerState& CylinderChainBindingForceImpl::getState() {
    follow();
    return state;
}

void CylinderChainBindingForceImpl::setState(const cylchain::LinkerState& replaced) {
    checkLinkers(replaced.linkers, system, contours.get());
    require(replaced.clocks.size() <= replaced.linkers.size() && all_of(replaced.clocks.begin(),
            replaced.clocks.end(), [] (double clock) {return isfinite(clock);}), "A linker has an illegal clock");
    require(replaced.events.size() <= system.types.size(), "There are events of a type of linkers that does not exist");
    cylchain::LinkerState changed = replaced;
    placeUnbound(changed);
    state = move(changed);
    hasStepped = false;
    accept();
}

void CylinderChainBindingForceImpl::chainsHaveGrown(ContextImpl& context, const cylchain::ChainList& chains,
        const cylchain::GrowthChanges& changes) {
    contours.reset(new cylchain::Contours(chains));
    upToDate = false;
    bool any = linkerKernel.getAs<UpdateCylinderChainLinkersKernel>().setChains(context, chains,
            changes.cuts, state, seed, number);
    any |= addBranches(changes);
    any |= removeBrokenBranches();
    if (any)
        accept();
}

void CylinderChainBindingForceImpl::findChangesOfEnds(vector<cylchain::HeldEnd>& ends) const {
    for (const cylchain::Hand& hand : system.hands)
        for (int chain : hand.atEnd.changes)
            ends.push_back({chain, hand.atEnd.end, hand.atEnd.freeState, hand.atEnd.heldState});
}

/** Call a function of the kind and the place of each hand that is bound. */
template <class Function> void CylinderChainBindingForceImpl::forBoundHands(Function function) {
    for (const cylchain::Linker& linker : getState().linkers)
        for (int side = 0; side < 2; side++)
            if (linker.hands[side].isBound())
                function(system.hands[system.types[linker.type].hands[side]], linker.hands[side]);
}

void CylinderChainBindingForceImpl::findHeldEnds(vector<cylchain::HeldEnd>& ends) {
    forBoundHands([&] (const cylchain::Hand& hand, const cylchain::HandPlace& place) {
        const cylchain::HandAtEnd& own = hand.atEnd;
        if (own.heldState >= 0 && binary_search(own.changes.begin(), own.changes.end(), place.chain) &&
                contours->isNearEnd(place.chain, place.position, own.end, own.range))
            ends.push_back({place.chain, own.end, own.freeState, own.heldState});
    });
}

void CylinderChainBindingForceImpl::findActingHands(vector<cylchain::ActingHand>& hands) {
    const bool anyActs = any_of(system.hands.begin(), system.hands.end(), [] (const cylchain::Hand& hand) {
        return hand.severingRate > 0 || hand.atEnd.offRate > 0;
    });
    if (!anyActs)
        return;
    map<tuple<const cylchain::Hand*, int, int>, int> taken;
    forBoundHands([&] (const cylchain::Hand& hand, const cylchain::HandPlace& place) {
        if (hand.severingRate > 0)
            hands.push_back({place.chain, place.position, hand.severingRate, -1});
        if (hand.atEnd.offRate > 0)
            for (int end : {0, 1})
                if (hand.atEnd.isAt(end) && contours->isNearEnd(place.chain, place.position, end, hand.atEnd.range) &&
                        taken[make_tuple(&hand, place.chain, end)]++ < hand.atEnd.sites)
                    hands.push_back({place.chain, place.position, hand.atEnd.offRate, end});
    });
}

/** Hold chains that have begun as branches, where both are still there at the end of the step. */
bool CylinderChainBindingForceImpl::addBranches(const cylchain::GrowthChanges& changes) {
    bool any = false;
    for (const cylchain::ChainBranch& branch : changes.branches)
        for (int i = 0; i < owner.getNumBranchJoints(); i++) {
            const cylchain::BranchJoint& joint = owner.getBranchJoint(i);
            if (joint.nucleator != branch.nucleator)
                continue;
            vector<cylchain::Linker> linkers(joint.types.size());
            bool areThere = true;
            for (size_t k = 0; k < linkers.size(); k++) {
                linkers[k].type = joint.types[k];
                linkers[k].hands[0] = {branch.mother, branch.along+joint.onMother[k]};
                linkers[k].hands[1] = {branch.chain, joint.onBranch[k]};
                for (cylchain::HandPlace& hand : linkers[k].hands) {
                    for (size_t cut = branch.cutsBefore; cut < changes.cuts.size(); cut++)
                        followCut(changes.cuts[cut], hand);
                    areThere = areThere && contours->isWithin(hand.chain, hand.position);
                }
            }
            if (!areThere)
                continue;
            for (cylchain::Linker& linker : linkers) {
                linker.number = state.nextNumber++;
                state.linkers.push_back(linker);
                state.events.resize(system.types.size());
                state.events[linker.type].bindings += 2;
                any = true;
            }
        }
    if (any)
        state.knownTo = cylchain::KnownTo();
    return any;
}

/** Of a branch that one of its linkers does not hold any more, let all go. They have numbers that follow each other. */
bool CylinderChainBindingForceImpl::removeBrokenBranches() {
    bool any = false;
    for (int i = 0; i < owner.getNumBranchJoints(); i++) {
        const cylchain::BranchJoint& joint = owner.getBranchJoint(i);
        const size_t count = joint.types.size();
        vector<cylchain::Linker>& linkers = state.linkers;
        for (size_t broken = 0; broken < linkers.size(); broken++) {
            // Types of a joint are of nothing else.
            const size_t position = find(joint.types.begin(), joint.types.end(), linkers[broken].type)-
                    joint.types.begin();
            if (position == count || linkers[broken].pulls())
                continue;
            const uint32_t first = linkers[broken].number-position;
            for (size_t k = broken >= count ? broken-count : 0; k < min(linkers.size(), broken+count); k++)
                for (cylchain::HandPlace& hand : linkers[k].hands)
                    if (linkers[k].number >= first && linkers[k].number < first+count && hand.isBound()) {
                        hand = cylchain::HandPlace();
                        state.events[linkers[k].type].unbindings++;
                        any = true;
                    }
        }
    }
    if (any)
        state.knownTo = cylchain::KnownTo();
    return any;
}

unique_ptr<cylchain::Surroundings> CylinderChainBindingForceImpl::describeSurroundings(
        const cylchain::ChainList& chains, const vector<int>& growing) {
    for (size_t i = 0; i < system.anchors.size(); i++)
        for (int number : growing) {
            const cylchain::Chain& chain = chains.getChain(number);
            for (const vector<int>* particles : {&chain.nodes, &chain.spareNodes})
                require(find(particles->begin(), particles->end(), system.anchors[i].first) == particles->end(),
                        "Anchor "+to_string(i)+" is a particle of "+chains.getNameInSentence(number)+
                        ", which grows: anchor linkers at points or at other particles");
        }
    return make_unique<cylchain::EndLinks>([this] (vector<cylchain::GrowingLink>& links) {
        for (const cylchain::Linker& linker : state.linkers) {
            if (!linker.pulls())
                continue;
            const cylchain::LinkerType& type = system.types[linker.type];
            cylchain::GrowingLink link = {{}, type.stiffness, type.restLength};
            for (int side = 0; side < 2; side++) {
                const cylchain::HandPlace& hand = linker.hands[side];
                if (hand.isBound())
                    link.ends[side] = {hand.chain, hand.position, contours->findPlace(hand.chain, hand.position)};
                else
                    link.ends[side].place = system.anchors[linker.anchor];
            }
            links.push_back(link);
        }
    }, owner.usesPeriodicBoundaryConditions(), nearestParticles);
}

double CylinderChainBindingForceImpl::calcForcesAndEnergy(ContextImpl&, bool includeForces,
        bool includeEnergy, int groups) {
    if (!isIn(groups))
        return 0.0;
    wasExcluded = isExcluded();
    if (isExcluded())
        return 0.0;
    int outOfRange = -1;
    return computeLinks(includeForces, includeEnergy, outOfRange);
}

StateColumns CylinderChainBindingForceImpl::storeState(bool inCheckpoint) {
    StateColumns columns = storeLinkers(getState());
    if (inCheckpoint)
        columns.put("seed", seed);
    return columns;
}

void CylinderChainBindingForceImpl::restoreState(const StateColumns& columns) {
    setState(restoreLinkers(columns));
    if (columns.has("seed"))
        seed = columns.getOne<uint32_t>("seed");
}
