#include "networks/ReflectedMotion.h"
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
/** What sweeps may leave to change of a gap, over the thermal scale, or in nm where nothing moves thermally. */
const double OF_SWEEPS = 0.01, LEAST_CHANGE_OF_SWEEPS = 1e-8;
/** A change that is less than this share of that is not made. */
const double LEAST_SHARE = 0.01;
/** Sweeps are taken to change by this factor at most from one to the next. */
const double LARGEST_RATE = 0.995;
/** Normal numbers are not so large that their chance would be less. */
const double LEAST_CHANCE = 1e-300;

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

void ReflectedMotion::begin(const StepSettings& settings) {
    kT = settings.kT;
    noise = GapNoise({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step});
    all.begin();
    parts = 1;
    for (vector<double>* numbers : {&pushes, &bridges, &ofBridges, &ofReflections})
        numbers->clear();
}

bool ReflectedMotion::chooseParts() {
    double largest = 0;
    for (size_t i = 0; i < gaps.size() && kT != 0; i++) {
        bool shares = false;
        responses.forPorts(i, [&] (const GapResponses::ChainPorts& chain, int) {
            shares |= chain.count() > 1;
        });
        if (shares && gaps[i].present && gaps[i].law == GapLaw::Reflection)
            largest = max(largest, gaps[i].stiffness*responses.getOwn(i));
    }
    const int needed = min<double>(ceil(2*largest/(LARGEST_MOTION*LARGEST_MOTION)), MOST_PARTS_OF_GAPS);
    if (needed <= parts)
        return false;
    parts = needed;
    pushes.clear();
    ofBridges.clear();
    ofReflections.clear();
    return true;
}

void ReflectedMotion::draw(const Loop& loop) {
    pushes.resize(gaps.size()*parts, 0.0);
    drawNumbers(loop);
    findNoise(loop);
    findSharesAtStart(loop);
}

/** Draw the numbers of gaps that have none for so many parts. */
void ReflectedMotion::drawNumbers(const Loop& loop) {
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
void ReflectedMotion::correlate(const vector<double>& normals, vector<double>& sums, const Loop& loop) const {
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
void ReflectedMotion::findNoise(const Loop& loop) {
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

double ReflectedMotion::getScale(int i) const {
    return min(sqrt(kT/gaps[i].stiffness), sqrt(kT*responses.getOwn(i)));
}

/** The force in a part of the step on a gap that a spring holds, which would end there. */
double ReflectedMotion::findPushOfSpring(int i, int part, double end) const {
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
double ReflectedMotion::findPush(int i, int part) const {
    const GapInPart& gap = inPart[i];
    const int one = gap.ports[0], other = gap.ports[1];
    const double end = gap.end+motions[one]+motions[other]-gap.ofChains*gap.push;
    if (!gap.isReflected)
        return findPushOfSpring(i, part, end);
    return reflect(gap.start+motionsAtStart[one]+motionsAtStart[other], end, gap.response, gap.ofChains, gap.variate);
}

/** Let a force on a gap move all ports of its chains. */
void ReflectedMotion::move(int i, double push, bool reflects) {
    for (int side = 0; side < 2; side++)
        if (gaps[i].packOf(side) >= 0)
            moveChain(i, side, push, reflects);
}

/** Let a force on a gap move all ports of the chain on one of its sides. */
void ReflectedMotion::moveChain(int i, int side, double push, bool reflects) {
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
void ReflectedMotion::noteMotion(int i) {
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
void ReflectedMotion::findSharesAtStart(const Loop& loop) {
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
void ReflectedMotion::findForcesOfPart(int part, const vector<GapRole>& roles, const Loop& loop) {
    motions.assign(responses.countPorts()+1, 0.0);
    motionsAtStart.assign(responses.countPorts()+1, 0.0);
    haveMoved.assign(responses.countPorts(), 1);
    haveMoved.push_back(0);
    all.visit(false, loop, [&] (int i) {
        if (roles[i] == GapRole::Apart)
            return 0.0;
        inPart[i].push = roles[i] == GapRole::Beside || inPart[i].response > 0 ? pushes[(size_t) i*parts+part] : 0;
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
            return roles[i] == GapRole::Pushed && inPart[i].response > 0 ? update(i) : 0.0;
        });
        pushed.select(all, loop, [&] (int i) {
            return roles[i] == GapRole::Pushed && inPart[i].push != 0;
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

void ReflectedMotion::findForces(const vector<GapRole>& roles, const vector<double>& free, vector<double>& forces,
            const Loop& loop) {
    const int count = gaps.size(), none = responses.countPorts();
    inPart.resize(count);
    runInChunks(loop, count, CHUNK_OF_GAPS, [&] (int i) {
        GapInPart& gap = inPart[i];
        if (roles[i] == GapRole::Pushed)
            forces[i] = 0;
        gap.reached = gaps[i].start;
        gap.isReflected = gaps[i].law == GapLaw::Reflection;
        gap.ofChains = responses.getOfChains(i);
        gap.response = gaps[i].present ? responses.getOwn(i) : 0;
        gap.tolerance = OF_SWEEPS*getScale(i)+LEAST_CHANGE_OF_SWEEPS;
        for (int side = 0; side < 2; side++)
            gap.ports[side] = responses.getPort(i, side) >= 0 ? responses.getPort(i, side) : none;
    });
    for (int part = 0; part < parts; part++) {
        runInChunks(loop, count, CHUNK_OF_GAPS, [&] (int i) {
            if (roles[i] != GapRole::Pushed)
                return;
            GapInPart& gap = inPart[i];
            gap.start = gap.reached;
            gap.end = gap.start+(free[i]-gaps[i].start)/parts+bridges[(size_t) i*parts+part];
            gap.variate = kT/parts*reflections[(size_t) i*parts+part];
        });
        findForcesOfPart(part, roles, loop);
        runInChunks(loop, count, CHUNK_OF_GAPS, [&] (int i) {
            if (roles[i] != GapRole::Pushed)
                return;
            GapInPart& gap = inPart[i];
            forces[i] += pushes[(size_t) i*parts+part] = gap.push;
            gap.reached = gap.end+motions[gap.ports[0]]+motions[gap.ports[1]];
            if (gap.isReflected)
                gap.reached = max(gap.reached, 0.0);
        });
    }
}

