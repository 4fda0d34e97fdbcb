#include "openmm/CylinderChainBindingForce.h"
#include "openmm/CylinderChainWallForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/AssertionUtilities.h"
#include "openmm/internal/CylinderChainBindingForceImpl.h"
#include "openmm/internal/LinkerDescription.h"
#include <algorithm>
#include <climits>
#include <cmath>
#include <string>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

static void requireOfBinding(bool condition, const string& message) {
    if (!condition)
        throw OpenMMException("CylinderChainBindingForce: "+message);
}

static void requireNotNegative(double value, const char* name) {
    requireOfBinding(value >= 0 && isfinite(value), string("The ")+name+" cannot be negative and must be finite");
}

CylinderChainBindingForce::CylinderChainBindingForce(double temperature) : randomNumberSeed(0), periodic(false) {
    setName("CylinderChainBindingForce");
    setTemperature(temperature);
}

void CylinderChainBindingForce::setTemperature(double temperature) {
    requireNotNegative(temperature, "temperature");
    this->temperature = temperature;
}

int CylinderChainBindingForce::addHand(double bindingRate, double reach, double unbindingRate,
        const vector<int>& chains) {
    requireNotNegative(bindingRate, "rate of binding");
    requireNotNegative(unbindingRate, "rate of unbinding");
    requireOfBinding(reach > 0 && isfinite(reach), "The reach must be positive and finite");
    Hand hand;
    hand.bindingRate = bindingRate;
    hand.reach = reach;
    hand.unbindingRate = unbindingRate;
    hand.chains = chains;
    sort(hand.chains.begin(), hand.chains.end());
    for (size_t i = 0; i < chains.size(); i++) {
        requireOfBinding(hand.chains[i] >= 0, "Illegal chain index: "+to_string(hand.chains[i]));
        requireOfBinding(i == 0 || hand.chains[i] > hand.chains[i-1],
                "Chain "+to_string(hand.chains[i])+" is named twice");
    }
    hands.push_back(hand);
    return hands.size()-1;
}

const Hand& CylinderChainBindingForce::getHand(int hand) const {
    ASSERT_VALID_INDEX(hand, hands);
    return hands[hand];
}

Hand& CylinderChainBindingForce::handOf(int hand) {
    ASSERT_VALID_INDEX(hand, hands);
    return hands[hand];
}

void CylinderChainBindingForce::getHandParameters(int hand, double& bindingRate, double& reach,
        double& unbindingRate) const {
    const Hand& own = getHand(hand);
    bindingRate = own.bindingRate;
    reach = own.reach;
    unbindingRate = own.unbindingRate;
}

const vector<int>& CylinderChainBindingForce::getHandChains(int hand) const {
    return getHand(hand).chains;
}

void CylinderChainBindingForce::getHandUnbinding(int hand, double& strainShare, double& unbindingForce,
        double& catchRate, double& catchForce) const {
    const Hand& own = getHand(hand);
    strainShare = own.strainShare;
    unbindingForce = own.unbindingForce;
    catchRate = own.catchRate;
    catchForce = own.catchForce;
}

void CylinderChainBindingForce::setHandUnbinding(int hand, double strainShare, double unbindingForce,
        double catchRate, double catchForce) {
    Hand& own = handOf(hand);
    requireOfBinding(strainShare >= 0 && strainShare <= 1, "The share of strain in unbinding must be between 0 and 1");
    requireNotNegative(unbindingForce, "force of unbinding");
    requireNotNegative(catchRate, "rate of the second pathway of unbinding");
    requireNotNegative(catchForce, "force of the second pathway of unbinding");
    requireOfBinding(strainShare == 0 || unbindingForce == 0,
            "Unbinding depends on the energy of the spring or on its force: give one of them");
    own.strainShare = strainShare;
    own.unbindingForce = unbindingForce;
    own.catchRate = catchRate;
    own.catchForce = catchForce;
}

void CylinderChainBindingForce::getHandWalking(int hand, double& speed, double& stallForce, bool& walksBackward,
        bool& holdsAtEnds) const {
    const Hand& own = getHand(hand);
    speed = own.speed;
    stallForce = own.stallForce;
    walksBackward = own.walksBackward;
    holdsAtEnds = own.holdsAtEnds;
}

void CylinderChainBindingForce::setHandWalking(int hand, double speed, double stallForce, bool walksBackward,
        bool holdsAtEnds) {
    Hand& own = handOf(hand);
    requireOfBinding(isfinite(speed), "The speed must be finite");
    requireNotNegative(stallForce, "stall force");
    own.speed = speed;
    own.stallForce = stallForce;
    own.walksBackward = walksBackward;
    own.holdsAtEnds = holdsAtEnds;
}

double CylinderChainBindingForce::getHandSiteSpacing(int hand) const {
    return getHand(hand).siteSpacing;
}

void CylinderChainBindingForce::setHandSiteSpacing(int hand, double spacing) {
    requireNotNegative(spacing, "distance of sites");
    handOf(hand).siteSpacing = spacing;
}

void CylinderChainBindingForce::setHandBindingRange(int hand, int end, double range, bool excluded) {
    requireOfBinding(end >= -1 && end <= 2, "Illegal end: "+to_string(end));
    requireNotNegative(range, "range of binding");
    handOf(hand).bindingRange = {end, range, excluded};
}

void CylinderChainBindingForce::getHandBindingRange(int hand, int& end, double& range, bool& excluded) const {
    const BindingRange& own = getHand(hand).bindingRange;
    end = own.end;
    range = own.range;
    excluded = own.excluded;
}

double CylinderChainBindingForce::getHandSliding(int hand) const {
    return getHand(hand).slidingFriction;
}

void CylinderChainBindingForce::setHandSliding(int hand, double friction) {
    requireNotNegative(friction, "friction");
    handOf(hand).slidingFriction = friction;
}

int CylinderChainBindingForce::addLinkerType(int hand1, int hand2, double restLength, double stiffness,
        bool sameChain) {
    requireOfBinding(hand1 >= -1 && hand1 < getNumHands(), "Illegal hand: "+to_string(hand1));
    requireOfBinding(hand2 >= 0 && hand2 < getNumHands(), "Illegal hand: "+to_string(hand2));
    requireNotNegative(restLength, "rest length");
    requireNotNegative(stiffness, "stiffness");
    LinkerType type;
    type.hands[0] = hand1;
    type.hands[1] = hand2;
    type.restLength = restLength;
    type.stiffness = stiffness;
    type.sameChain = sameChain;
    types.push_back(type);
    return types.size()-1;
}

const LinkerType& CylinderChainBindingForce::getLinkerType(int type) const {
    ASSERT_VALID_INDEX(type, types);
    return types[type];
}

void CylinderChainBindingForce::getLinkerTypeParameters(int type, int& hand1, int& hand2, double& restLength,
        double& stiffness, bool& sameChain) const {
    const LinkerType& own = getLinkerType(type);
    hand1 = own.hands[0];
    hand2 = own.hands[1];
    restLength = own.restLength;
    stiffness = own.stiffness;
    sameChain = own.sameChain;
}

void CylinderChainBindingForce::getLinkerTypeReservoir(int type, double& volume, double& concentration) const {
    volume = getLinkerType(type).volume;
    concentration = getLinkerType(type).concentration;
}

void CylinderChainBindingForce::setLinkerTypeReservoir(int type, double volume, double concentration) {
    ASSERT_VALID_INDEX(type, types);
    requireNotNegative(volume, "volume");
    requireOfBinding(concentration == -1 || (concentration >= 0 && isfinite(concentration)),
            "The concentration cannot be negative and must be finite");
    requireOfBinding(concentration == -1 || types[type].hands[0] >= 0, "Anchored linkers have no concentration");
    types[type].volume = volume;
    types[type].concentration = concentration;
}

void CylinderChainBindingForce::getLinkerTypeRules(int type, double& leastCosine, double& largestCosine,
        bool& transActivated, bool& reversible) const {
    const LinkerType& own = getLinkerType(type);
    leastCosine = own.leastCosine;
    largestCosine = own.largestCosine;
    transActivated = own.transActivated;
    reversible = own.reversible;
}

void CylinderChainBindingForce::setLinkerTypeRules(int type, double leastCosine, double largestCosine,
        bool transActivated, bool reversible) {
    ASSERT_VALID_INDEX(type, types);
    requireOfBinding(-1 <= leastCosine && leastCosine <= largestCosine && largestCosine <= 1,
            "Cosines must ascend, between -1 and 1");
    LinkerType& own = types[type];
    own.leastCosine = leastCosine;
    own.largestCosine = largestCosine;
    own.transActivated = transActivated;
    own.reversible = reversible;
}

void CylinderChainBindingForce::setLinkerTypeLoading(int type, double distance) {
    ASSERT_VALID_INDEX(type, types);
    requireNotNegative(distance, "distance at which pairs of hands bind");
    requireOfBinding(distance == 0 || types[type].hands[0] >= 0, "Anchored linkers have no pair of hands");
    requireOfBinding(distance == 0 || distance >= getHand(types[type].hands[1]).siteSpacing,
            "The distance at which pairs of hands bind must be that of their sites at least");
    types[type].loadingDistance = distance;
}

int CylinderChainBindingForce::addBarrier(int chain, double position, int direction, double captureProbability,
        double releaseRate) {
    requireOfBinding(chain >= 0, "Illegal chain index: "+to_string(chain));
    requireNotNegative(position, "place of a barrier");
    requireOfBinding(direction >= -1 && direction <= 1, "Illegal direction: "+to_string(direction));
    requireOfBinding(captureProbability >= 0 && captureProbability <= 1, "A probability must be between 0 and 1");
    requireNotNegative(releaseRate, "rate at which a barrier lets go");
    barriers.push_back({chain, position, direction, captureProbability, releaseRate});
    return barriers.size()-1;
}

void CylinderChainBindingForce::getBarrierParameters(int index, int& chain, double& position, int& direction,
        double& captureProbability, double& releaseRate) const {
    ASSERT_VALID_INDEX(index, barriers);
    const Barrier& own = barriers[index];
    chain = own.chain;
    position = own.position;
    direction = own.direction;
    captureProbability = own.captureProbability;
    releaseRate = own.releaseRate;
}

void CylinderChainBindingForce::getLinkerTypeDiffusion(int type, double& diffusion, bool& planar) const {
    diffusion = getLinkerType(type).diffusion;
    planar = getLinkerType(type).planar;
}

void CylinderChainBindingForce::setLinkerTypeDiffusion(int type, double diffusion, bool planar) {
    ASSERT_VALID_INDEX(type, types);
    requireOfBinding(diffusion == -1 || (diffusion >= 0 && isfinite(diffusion)),
            "A diffusion coefficient cannot be negative and must be finite");
    requireOfBinding(diffusion == -1 || types[type].hands[0] >= 0, "Anchored linkers do not diffuse");
    types[type].diffusion = diffusion;
    types[type].planar = planar;
}

void CylinderChainBindingForce::addLinkerTypeWall(int type, const string& shape, const Vec3& point, const Vec3& vector,
        double length) {
    ASSERT_VALID_INDEX(type, types);
    types[type].walls.push_back(CylinderChainWallForce(shape, point, vector, length, 0).getWalls().wall);
}

string CylinderChainBindingForce::getLinkerTypeWall(int type, int wall, Vec3& point, Vec3& vector,
        double& length) const {
    const std::vector<Wall>& walls = getLinkerType(type).walls;
    ASSERT_VALID_INDEX(wall, walls);
    const Wall& own = walls[wall];
    point = Vec3(own.point[0], own.point[1], own.point[2]);
    vector = Vec3(own.vector[0], own.vector[1], own.vector[2]);
    length = own.length;
    return Names<WallShape>::ALL[static_cast<int>(own.shape)];
}

int CylinderChainBindingForce::addParticleAnchor(int particle) {
    requireOfBinding(particle >= 0, "Illegal particle index: "+to_string(particle));
    Place place;
    place.first = particle;
    anchors.push_back(place);
    return anchors.size()-1;
}

int CylinderChainBindingForce::addPointAnchor(const Vec3& point) {
    Place place;
    for (int k = 0; k < 3; k++) {
        requireOfBinding(isfinite(point[k]), "The point of an anchor must be finite");
        place.point[k] = point[k];
    }
    anchors.push_back(place);
    return anchors.size()-1;
}

void CylinderChainBindingForce::getAnchor(int anchor, int& particle, Vec3& point) const {
    ASSERT_VALID_INDEX(anchor, anchors);
    particle = anchors[anchor].first;
    point = Vec3(anchors[anchor].point[0], anchors[anchor].point[1], anchors[anchor].point[2]);
}

void CylinderChainBindingForce::addLinkers(int type, int count) {
    const LinkerType& own = getLinkerType(type);
    requireOfBinding(count >= 0 && count <= INT_MAX-(int) state.nextNumber,
            "Illegal number of linkers: "+to_string(count));
    requireOfBinding(own.hands[0] >= 0, "Linkers of type "+to_string(type)+" are anchored: use addAnchoredLinker()");
    requireOfBinding(own.concentration < 0,
            "Linkers of type "+to_string(type)+" have a concentration instead of a number");
    for (int i = 0; i < count; i++) {
        Linker linker;
        linker.number = state.nextNumber++;
        linker.type = type;
        state.linkers.push_back(linker);
    }
}

void CylinderChainBindingForce::addAnchoredLinker(int type, int anchor) {
    requireOfBinding(getLinkerType(type).hands[0] == -1,
            "Linkers of type "+to_string(type)+" have two hands and no anchor");
    ASSERT_VALID_INDEX(anchor, anchors);
    Linker linker;
    linker.number = state.nextNumber++;
    linker.type = type;
    linker.anchor = anchor;
    state.linkers.push_back(linker);
}

static void giveColumns(const LinkerState& state, vector<int>& numbers, vector<int>& types, vector<int>& anchors,
        vector<int>& chains, vector<double>& places, int& nextNumber) {
    const LinkerColumns columns(state);
    numbers = columns.numbers;
    types = columns.types;
    anchors = columns.anchors;
    chains = columns.chains;
    places = columns.places;
    nextNumber = columns.nextNumber;
}

void CylinderChainBindingForce::getLinkers(vector<int>& numbers, vector<int>& types, vector<int>& anchors,
        vector<int>& chains, vector<double>& places, int& nextNumber) const {
    giveColumns(state, numbers, types, anchors, chains, places, nextNumber);
}

static LinkerColumns columnsOf(const vector<int>& numbers, const vector<int>& types, const vector<int>& anchors,
        const vector<int>& chains, const vector<double>& places, int nextNumber) {
    LinkerColumns columns;
    columns.numbers = numbers;
    columns.types = types;
    columns.anchors = anchors;
    columns.chains = chains;
    columns.places = places;
    columns.nextNumber = nextNumber;
    return columns;
}

void CylinderChainBindingForce::setLinkers(const vector<int>& numbers, const vector<int>& types,
        const vector<int>& anchors, const vector<int>& chains, const vector<double>& places, int nextNumber) {
    const vector<Linker> linkers = columnsOf(numbers, types, anchors, chains, places, nextNumber).getLinkers();
    checkLinkers(linkers, {hands, this->types, this->anchors, 0.0});
    state.linkers = linkers;
    state.clocks.clear();
    state.positions.clear();
    state.nextNumber = nextNumber;
}

void CylinderChainBindingForce::setHandAtEnd(int hand, int end, double range, bool bindsThere, bool tracks,
        int freeState, int heldState, const vector<int>& numbers) {
    const bool changes = freeState >= 0 && heldState >= 0;
    if (end < -1 || end > 2 || (end == 2 && changes) || !(range >= 0 && range < HUGE_VAL) ||
            (end == -1 && (bindsThere || tracks || changes)) ||
            (freeState >= 0) != (heldState >= 0) || (changes && freeState == heldState) ||
            changes == numbers.empty() || any_of(numbers.begin(), numbers.end(), [] (int chain) {return chain < 0;}))
        throw OpenMMException("CylinderChainBindingForce: A kind of hands needs an end, a range that is not negative, "
                "and two different states of ends of some chains or none");
    cylchain::HandAtEnd& own = handOf(hand).atEnd;
    own.end = end;
    own.range = range;
    own.bindsThere = bindsThere;
    own.tracks = tracks;
    own.freeState = freeState;
    own.heldState = heldState;
    own.changes = numbers;
    sort(own.changes.begin(), own.changes.end());
}

void CylinderChainBindingForce::getHandAtEnd(int hand, int& end, double& range, bool& bindsThere, bool& tracks,
        int& freeState, int& heldState, vector<int>& numbers) const {
    const cylchain::HandAtEnd& own = getHand(hand).atEnd;
    end = own.end;
    range = own.range;
    bindsThere = own.bindsThere;
    tracks = own.tracks;
    freeState = own.freeState;
    heldState = own.heldState;
    numbers = own.changes;
}

void CylinderChainBindingForce::setHandRemoval(int hand, double offRate, int sites, double unbindingRate) {
    cylchain::HandAtEnd& own = handOf(hand).atEnd;
    if (!(offRate >= 0 && offRate < HUGE_VAL) || sites < 1 ||
            !(unbindingRate == -1 || (unbindingRate >= 0 && unbindingRate < HUGE_VAL)) ||
            (own.end < 0 && (offRate > 0 || unbindingRate >= 0)))
        throw OpenMMException("CylinderChainBindingForce: A kind of hands that takes monomers off ends needs an end, "
                "rates that are not negative and finite, and sites at an end");
    own.offRate = offRate;
    own.sites = sites;
    own.unbindingRate = unbindingRate;
}

void CylinderChainBindingForce::getHandRemoval(int hand, double& offRate, int& sites, double& unbindingRate) const {
    const cylchain::HandAtEnd& own = getHand(hand).atEnd;
    offRate = own.offRate;
    sites = own.sites;
    unbindingRate = own.unbindingRate;
}

void CylinderChainBindingForce::getHandOnHelix(int hand, double& pitch, double& friction, double& stallTorque,
        double& range) const {
    const cylchain::HandOnHelix& own = getHand(hand).helix;
    pitch = own.pitch;
    friction = own.friction;
    stallTorque = own.stallTorque;
    range = own.range;
}

void CylinderChainBindingForce::setHandOnHelix(int hand, double pitch, double friction, double stallTorque,
        double range) {
    requireOfBinding(isfinite(pitch), "The pitch of a helix must be finite");
    requireNotNegative(friction, "friction against turning");
    requireNotNegative(stallTorque, "stall torque");
    requireNotNegative(range, "range of a torque");
    requireOfBinding(pitch != 0 || stallTorque == 0, "A torque stops hands that follow a helix alone");
    handOf(hand).helix = {pitch, friction, stallTorque, range};
}

double CylinderChainBindingForce::getHandSevering(int hand) const {
    return getHand(hand).severingRate;
}

void CylinderChainBindingForce::setHandSevering(int hand, double rate) {
    if (!(rate >= 0 && rate < HUGE_VAL))
        throw OpenMMException("CylinderChainBindingForce: A rate of severing cannot be negative and must be finite");
    handOf(hand).severingRate = rate;
}

int CylinderChainBindingForce::addBranchJoint(int nucleator, const vector<int>& types,
        const vector<double>& parameters, const vector<double>& places) {
    if (nucleator < 0 || types.empty() || parameters.size() != types.size() || places.size() != types.size())
        throw OpenMMException("CylinderChainBindingForce: The joint of branches needs a nucleator, and two places for "
                "each of one type or more");
    branchJoints.push_back({nucleator, types, parameters, places});
    return branchJoints.size()-1;
}

void CylinderChainBindingForce::getBranchJointParameters(int index, int& nucleator, vector<int>& types,
        vector<double>& parameters, vector<double>& places) const {
    ASSERT_VALID_INDEX(index, branchJoints);
    const cylchain::BranchJoint& own = branchJoints[index];
    nucleator = own.nucleator;
    types = own.types;
    parameters = own.onMother;
    places = own.onBranch;
}

void CylinderChainBindingForce::getLinkersInContext(Context& context, vector<int>& numbers, vector<int>& types,
        vector<int>& anchors, vector<int>& chains, vector<double>& places, int& nextNumber) const {
    CylinderChainBindingForceImpl& impl = dynamic_cast<CylinderChainBindingForceImpl&>(getImplInContext(context));
    giveColumns(impl.getState(), numbers, types, anchors, chains, places, nextNumber);
}

void CylinderChainBindingForce::setLinkersInContext(Context& context, const vector<int>& numbers,
        const vector<int>& types, const vector<int>& anchors, const vector<int>& chains, const vector<double>& places,
        int nextNumber) const {
    CylinderChainBindingForceImpl& impl = dynamic_cast<CylinderChainBindingForceImpl&>(getImplInContext(context));
    LinkerState replaced = impl.getKnownState();
    replaced.linkers = columnsOf(numbers, types, anchors, chains, places, nextNumber).getLinkers();
    replaced.clocks.clear();
    replaced.positions.clear();
    replaced.nextNumber = nextNumber;
    impl.setState(replaced);
}

static void giveUnbound(const LinkerState& state, vector<int>& numbers, vector<double>& places) {
    const FreeColumns columns(state);
    numbers = columns.numbers;
    places = columns.places;
}

static FreeColumns unboundOf(const vector<int>& numbers, const vector<double>& places) {
    FreeColumns columns;
    columns.numbers = numbers;
    columns.places = places;
    return columns;
}

void CylinderChainBindingForce::getUnboundPositions(vector<int>& numbers, vector<double>& places) const {
    giveUnbound(state, numbers, places);
}

void CylinderChainBindingForce::setUnboundPositions(const vector<int>& numbers, const vector<double>& places) {
    LinkerState changed = state;
    changed.positions.clear();
    unboundOf(numbers, places).give(changed);
    state.positions = changed.positions;
}

void CylinderChainBindingForce::getUnboundPositionsInContext(Context& context, vector<int>& numbers,
        vector<double>& places) const {
    giveUnbound(dynamic_cast<CylinderChainBindingForceImpl&>(getImplInContext(context)).getState(), numbers, places);
}

void CylinderChainBindingForce::setUnboundPositionsInContext(Context& context, const vector<int>& numbers,
        const vector<double>& places) const {
    CylinderChainBindingForceImpl& impl = dynamic_cast<CylinderChainBindingForceImpl&>(getImplInContext(context));
    LinkerState changed = impl.getState();
    unboundOf(numbers, places).give(changed);
    impl.setState(changed);
}

void CylinderChainBindingForce::getNumEventsInContext(Context& context, int type, long long& bindings,
        long long& unbindings) const {
    ASSERT_VALID_INDEX(type, types);
    CylinderChainBindingForceImpl& impl = dynamic_cast<CylinderChainBindingForceImpl&>(getImplInContext(context));
    const vector<LinkerEvents>& events = impl.getState().events;
    bindings = type < (int) events.size() ? events[type].bindings : 0;
    unbindings = type < (int) events.size() ? events[type].unbindings : 0;
}

vector<cylchain::Place> CylinderChainBindingForce::findPlaces(const PlaceResolver&) const {
    // Hands are on chains.
    return anchors;
}

ForceImpl* CylinderChainBindingForce::createImpl() const {
    return new CylinderChainBindingForceImpl(*this);
}
