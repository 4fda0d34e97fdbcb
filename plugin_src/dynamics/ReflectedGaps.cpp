#include "dynamics/ReflectedGaps.h"
#include "dynamics/TermBlocks.h"
#include <algorithm>
#include <cmath>
#include <numeric>

using namespace cylchain;
using namespace std;

namespace {

/** How far a gap moves in a part, (2 k_B T G)^(1/2), over the thermal depth, where it shares chains with others. */
const double LARGEST_MOTION = 1.5;
/** The most parts. */
const int MOST_PARTS_OF_GAPS = 32;
/** How often all gaps are gone through at most. */
const int MOST_SWEEPS = 200;
/** What the last sweep may change a gap by, and the last iteration, over the thermal scale. */
const double OF_SWEEPS = 0.003, OF_ITERATIONS = 0.03;
/** A change that is less than this share of that is not made. */
const double LEAST_SHARE = 0.1;
/** The same in nm, where nothing moves thermally. */
const double LEAST_CHANGE_OF_GAPS = 1e-7;
/** By which factor the network may change the response of a gap. */
const double LEAST_SHARE_OF_NETWORK = 1e-3, LARGEST_SHARE_OF_NETWORK = 1e3;
/** A gap that has just been found is pushed if its exponential variate is less than this. */
const double LARGE_REFLECTION = 4;
/** Normal numbers are not so large that their chance would be less. */
const double LEAST_CHANCE = 1e-300;
/** Gaps that a thread looks at together. */
const int CHUNK_OF_GAPS = 64;
/** Pivots below this, over the diagonal, are those of ports that move as others do. */
const double LEAST_PIVOT = 1e-10;

double product(const double* a, const double* b) {
    return a[0]*b[0]+a[1]*b[1]+a[2]*b[2];
}

/** The force that reflects the motion of a gap, with an exponential variate of the mean k_B T. */
double reflect(double start, double end, double response, double variate) {
    if (start+end > 0 && start*end >= response*variate)
        return 0;
    const double way = start-end;
    return max(0.0, 0.5*(sqrt(way*way+4*response*variate)-(start+end)))/response;
}

/** Find the Cholesky factor of a matrix with n rows. */
void findRoot(int n, const double* matrix, double* root) {
    for (int row = 0; row < n; row++)
        for (int column = 0; column <= row; column++) {
            double sum = matrix[n*row+column];
            for (int k = 0; k < column; k++)
                sum -= root[n*row+k]*root[n*column+k];
            if (column == row)
                root[n*row+row] = sum > LEAST_PIVOT*matrix[n*row+row] ? sqrt(sum) : 0;
            else
                root[n*row+column] = root[n*column+column] > 0 ? sum/root[n*column+column] : 0;
        }
}

} // namespace

void ReflectedGaps::begin(const StepSettings& settings, const ChainPlaces& places) {
    numChains = places.getNumChains();
    kT = settings.kT;
    noise = GapNoise({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step});
    gaps.clear();
    forces.clear();
    pushes.clear();
    ofBridges.clear();
    ofReflections.clear();
    networks.clear();
    portOf.clear();
    known.clear();
    parts = 1;
    predicted.clear();
    corrections.clear();
}

double ReflectedGaps::countParts(double stiffness, double response) {
    return 2*stiffness*response/(LARGEST_MOTION*LARGEST_MOTION);
}

int ReflectedGaps::add(const Gap& gap) {
    gaps.push_back(gap);
    return gaps.size()-1;
}

void ReflectedGaps::addEquations(vector<CouplingEquation>& equations) {
    firstEquation = equations.size();
    equationOf.resize(gaps.size()+1);
    int count = 0;
    for (size_t i = 0; i < gaps.size(); i++) {
        equationOf[i] = count;
        count += gaps[i].numLevers;
    }
    equationOf[gaps.size()] = count;
    equations.resize(firstEquation+count);
    for (size_t i = 0; i < gaps.size(); i++)
        for (int lever = 0; lever < gaps[i].numLevers; lever++) {
            CouplingEquation& equation = equations[firstEquation+equationOf[i]+lever];
            copy_n(gaps[i].levers[lever].places, 2, equation.places);
            fill_n(equation.force, 3, 0.0);
            const double force = i < forces.size() && gaps[i].present ? max(0.0, forces[i]) : 0;
            for (int k = 0; k < 6; k++)
                equation.stiffness[k] = force*gaps[i].turning[k];
        }
}

/** Whether the gaps are those whose places have been sorted. */
bool ReflectedGaps::hasSamePorts() const {
    if (portOf.size() != 2*gaps.size())
        return false;
    for (size_t i = 0; i < gaps.size(); i++)
        for (int side = 0; side < 2; side++)
            if ((portOf[2*i+side] >= 0) != (gaps[i].present && gaps[i].packOf(side) >= 0))
                return false;
    return true;
}

/** Sort the places of gaps by chains. */
void ReflectedGaps::findPorts() {
    const size_t count = gaps.size();
    // Those of a chain are in the order in which they have been added, on which their noise depends.
    firstPort.assign(numChains+1, 0);
    auto forPlaces = [&] (auto function) {
        for (size_t i = 0; i < count; i++)
            for (int side = 0; side < 2 && gaps[i].present; side++)
                if (gaps[i].packOf(side) >= 0)
                    function(gaps[i].chainOf(side), (int) i, side);
    };
    forPlaces([&] (int chain, int, int) {
        firstPort[chain+1]++;
    });
    chains.clear();
    size_t matrix = 0;
    for (int chain = 0; chain < numChains; chain++) {
        const int own = firstPort[chain+1];
        firstPort[chain+1] += firstPort[chain];
        if (own > 0)
            chains.push_back({chain, firstPort[chain], own, matrix});
        matrix += (size_t) own*own;
    }
    ports.resize(firstPort[numChains]);
    chainOf.resize(ports.size());
    portOf.assign(2*count, -1);
    for (size_t i = 0; i < chains.size(); i++)
        fill_n(chainOf.begin()+chains[i].first, chains[i].count, i);
    forPlaces([&] (int chain, int gap, int side) {
        const int port = firstPort[chain]++;
        ports[port] = {gap, side};
        portOf[2*gap+side] = port;
    });
    responses.resize(matrix);
    roots.resize(matrix);
    known.assign(chains.size(), 0);
}

/** Find how a force at each port of a chain moves all ports of it: a substitution for a port of each lane of a pack. */
void ReflectedGaps::findResponses(const vector<PackStep*>& packs, const CoupledEquations& coupled, const Loop& loop) {
    vector<vector<int> > chainsOfPack(packs.size());
    for (size_t i = 0; i < chains.size(); i++)
        chainsOfPack[gaps[ports[chains[i].first].gap].packOf(ports[chains[i].first].side)].push_back(i);
    loop(packs.size(), [&] (int pack) {
        const vector<int>& own = chainsOfPack[pack];
        if (all_of(own.begin(), own.end(), [&] (int chain) {return known[chain] != 0;}))
            return;
        static thread_local vector<double> force, move;
        const size_t size = 3*(size_t) TermBlocks::fill(coupled.countTerms(pack));
        move.resize(size);
        int rounds = 0;
        for (int i : own)
            rounds = max(rounds, chains[i].count);
        // Call a function with the term of each lever of a port, its number, and the gradient at it.
        auto forLevers = [&] (int port, auto function) {
            const Gap& gap = gaps[ports[port].gap];
            for (int lever = 0; lever < gap.numLevers; lever++)
                function(coupled.getTerm(firstEquation+equationOf[ports[port].gap]+lever, ports[port].side)-
                        coupled.firstTerm(pack), gap.levers[lever].gradient);
        };
        force.assign(size, 0.0);
        for (int round = 0; round < rounds; round++) {
            auto setForces = [&] (double factor) {
                for (int i : own)
                    if (round < chains[i].count) {
                        const int port = chains[i].first+round;
                        const double sign = ports[port].side == 0 ? factor : -factor;
                        forLevers(port, [&] (int term, const double* gradient) {
                            for (int k = 0; k < 3; k++)
                                force[TermBlocks::place(term, k)] = sign*gradient[k];
                        });
                    }
            };
            setForces(1);
            packs[pack]->respond(force.data(), move.data());
            setForces(0);
            for (int i : own) {
                const PortsOfChain& chain = chains[i];
                if (round >= chain.count)
                    continue;
                for (int other = 0; other < chain.count; other++) {
                    const int port = chain.first+other;
                    double sum = 0;
                    forLevers(port, [&] (int term, const double* gradient) {
                        for (int k = 0; k < 3; k++)
                            sum += gradient[k]*move[TermBlocks::place(term, k)];
                    });
                    const double sign = ports[port].side == 0 ? 1 : -1;
                    responses[chain.matrix+(size_t) round*chain.count+other] = sign*sum;
                }
            }
        }
        for (int i : own) {
            const int n = chains[i].count;
            double* const matrix = &responses[chains[i].matrix];
            for (int row = 0; row < n; row++)
                for (int column = 0; column < row; column++)
                    matrix[n*row+column] = matrix[n*column+row] = 0.5*(matrix[n*row+column]+matrix[n*column+row]);
            findRoot(n, matrix, &roots[chains[i].matrix]);
            known[i] = 1;
        }
    });
    own.assign(gaps.size(), 0.0);
    for (size_t i = 0; i < ports.size(); i++) {
        const PortsOfChain& chain = chains[chainOf[i]];
        const int local = i-chain.first;
        own[ports[i].gap] += responses[chain.matrix+(size_t) local*chain.count+local];
    }
}

int ReflectedGaps::chooseParts() const {
    if (kT == 0)
        return 1;
    double largest = 0;
    for (size_t i = 0; i < gaps.size(); i++) {
        const bool shares = any_of(&portOf[2*i], &portOf[2*i]+2, [&] (int port) {
            return port >= 0 && chains[chainOf[port]].count > 1;
        });
        if (shares && gaps[i].law == GapLaw::Reflection)
            largest = max(largest, countParts(gaps[i].stiffness, own[i]));
    }
    return clamp((int) ceil(largest), 1, MOST_PARTS_OF_GAPS);
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

/** Give numbers of ports the covariance of the responses, and sum them for each gap. */
void ReflectedGaps::correlate(const vector<double>& normals, vector<double>& sums) const {
    sums.assign(gaps.size()*parts, 0.0);
    for (const PortsOfChain& chain : chains)
        for (int row = 0; row < chain.count; row++) {
            double* const sum = &sums[(size_t) ports[chain.first+row].gap*parts];
            const double* const root = &roots[chain.matrix+(size_t) row*chain.count];
            for (int column = 0; column <= row; column++) {
                const Port& port = ports[chain.first+column];
                const double* const own = &normals[(2*(size_t) port.gap+port.side)*parts];
                for (int part = 0; part < parts; part++)
                    sum[part] += root[column]*own[part];
            }
        }
}

/**
 * Find bridges of Brownian motion, and exponential variates, that are correlated as the gaps move: those that move as
 * one are reflected as one.
 */
void ReflectedGaps::findNoise() {
    correlate(ofBridges, bridges);
    correlate(ofReflections, reflections);
    const double size = sqrt(2*kT/parts);
    for (size_t i = 0; i < gaps.size(); i++) {
        double *const bridge = &bridges[i*parts], *const reflection = &reflections[i*parts];
        const double mean = accumulate(bridge, bridge+parts, 0.0)/parts, ofGap = size*sqrt(networks[i]);
        const double perSize = own[i] > 0 ? M_SQRT1_2/sqrt(own[i]) : 0;
        for (int part = 0; part < parts; part++) {
            bridge[part] = (bridge[part]-mean)*ofGap;
            reflection[part] = -log(max(LEAST_CHANCE, 0.5*erfc(reflection[part]*perSize)));
        }
    }
}

/** How far a gap moves without being noticed: thermally behind its surface, or in the step. */
double ReflectedGaps::scaleOf(int i) const {
    return min(sqrt(kT/gaps[i].stiffness), sqrt(kT*networks[i]*own[i]));
}

/** The force of a gap in a part, with what others push. */
double ReflectedGaps::findPush(int i, int part) const {
    const Gap& gap = gaps[i];
    const double response = networks[i]*own[i];
    double others = -response*ofPart[i];
    for (int side = 0; side < 2; side++)
        if (portOf[2*i+side] >= 0)
            others += networks[i]*moved[portOf[2*i+side]];
    const double end = ends[i]+others;
    if (gap.law == GapLaw::Reflection) {
        double opening = -response*ofPart[i];
        for (int side = 0; side < 2; side++)
            if (portOf[2*i+side] >= 0)
                opening += networks[i]*opened[portOf[2*i+side]];
        return reflect(starts[i]+1.0/3*opening, end, response, kT/parts*reflections[(size_t) i*parts+part]);
    }
    if (part < parts-1)
        return 0;
    const double softer = 1/(1+gap.stiffness*response);
    if (gap.law == GapLaw::SpringBehind)
        return max(0.0, -gap.stiffness*end*softer);
    const double rest = ofBridges[2*(size_t) i*parts]*sqrt(kT/gap.stiffness);
    const double held = (end+gap.stiffness*response*rest)*softer, responseHeld = response*softer;
    const double back = gap.ceiling < HUGE_VAL ? reflect(gap.ceiling-gap.start, gap.ceiling-held, responseHeld,
            kT*reflections[(size_t) i*parts]) : 0;
    return (held-responseHeld*back-end)/response;
}

/** Let a force on a gap move all ports of its chains. */
void ReflectedGaps::move(int i, double push) {
    for (int side = 0; side < 2; side++) {
        const int port = portOf[2*i+side];
        if (port < 0)
            continue;
        const PortsOfChain& chain = chains[chainOf[port]];
        const double* const row = &responses[chain.matrix+(size_t) (port-chain.first)*chain.count];
        double* const to = &moved[chain.first];
        for (int k = 0; k < chain.count; k++)
            to[k] += push*row[k];
        if (gaps[i].law == GapLaw::Reflection)
            for (int k = 0; k < chain.count; k++)
                opened[chain.first+k] += push*max(0.0, row[k]);
    }
}

/**
 * Go through the gaps of a part in turn, forwards and backwards, until no force changes: those that are pushed, and now
 * and then all.
 */
void ReflectedGaps::findPushesOfPart(int part) {
    const int count = gaps.size();
    moved.assign(ports.size(), 0.0);
    opened.assign(ports.size(), 0.0);
    for (int i = 0; i < count; i++) {
        ofPart[i] = own[i] > 0 ? pushes[(size_t) i*parts+part] : 0;
        if (ofPart[i] != 0)
            move(i, ofPart[i]);
    }
    pushed.clear();
    auto update = [&] (int i) {
        const double push = findPush(i, part), change = push-ofPart[i];
        const double way = fabs(change)*networks[i]*own[i];
        // Written so that NaN is no change.
        if (!(way > LEAST_SHARE*tolerances[i]))
            return false;
        ofPart[i] = push;
        move(i, change);
        return way > tolerances[i];
    };
    for (int sweeps = 0; sweeps < MOST_SWEEPS; sweeps++) {
        bool changes = false;
        pushed.clear();
        for (int i = 0; i < count; i++)
            if (own[i] > 0) {
                changes |= update(i);
                if (ofPart[i] != 0)
                    pushed.push_back(i);
            }
        if (!changes)
            break;
        for (int inner = 0; changes && inner < 8 && ++sweeps < MOST_SWEEPS; inner++) {
            changes = false;
            for (size_t k = 0; k < pushed.size(); k++)
                changes |= update(pushed[sweeps%2 == 0 ? k : pushed.size()-1-k]);
        }
    }
    for (int i = 0; i < count; i++)
        pushes[(size_t) i*parts+part] = ofPart[i];
}

/** Find the forces of all gaps from their starts, and their ends without forces. */
void ReflectedGaps::findPushes() {
    const int count = gaps.size();
    ofPart.resize(count);
    starts.resize(count);
    ends.resize(count);
    forces.assign(count, 0.0);
    tolerances.resize(count);
    for (int i = 0; i < count; i++) {
        predicted[i] = gaps[i].start;
        tolerances[i] = OF_SWEEPS*scaleOf(i)+0.1*LEAST_CHANGE_OF_GAPS;
    }
    for (int part = 0; part < parts; part++) {
        for (int i = 0; i < count; i++) {
            starts[i] = predicted[i];
            ends[i] = starts[i]+(free[i]-gaps[i].start)/parts+bridges[(size_t) i*parts+part];
        }
        findPushesOfPart(part);
        for (int i = 0; i < count; i++) {
            forces[i] += ofPart[i];
            predicted[i] = ends[i];
            for (int side = 0; side < 2; side++)
                if (portOf[2*i+side] >= 0)
                    predicted[i] += networks[i]*moved[portOf[2*i+side]];
            if (gaps[i].law == GapLaw::Reflection && part < parts-1)
                predicted[i] = max(predicted[i], 0.0);
        }
    }
}

void ReflectedGaps::push(const vector<PackStep*>& packs, CoupledEquations& coupled,
        const CoupledEquations::Demands& demands, const Loop& loop) {
    const size_t count = gaps.size();
    if (count == 0)
        return;
    networks.resize(count, 1.0);
    free.resize(count);
    predicted.resize(count);
    if (!hasSamePorts())
        findPorts();
    if (find(known.begin(), known.end(), 0) != known.end()) {
        findResponses(packs, coupled, loop);
        const int needed = max(parts, chooseParts());
        if (needed != parts) {
            pushes.clear();
            ofBridges.clear();
            ofReflections.clear();
        }
        parts = needed;
        pushes.resize(count*parts, 0.0);
        drawNumbers(loop);
        findNoise();
    }
    auto endMove = [&] (size_t i, const vector<double>& moves) {
        double sum = 0;
        for (int lever = 0; lever < gaps[i].numLevers; lever++)
            sum += product(gaps[i].levers[lever].gradient, &moves[3*(equationOf[i]+lever)]);
        return sum;
    };
    coupled.predictMoves(packs, firstEquation, loop);
    corrections.resize(count, 0.0);
    for (size_t i = 0; i < count; i++)
        free[i] = gaps[i].end+endMove(i, coupled.getMoves())+corrections[i];
    findPushes();
    vector<double> loads(3*equationOf[count]);
    for (size_t i = 0; i < count; i++)
        for (int lever = 0; lever < gaps[i].numLevers; lever++)
            for (int k = 0; k < 3; k++)
                loads[3*(equationOf[i]+lever)+k] = forces[i]*gaps[i].levers[lever].gradient[k];
    coupled.push(packs, firstEquation, loads, demands, loop);
    networkChanges.assign(count, 0);
    if (coupled.joinsPlaces()) {
        moved.assign(ports.size(), 0.0);
        for (size_t i = 0; i < count; i++)
            if (forces[i] != 0)
                move(i, forces[i]);
    }
    for (size_t i = 0; i < count; i++) {
        const double pushed = endMove(i, coupled.getPushedMoves());
        if (coupled.joinsPlaces())
            followNetwork(i, pushed);
        predicted[i] = free[i]-corrections[i]+pushed;
    }
}

/**
 * Take note of how forces have moved a gap in a network: c is what the network lets it move by, and what others have
 * pushed through the network moves its end.
 */
void ReflectedGaps::followNetwork(int i, double pushed) {
    double ofChains = 0;
    for (int side = 0; side < 2; side++)
        if (portOf[2*i+side] >= 0)
            ofChains += moved[portOf[2*i+side]];
    const double before = networks[i];
    if (forces[i] > 0 && ofChains > 0)
        networks[i] = clamp(pushed/ofChains, LEAST_SHARE_OF_NETWORK, LARGEST_SHARE_OF_NETWORK);
    const double correction = pushed-networks[i]*ofChains;
    networkChanges[i] = fabs(correction-corrections[i])+fabs(networks[i]-before)*own[i]*forces[i];
    corrections[i] = correction;
}

/** Whether a gap that no iteration knows of yet may be pushed. */
bool ReflectedGaps::wouldPush(const Gap& gap) const {
    if (gap.law != GapLaw::Reflection)
        return gap.law == GapLaw::Spring || gap.end < 0;
    return gap.end < 0 || gap.start*gap.end < LARGE_REFLECTION*kT*gap.response;
}

bool ReflectedGaps::isUnfinished(int i) const {
    if (!gaps[i].present)
        return false;
    if (i >= (int) predicted.size())
        return wouldPush(gaps[i]);
    return !(max(fabs(gaps[i].end-predicted[i]), networkChanges[i]) <= OF_ITERATIONS*scaleOf(i)+LEAST_CHANGE_OF_GAPS);
}

bool ReflectedGaps::anyUnfinished() {
    bool any = false;
    for (size_t i = 0; i < gaps.size(); i++) {
        if (!isUnfinished(i))
            continue;
        any = true;
        // Its chains have turned so far that their responses have changed.
        for (int side = 0; side < 2 && i < predicted.size(); side++)
            if (portOf[2*i+side] >= 0)
                known[chainOf[portOf[2*i+side]]] = 0;
    }
    return any;
}

void ReflectedGaps::findFailures(vector<bool>& failed) const {
    for (size_t i = 0; i < gaps.size(); i++)
        for (int side = 0; side < 2 && isUnfinished(i); side++)
            if (gaps[i].packOf(side) >= 0)
                failed[gaps[i].chainOf(side)] = true;
}
