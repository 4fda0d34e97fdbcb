#include "networks/ReflectedGaps.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>
#include <numeric>

using namespace cylchain;
using namespace std;

namespace {

/** How far a gap moves in a part, (2 k_B T G)^(1/2), over the thermal depth, where it shares chains with others. */
const double LARGEST_MOTION = 2.2;
/** The most parts. */
const int MOST_PARTS_OF_GAPS = 32;
/** How often all gaps are gone through at most. */
const int MOST_SWEEPS = 2000;
/** How often those that are pushed are gone through before all are again. */
const int SWEEPS_OF_PUSHED = 50;
/**
 * The share of what others push a gap open by that counts at the start of a part; and that of what they push it shut
 * by, over the square of their correlation, which counts there the other way round. Both are fitted to equilibria.
 */
const double SHARE_OF_OPENING = 1.0/3, SHARE_OF_CLOSING = 0.4;
/** What sweeps may leave to change of a gap, and the last iteration may change, over the thermal scale. */
const double OF_SWEEPS = 0.01, OF_ITERATIONS = 0.03;
/** Gaps that end farther than this from where the equations have led them have turned: others keep their responses. */
const double OF_RESPONSES = 0.1;
/** A change that is less than this share of that is not made. */
const double LEAST_SHARE = 0.01;
/** What responses lack may go back and forth between gaps that links move together: it changes by this share then. */
const double DAMPING_OF_GAPS = 0.5;
/** A ceiling pulls a gap back by less than this, over the way that it would go beyond and its thermal motion. */
const double LARGEST_PULL = 10;
/** Sweeps are taken to change by this factor at most from one to the next. */
const double LARGEST_RATE = 0.995;
/** What sweeps and iterations may leave to change of a gap where nothing moves thermally, in nm. */
const double LEAST_CHANGE_OF_GAPS = 1e-7;
/** A gap that has just been found is pushed if its exponential variate is less than this. */
const double LARGE_REFLECTION = 4;
/** Normal numbers are not so large that their chance would be less. */
const double LEAST_CHANCE = 1e-300;
/** Gaps that a thread looks at together. */
const int CHUNK_OF_GAPS = 64;

/**
 * The force that reflects the motion of a gap, with an exponential variate of the mean k_B T: with its response G to a
 * force, and the part L of it that the end does not have yet, so that the gap ends at end+L F.
 */
double reflect(double start, double end, double all, double part, double variate) {
    if (start+end > 0 && start*end >= all*variate)
        return 0;
    const double before = start*part, after = end*all, way = before-after;
    return max(0.0, 0.5*(sqrt(way*way+4*all*all*part*variate)-(before+after))/(all*part));
}

} // namespace

void ReflectedGaps::begin(const StepSettings& settings, const ChainPlaces& places) {
    responses.begin(places.getNumChains());
    all.begin();
    kT = settings.kT;
    precision = settings.precision;
    noise = GapNoise({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step});
    gaps.clear();
    forces.clear();
    pushes.clear();
    bridges.clear();
    ofBridges.clear();
    ofReflections.clear();
    parts = 1;
    changes.clear();
    predicted.clear();
    corrections.clear();
    applied.clear();
    lacking.clear();
    turned.clear();
}

void ReflectedGaps::turn(int number, const Gap& gap) {
    gaps[number] = gap;
    if (number < (int) turned.size())
        turned[number] = 1;
}

int ReflectedGaps::add(const Gap& gap) {
    gaps.push_back(gap);
    return gaps.size()-1;
}

void ReflectedGaps::addEquations(vector<CouplingEquation>& equations, const Loop& loop) {
    if (!gaps.empty())
        responses.setLinks(equations);
    firstEquations.resize(gaps.size()+1);
    size_t next = equations.size();
    for (size_t i = 0; i < gaps.size(); i++) {
        firstEquations[i] = next;
        next += gaps[i].numLevers;
    }
    firstEquations[gaps.size()] = next;
    equations.resize(next);
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int i) {
        for (int lever = 0; lever < gaps[i].numLevers; lever++) {
            CouplingEquation& equation = equations[firstEquations[i]+lever];
            copy_n(gaps[i].levers[lever].places, 2, equation.places);
            fill_n(equation.force, 3, 0.0);
            const double force = gaps[i].present ? max(0.0, getForce(i)) : 0;
            for (int k = 0; k < 6; k++)
                equation.stiffness[k] = force*gaps[i].turning[k];
        }
    });
}

int ReflectedGaps::chooseParts() const {
    if (kT == 0)
        return 1;
    double largest = 0;
    for (size_t i = 0; i < gaps.size(); i++) {
        bool shares = false;
        responses.forPorts(i, [&] (const GapResponses::ChainPorts& chain, int) {
            shares |= chain.count() > 1;
        });
        if (shares && gaps[i].present && gaps[i].law == GapLaw::Reflection)
            largest = max(largest, gaps[i].stiffness*responses.getOwn(i));
    }
    return clamp((int) ceil(2*largest/(LARGEST_MOTION*LARGEST_MOTION)), 1, MOST_PARTS_OF_GAPS);
}

/** Draw the numbers of gaps that have none for so many parts. */
void ReflectedGaps::drawNumbers(const Loop& loop) {
    const size_t known = ofBridges.size()/(2*parts), count = gaps.size();
    ofBridges.resize(2*count*parts);
    ofReflections.resize(2*count*parts);
    loop((count-known+CHUNK_OF_GAPS-1)/CHUNK_OF_GAPS, [&] (int chunk) {
        const size_t i = known+chunk*CHUNK_OF_GAPS;
        noise.draw(&gaps[i], min(count-i, (size_t) CHUNK_OF_GAPS), parts, &ofBridges[2*i*parts],
                &ofReflections[2*i*parts]);
    });
}

/** Give numbers of ports the covariance of the responses, and sum them for each gap that has new ones. */
void ReflectedGaps::correlate(const vector<double>& normals, vector<double>& sums, const Loop& loop) const {
    sums.resize(gaps.size()*parts);
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int gap) {
        if (!responses.areNew(gap))
            return;
        double* const sum = &sums[(size_t) gap*parts];
        fill_n(sum, parts, 0.0);
        responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int row) {
            const double* const root = chain.rootOf(row);
            for (int column = 0; column <= row; column++) {
                const GapResponses::Port& port = chain.ports[column];
                const double* const own = &normals[(2*(size_t) port.gap+port.side)*parts];
                for (int part = 0; part < parts; part++)
                    sum[part] += root[column]*own[part];
            }
        });
    });
}

/**
 * Find bridges of Brownian motion, and exponential variates, that are correlated as the gaps move: those that move as
 * one are reflected as one.
 */
void ReflectedGaps::findNoise(const Loop& loop) {
    correlate(ofBridges, bridges, loop);
    correlate(ofReflections, reflections, loop);
    const double size = sqrt(2*kT/parts);
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int i) {
        if (!responses.areNew(i))
            return;
        double *const bridge = &bridges[(size_t) i*parts], *const reflection = &reflections[(size_t) i*parts];
        const double mean = accumulate(bridge, bridge+parts, 0.0)/parts;
        const double ofChains = responses.getOfChains(i);
        const double ofGap = ofChains > 0 ? size*sqrt(responses.getOwn(i)/ofChains) : 0;
        const double perSize = ofChains > 0 ? M_SQRT1_2/sqrt(ofChains) : 0;
        for (int part = 0; part < parts; part++) {
            bridge[part] = (bridge[part]-mean)*ofGap;
            reflection[part] = -log(max(LEAST_CHANCE, 0.5*erfc(reflection[part]*perSize)));
        }
    });
}

/** How far a gap moves without being noticed: thermally behind its surface, or in the step. */
double ReflectedGaps::scaleOf(int i) const {
    return min(sqrt(kT/gaps[i].stiffness), sqrt(kT*responses.getOwn(i)));
}

/** The force in a part of the step on a gap that a spring holds, which would end there. */
double ReflectedGaps::findPushOfSpring(int i, int part, double end) const {
    const Gap& gap = gaps[i];
    if (part < parts-1)
        return 0;
    const double response = responses.getOfChains(i), softer = 1/(1+gap.stiffness*response);
    if (gap.law == GapLaw::SpringBehind)
        return max(0.0, -gap.stiffness*end*softer);
    const double rest = ofBridges[2*(size_t) i*parts]*sqrt(kT/gap.stiffness);
    const double held = (end+gap.stiffness*response*rest)*softer, responseHeld = response*softer;
    const double back = gap.ceiling < HUGE_VAL ? reflect(gap.ceiling-gap.start, gap.ceiling-held, responseHeld,
            responseHeld, kT*reflections[(size_t) i*parts]) : 0;
    return (held-responseHeld*back-end)/response;
}

/** The force of a gap in a part of the step, with what others push. */
double ReflectedGaps::findPush(int i, int part) const {
    const GapInPart& gap = inPart[i];
    const int one = gap.ports[0], other = gap.ports[1];
    const double end = gap.end+motions[one]+motions[other]-gap.ofChains*gap.push;
    if (!gap.isReflected)
        return findPushOfSpring(i, part, end);
    return reflect(gap.start+motionsAtStart[one]+motionsAtStart[other], end, gap.response, gap.ofChains, gap.variate);
}

/** Let a force on a gap move all ports of its chains. */
void ReflectedGaps::move(int i, double push, bool reflects) {
    for (int side = 0; side < 2; side++)
        if (gaps[i].packOf(side) >= 0)
            moveChain(i, side, push, reflects);
}

/** Let a force on a gap move all ports of the chain on one of its sides. */
void ReflectedGaps::moveChain(int i, int side, double push, bool reflects) {
    const GapResponses::ChainPorts& chain = responses.getPorts(gaps[i].chainOf(side));
    const int count = chain.count(), own = responses.getPort(i, side)-chain.first;
    const double* const row = chain.responsesOf(own);
    double* const to = &motions[chain.first];
    for (int k = 0; k < count; k++)
        to[k] += push*row[k];
    if (!reflects)
        return;
    const double* const shares = &sharesAtStart[gaps[i].chainOf(side)][(size_t) own*count];
    double* const toStart = &motionsAtStart[chain.first];
    for (int k = 0; k < count; k++)
        toStart[k] += push*shares[k];
}

/** The gaps of all other ports on the chains of a gap that is pushed must be looked at again. */
void ReflectedGaps::noteMotion(int i) {
    for (int side = 0; side < 2; side++)
        if (gaps[i].packOf(side) >= 0) {
            const GapResponses::ChainPorts& chain = responses.getPorts(gaps[i].chainOf(side));
            char* const own = &haveMoved[responses.getPort(i, side)];
            const char before = *own;
            fill_n(&haveMoved[chain.first], chain.count(), 1);
            *own = before;
        }
}

/** Find what of the motion of each port by forces on each other one counts at the start of a part. */
void ReflectedGaps::findSharesAtStart(const Loop& loop) {
    sharesAtStart.resize(responses.getNumChains());
    const vector<int>& chains = responses.getChains();
    runInChunks(loop, chains.size(), CHUNK_OF_GAPS, [&] (int number) {
        const GapResponses::ChainPorts& chain = responses.getPorts(chains[number]);
        if (!chain.areNew())
            return;
        vector<double>& shares = sharesAtStart[chains[number]];
        shares.assign((size_t) chain.count()*chain.count(), 0.0);
        for (int port = 0; port < chain.count(); port++) {
            const double* const row = chain.responsesOf(port);
            const int own = chain.ports[port].gap;
            for (int k = 0; k < chain.count(); k++) {
                const int other = chain.ports[k].gap;
                if (other == own || row[k] == 0)
                    continue;
                const double both = responses.getOfChains(own)*responses.getOfChains(other);
                shares[(size_t) port*chain.count()+k] = row[k] > 0 ? SHARE_OF_OPENING*row[k] :
                        -SHARE_OF_CLOSING*min(1.0, row[k]*row[k]/both)*row[k];
            }
        }
    });
}

/**
 * Go through the gaps of a part in turn, forwards and backwards, until no force changes: those that are pushed, and now
 * and then all.
 */
void ReflectedGaps::findPushesOfPart(int part, const Loop& loop) {
    motions.assign(responses.countPorts()+1, 0.0);
    motionsAtStart.assign(responses.countPorts()+1, 0.0);
    haveMoved.assign(responses.countPorts(), 1);
    haveMoved.push_back(0);
    all.visit(false, loop, [&] (int i) {
        if (roles[i] == Role::Apart)
            return 0.0;
        inPart[i].push = roles[i] == Role::Beside || inPart[i].response > 0 ? pushes[(size_t) i*parts+part] : 0;
        if (inPart[i].push != 0)
            move(i, inPart[i].push, inPart[i].isReflected);
        return 0.0;
    });
    // The change of a gap, over what it may be: none where nothing has moved it since.
    auto update = [&] (int i) {
        GapInPart& gap = inPart[i];
        bool hasMoved = false;
        for (int port : gap.ports)
            if (haveMoved[port] != 0) {
                hasMoved = true;
                haveMoved[port] = 0;
            }
        if (!hasMoved)
            return 0.0;
        const double push = findPush(i, part), change = push-gap.push, way = fabs(change)*gap.ofChains/gap.tolerance;
        // Written so that NaN is no change.
        if (!(way > LEAST_SHARE))
            return 0.0;
        gap.push = push;
        move(i, change, gap.isReflected);
        noteMotion(i);
        return way;
    };
    bool converged = false;
    for (int sweeps = 0; sweeps < MOST_SWEEPS; sweeps++) {
        double largest = all.visit(false, loop, [&] (int i) {
            return roles[i] == Role::Pushed && inPart[i].response > 0 ? update(i) : 0.0;
        });
        pushed.select(all, [&] (int i) {
            return roles[i] == Role::Pushed && inPart[i].push != 0;
        });
        if (largest == 0 || (converged && largest <= 1))
            break;
        converged = false;
        for (int i = 0; i < SWEEPS_OF_PUSHED && !converged && ++sweeps < MOST_SWEEPS; i++) {
            const double before = largest;
            largest = pushed.visit(sweeps%2 != 0, loop, update);
            // All that is left to change, if each sweep changes as much less than the one before.
            const double rate = min(largest/before, LARGEST_RATE);
            converged = largest*rate <= 1-rate;
        }
    }
}

/** Find the forces of gaps from their starts, and their ends without forces. */
void ReflectedGaps::findPushes(const Loop& loop) {
    const int count = gaps.size(), none = responses.countPorts();
    inPart.resize(count);
    runInChunks(loop, count, CHUNK_OF_GAPS, [&] (int i) {
        GapInPart& gap = inPart[i];
        if (roles[i] == Role::Pushed)
            forces[i] = 0;
        gap.reached = gaps[i].start;
        gap.isReflected = gaps[i].law == GapLaw::Reflection;
        gap.ofChains = responses.getOfChains(i);
        gap.response = gaps[i].present ? responses.getOwn(i) : 0;
        gap.tolerance = OF_SWEEPS*scaleOf(i)+0.1*LEAST_CHANGE_OF_GAPS;
        for (int side = 0; side < 2; side++)
            gap.ports[side] = responses.getPort(i, side) >= 0 ? responses.getPort(i, side) : none;
    });
    for (int part = 0; part < parts; part++) {
        runInChunks(loop, count, CHUNK_OF_GAPS, [&] (int i) {
            if (roles[i] != Role::Pushed)
                return;
            GapInPart& gap = inPart[i];
            gap.start = gap.reached;
            gap.end = gap.start+(free[i]-gaps[i].start)/parts+bridges[(size_t) i*parts+part];
            gap.variate = kT/parts*reflections[(size_t) i*parts+part];
        });
        findPushesOfPart(part, loop);
        runInChunks(loop, count, CHUNK_OF_GAPS, [&] (int i) {
            if (roles[i] != Role::Pushed)
                return;
            GapInPart& gap = inPart[i];
            forces[i] += pushes[(size_t) i*parts+part] = gap.push;
            gap.reached = gap.end+motions[gap.ports[0]]+motions[gap.ports[1]];
            if (gap.isReflected)
                gap.reached = max(gap.reached, 0.0);
        });
    }
}

/** Find the part of each gap in an iteration from the chains that need it. */
void ReflectedGaps::findRoles(const vector<char>& goingOn) {
    roles.assign(gaps.size(), Role::Apart);
    hasPushed.assign(responses.getNumChains(), 0);
    auto anyChainIs = [&] (int gap, const vector<char>& marks) {
        bool result = false;
        responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int) {
            result |= marks[responses.numberOf(chain)] != 0;
        });
        return result;
    };
    for (size_t i = 0; i < gaps.size(); i++)
        if (anyChainIs(i, goingOn)) {
            roles[i] = Role::Pushed;
            responses.forPorts(i, [&] (const GapResponses::ChainPorts& chain, int) {
                hasPushed[responses.numberOf(chain)] = 1;
            });
        }
    for (size_t i = 0; i < gaps.size(); i++)
        if (roles[i] == Role::Apart && anyChainIs(i, hasPushed))
            roles[i] = Role::Beside;
}

/** Let the forces of gaps on each of their sides, which a function gives, move all ports of chains with pushed gaps. */
template <class Function> void ReflectedGaps::moveAll(Function forceOf, const Loop& loop) {
    motions.assign(responses.countPorts()+1, 0.0);
    all.visit(false, loop, [&] (int i) {
        for (int side = 0; side < 2 && roles[i] != Role::Apart; side++)
            if (gaps[i].packOf(side) >= 0 && hasPushed[gaps[i].chainOf(side)] && forceOf(i, side) != 0)
                moveChain(i, side, forceOf(i, side), false);
        return 0.0;
    });
}

/** Find the responses and random numbers that are not known. */
void ReflectedGaps::complete(const vector<PackStep*>& packs, CoupledEquations& coupled, bool single,
        const Loop& loop) {
    const size_t count = gaps.size();
    if (responses.isComplete() && bridges.size() == count*parts)
        return;
    responses.find(gaps, firstEquations, packs, coupled, precision, single, loop);
    const int needed = max(parts, chooseParts());
    if (needed != parts) {
        pushes.clear();
        ofBridges.clear();
        ofReflections.clear();
        responses.takeForNew();
        roles.assign(count, Role::Pushed);
        hasPushed.assign(responses.getNumChains(), 1);
    }
    parts = needed;
    pushes.resize(count*parts, 0.0);
    drawNumbers(loop);
    findNoise(loop);
    findSharesAtStart(loop);
}

/** Whether the chain of a gap's side takes part in the iteration. */
bool ReflectedGaps::takesPart(int i, int side) const {
    return gaps[i].packOf(side) >= 0 && (*active)[gaps[i].packOf(side)];
}

/** Whether it does not, and has a gap whose force is found. */
bool ReflectedGaps::waits(int i, int side) const {
    return gaps[i].packOf(side) >= 0 && !takesPart(i, side) && hasPushed[gaps[i].chainOf(side)];
}

/** How far the forces of moveAll() have moved a gap's side. */
double ReflectedGaps::motionOf(int i, int side) const {
    return motions[responses.getPort(i, side)];
}

/** Find where gaps end without their forces. */
void ReflectedGaps::findFreeEnds(const CoupledEquations& coupled, const Loop& loop) {
    moveAll([&] (int i, int side) {
        return waits(i, side) ? applied[2*i+side] : 0;
    }, loop);
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int i) {
        double ofWaiting = 0, ofOthers = 0;
        for (int side = 0; side < 2; side++)
            if (takesPart(i, side)) {
                lacking[2*i+side] = 0;
                ofOthers += corrections[2*i+side];
            }
            else if (waits(i, side)) {
                lacking[2*i+side] = -motionOf(i, side);
                ofWaiting += lacking[2*i+side];
            }
        if (roles[i] != Role::Pushed)
            return;
        predicted[i] = gaps[i].end;
        for (int lever = 0; lever < gaps[i].numLevers; lever++)
            predicted[i] += dot(gaps[i].levers[lever].gradient,
                    &coupled.getMoves()[3*(firstEquations[i]+lever-firstEquations[0])]);
        free[i] = predicted[i]+ofOthers+ofWaiting;
    });
}

/** Find where the equations lead gaps with their forces, and what responses lack of that. */
void ReflectedGaps::predictEnds(const CoupledEquations& coupled, const Loop& loop) {
    moveAll([&] (int i, int) {
        return forces[i];
    }, loop);
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int i) {
        double more[2] = {}, pushed = 0;
        for (int side = 0; side < 2; side++) {
            if (waits(i, side))
                lacking[2*i+side] += motionOf(i, side);
            if (!takesPart(i, side))
                continue;
            applied[2*i+side] = forces[i];
            if (!hasPushed[gaps[i].chainOf(side)])
                continue;
            double way = 0;
            for (int lever = 0; lever < gaps[i].numLevers; lever++)
                way += dot(gaps[i].levers[lever].gradient, coupled.getPushedMove(firstEquations[i]+lever, side).data());
            way = side == 0 ? way : -way;
            pushed += way;
            // Responses may be those of an iteration before, and others push through links.
            more[side] = way-motionOf(i, side)-corrections[2*i+side];
        }
        const double change = more[0]+more[1];
        const bool isBack = coupled.joinsPlaces() && change*changes[i] < 0;
        for (int side = 0; side < 2; side++)
            corrections[2*i+side] += isBack ? DAMPING_OF_GAPS*more[side] : more[side];
        if (roles[i] != Role::Pushed)
            return;
        changes[i] = change;
        predicted[i] += pushed+lacking[2*i]+lacking[2*i+1];
    });
}

void ReflectedGaps::push(const vector<PackStep*>& packs, const PackFlags& newActive, const vector<char>& goingOn,
        CoupledEquations& coupled, const CoupledEquations::Demands& demands, const Loop& loop) {
    const size_t count = gaps.size();
    if (count == 0)
        return;
    active = &newActive;
    for (vector<double>* values : {&free, &predicted, &forces, &changes})
        values->resize(count, 0.0);
    for (vector<double>* values : {&corrections, &applied, &lacking})
        values->resize(2*count, 0.0);
    turned.assign(count, 0);
    const size_t first = firstEquations[0];
    responses.addPorts(gaps);
    all.sort(count, responses);
    findRoles(goingOn);
    complete(packs, coupled, demands.single, loop);
    coupled.predictMoves(packs, first, loop);
    findFreeEnds(coupled, loop);
    findPushes(loop);
    vector<double> loads(3*(firstEquations[count]-first));
    runInChunks(loop, count, CHUNK_OF_GAPS, [&] (int i) {
        for (int lever = 0; lever < gaps[i].numLevers; lever++)
            for (int k = 0; k < 3; k++)
                loads[3*(firstEquations[i]+lever-first)+k] = forces[i]*gaps[i].levers[lever].gradient[k];
    });
    coupled.push(packs, first, loads, demands, loop);
    predictEnds(coupled, loop);
}

/** Whether a gap that no iteration knows of yet may be pushed. */
bool ReflectedGaps::wouldPush(const Gap& gap) const {
    if (gap.law != GapLaw::Reflection)
        return gap.law == GapLaw::Spring || gap.end < 0;
    return gap.end < 0 || gap.start*gap.end < LARGE_REFLECTION*kT*gap.response;
}

/**
 * Whether a gap ends behind the surface that reflects it: forces without bound have led it there, or it has become one
 * after forces were found.
 */
bool ReflectedGaps::isBehind(int i) const {
    return gaps[i].present && gaps[i].law == GapLaw::Reflection && gaps[i].end < -scaleOf(i)-LEAST_CHANGE_OF_GAPS;
}

bool ReflectedGaps::isUnfinished(int i) const {
    return deviates(i, OF_ITERATIONS) || isBehind(i);
}

/** Whether a gap is farther from where the equations have led it than a share of its thermal scale. */
bool ReflectedGaps::deviates(int i, double share) const {
    if (!gaps[i].present)
        return false;
    if (i >= (int) predicted.size())
        return wouldPush(gaps[i]);
    const double *const lack = &lacking[2*(size_t) i], end = gaps[i].end+lack[0]+lack[1];
    return !(max({fabs(end-predicted[i]), fabs(changes[i]), fabs(lack[0]), fabs(lack[1])}) <=
            share*scaleOf(i)+LEAST_CHANGE_OF_GAPS);
}

bool ReflectedGaps::anyUnfinished() {
    bool any = false;
    for (size_t i = 0; i < gaps.size(); i++) {
        if (!isUnfinished(i))
            continue;
        any = true;
        // Its chains may have turned so far that their responses have changed.
        if (i < predicted.size() && deviates(i, OF_RESPONSES))
            responses.forget(i);
    }
    return any;
}

/** Mark the chains of a gap. */
template <class Flags> void ReflectedGaps::markChains(int i, Flags& chains) const {
    for (int side = 0; side < 2; side++)
        if (gaps[i].packOf(side) >= 0)
            chains[gaps[i].chainOf(side)] = true;
}

void ReflectedGaps::markUnfinished(vector<char>& chains) const {
    for (size_t i = 0; i < gaps.size(); i++) {
        // Those that have just been found or turned, or have become none, change what chains are pushed by.
        const bool isOther = i >= predicted.size() || turned[i] || (!gaps[i].present && forces[i] != 0);
        if (isOther || isUnfinished(i))
            markChains(i, chains);
    }
    for (int chain : responses.getChains())
        if (!responses.isComplete(chain))
            chains[chain] = 1;
}

/**
 * Whether a gap that is held behind a ceiling is pulled back by much more than it would come out: where its contact has
 * gone on to another gap, which is pushed out, both turn their chains against each other.
 */
bool ReflectedGaps::isTorn(int i) const {
    const Gap& gap = gaps[i];
    if (gap.law != GapLaw::Spring || !(gap.ceiling < HUGE_VAL) || !(getForce(i) < 0))
        return false;
    return -forces[i]*responses.getOwn(i) > LARGEST_PULL*(fabs(free[i]-gap.ceiling)+sqrt(kT*responses.getOwn(i)));
}

void ReflectedGaps::findFailures(vector<bool>& failed) const {
    for (size_t i = 0; i < gaps.size(); i++)
        if (isUnfinished(i) || isTorn(i))
            markChains(i, failed);
}
