#include "dynamics/ReflectedGaps.h"
#include "dynamics/TermBlocks.h"
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
/** The share of what others push a gap open by that counts at the start of a part. */
const double SHARE_AT_START = 1.0/3;
/** What sweeps may leave to change of a gap, and the last iteration may change, over the thermal scale. */
const double OF_SWEEPS = 0.01, OF_ITERATIONS = 0.03;
/** Gaps that end farther than this from where the equations have led them have turned: others keep their responses. */
const double OF_RESPONSES = 0.3;
/** A change that is less than this share of that is not made. */
const double LEAST_SHARE = 0.01;
/** What responses lack may go back and forth between gaps that links move together: it changes by this share then. */
const double DAMPING_OF_GAPS = 0.5;
/** A ceiling pulls a gap back by less than this, over the way that it would go beyond and its thermal motion. */
const double LARGEST_PULL = 10;
/** Sweeps are taken to change by this factor at most from one to the next. */
const double LARGEST_RATE = 0.995;
/** The same in nm, where nothing moves thermally. */
const double LEAST_CHANGE_OF_GAPS = 1e-7;
/** What links between the two chains of a gap leave of its response at least. */
const double LEAST_SHARE_OF_LINKS = 0.02;
/** A gap that has just been found is pushed if its exponential variate is less than this. */
const double LARGE_REFLECTION = 4;
/** Normal numbers are not so large that their chance would be less. */
const double LEAST_CHANCE = 1e-300;
/** Gaps that a thread looks at together. */
const int CHUNK_OF_GAPS = 64;
/** Pivots below this, over the diagonal, are those of ports that move as others do. */
const double LEAST_PIVOT = 1e-6;

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
    precision = settings.precision;
    noise = GapNoise({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step});
    gaps.clear();
    forces.clear();
    pushes.clear();
    ofBridges.clear();
    ofReflections.clear();
    portOf.clear();
    known.clear();
    parts = 1;
    changes.clear();
    predicted.clear();
    corrections.clear();
}

int ReflectedGaps::add(const Gap& gap) {
    gaps.push_back(gap);
    return gaps.size()-1;
}

void ReflectedGaps::addEquations(vector<CouplingEquation>& equations) {
    firstEquation = equations.size();
    if (!gaps.empty())
        links.setEquations(equations, numChains);
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
    firstMoves.resize(ports.size());
    size_t moves = 0;
    for (size_t port = 0; port < ports.size(); port++) {
        firstMoves[port] = moves;
        const int chain = chains[chainOf[port]].chain;
        moves += 3*(links.end(chain)-links.begin(chain));
    }
    movesOfLinks.resize(moves);
    known.assign(chains.size(), 0);
}

/** Find how a force at each port of a chain moves all ports of it: a substitution for a port of each lane of a pack. */
void ReflectedGaps::findResponses(const vector<PackStep*>& packs, CoupledEquations& coupled, bool single,
        const Loop& loop) {
    links.find(packs, coupled, precision, loop);
    vector<vector<int> > chainsOfPack(packs.size());
    for (size_t i = 0; i < chains.size(); i++)
        if (!known[i])
            chainsOfPack[gaps[ports[chains[i].first].gap].packOf(ports[chains[i].first].side)].push_back(i);
    auto findOfPack = [&] (int pack, auto number) {
        typedef decltype(number) Number;
        const vector<int>& own = chainsOfPack[pack];
        if (own.empty())
            return;
        /** A term of a port, and the gradient there. */
        struct TermOfPort {
            int place;
            Number gradient[3];
        };
        static thread_local vector<TermOfPort> terms;
        static thread_local vector<int> firstTerms;
        static thread_local vector<Number> force, move;
        const size_t size = 3*(size_t) TermBlocks::fill(coupled.countTerms(pack));
        force.assign(size, Number(0));
        move.resize(size);
        terms.clear();
        firstTerms.clear();
        int rounds = 0;
        for (int i : own) {
            rounds = max(rounds, chains[i].count);
            for (int port = chains[i].first; port < chains[i].first+chains[i].count; port++) {
                const int number = ports[port].gap, side = ports[port].side;
                const Gap& gap = gaps[number];
                const Number sign = side == 0 ? 1 : -1;
                firstTerms.push_back(terms.size());
                for (int lever = 0; lever < gap.numLevers; lever++) {
                    const int term = coupled.getTerm(firstEquation+equationOf[number]+lever, side);
                    const double* const gradient = gap.levers[lever].gradient;
                    terms.push_back({TermBlocks::place(term-coupled.firstTerm(pack), 0), {sign*(Number) gradient[0],
                            sign*(Number) gradient[1], sign*(Number) gradient[2]}});
                }
            }
        }
        firstTerms.push_back(terms.size());
        constexpr int STRIDE = TermBlocks::SIZE;
        for (int round = 0; round < rounds; round++) {
            auto forTermsOfRound = [&] (auto function) {
                int first = 0;
                for (int i : own) {
                    for (int k = firstTerms[first+round]; round < chains[i].count && k < firstTerms[first+round+1]; k++)
                        function(terms[k]);
                    first += chains[i].count;
                }
            };
            forTermsOfRound([&] (const TermOfPort& term) {
                for (int k = 0; k < 3; k++)
                    force[term.place+STRIDE*k] = term.gradient[k];
            });
            packs[pack]->respond(force.data(), move.data());
            forTermsOfRound([&] (const TermOfPort& term) {
                for (int k = 0; k < 3; k++)
                    force[term.place+STRIDE*k] = 0;
            });
            int first = 0;
            for (int i : own) {
                const int count = chains[i].count;
                double* const row = &responses[chains[i].matrix+(size_t) round*count];
                for (int other = 0; round < count && other < count; other++) {
                    Number sum = 0;
                    for (int k = firstTerms[first+other]; k < firstTerms[first+other+1]; k++) {
                        const Number* const at = &move[terms[k].place];
                        const Number* const gradient = terms[k].gradient;
                        sum += gradient[0]*at[0]+gradient[1]*at[STRIDE]+gradient[2]*at[2*STRIDE];
                    }
                    row[other] = sum;
                }
                if (round < count) {
                    double* to = &movesOfLinks[firstMoves[chains[i].first+round]];
                    for (const LinkYielding::Side* side = links.begin(chains[i].chain);
                            side != links.end(chains[i].chain); side++, to += 3) {
                        const int term = coupled.getTerm(links.getLinks()[side->link].equation, side->side);
                        const Number* const at = &move[TermBlocks::place(term-coupled.firstTerm(pack), 0)];
                        for (int k = 0; k < 3; k++)
                            to[k] = at[STRIDE*k];
                    }
                }
                first += count;
            }
        }
        for (int i : own) {
            yield(chains[i]);
            const int n = chains[i].count;
            double* const matrix = &responses[chains[i].matrix];
            for (int row = 0; row < n; row++)
                for (int column = 0; column < row; column++)
                    matrix[n*row+column] = matrix[n*column+row] = 0.5*(matrix[n*row+column]+matrix[n*column+row]);
            findRoot(n, matrix, &roots[chains[i].matrix]);
            known[i] = 1;
        }
    };
    loop(packs.size(), [&] (int pack) {
        if (single)
            findOfPack(pack, float());
        else
            findOfPack(pack, double());
    });
    ofChains.assign(gaps.size(), 0.0);
    for (size_t i = 0; i < ports.size(); i++) {
        const PortsOfChain& chain = chains[chainOf[i]];
        const int local = i-chain.first;
        ofChains[ports[i].gap] += responses[chain.matrix+(size_t) local*chain.count+local];
    }
    own.resize(gaps.size());
    for (size_t i = 0; i < gaps.size(); i++) {
        const int one = portOf[2*i], other = portOf[2*i+1];
        if (one >= 0 && other >= 0 && chainOf[one] == chainOf[other]) {
            const PortsOfChain& chain = chains[chainOf[one]];
            ofChains[i] += 2*responses[chain.matrix+(size_t) (one-chain.first)*chain.count+other-chain.first];
        }
        own[i] = max(ofChains[i]+yieldOf(i), LEAST_SHARE_OF_LINKS*ofChains[i]);
    }
}

/** Add to the responses of a chain what the yielding of its links does. */
void ReflectedGaps::yield(const PortsOfChain& chain) {
    const LinkYielding::Side *const first = links.begin(chain.chain), *const last = links.end(chain.chain);
    double* const matrix = &responses[chain.matrix];
    for (int row = 0; row < chain.count && first != last; row++) {
        const double* ofRow = &movesOfLinks[firstMoves[chain.first+row]];
        size_t offset = 0;
        for (const LinkYielding::Side* side = first; side != last; side++, offset += 3) {
            const LinkYielding::Link& link = links.getLinks()[side->link];
            const double* const m = link.ofPlace[side->side];
            const double* const u = ofRow+offset;
            double pull[] = {u[0]*m[0]+u[1]*m[3]+u[2]*m[6], u[0]*m[1]+u[1]*m[4]+u[2]*m[7],
                    u[0]*m[2]+u[1]*m[5]+u[2]*m[8]};
            if (link.chains[0] == link.chains[1]) {
                // What moves the other place pulls at this one.
                const double* const v = ofRow+3*(size_t) links.getNumber(side->link, 1-side->side);
                const double* const b = link.between;
                for (int k = 0; k < 3; k++)
                    pull[k] += side->side == 0 ? dot(b+3*k, v) : b[k]*v[0]+b[3+k]*v[1]+b[6+k]*v[2];
            }
            for (int column = 0; column < chain.count; column++)
                matrix[(size_t) row*chain.count+column] +=
                        dot(pull, &movesOfLinks[firstMoves[chain.first+column]+offset]);
        }
    }
}

/** How much farther a force moves a gap because links join its two chains. */
double ReflectedGaps::yieldOf(int i) const {
    const int one = portOf[2*i], other = portOf[2*i+1];
    if (one < 0 || other < 0 || chainOf[one] == chainOf[other])
        return 0;
    double sum = 0;
    const int chain = chains[chainOf[one]].chain, second = chains[chainOf[other]].chain;
    size_t offset = firstMoves[one];
    for (const LinkYielding::Side* side = links.begin(chain); side != links.end(chain); side++, offset += 3) {
        const LinkYielding::Link& link = links.getLinks()[side->link];
        if (link.chains[1-side->side] != second)
            continue;
        const double* const v = &movesOfLinks[firstMoves[other]+3*(size_t) links.getNumber(side->link, 1-side->side)];
        const double *const u = &movesOfLinks[offset], *const first = side->side == 0 ? u : v,
                *const last = side->side == 0 ? v : u, *const b = link.between;
        for (int row = 0; row < 3; row++)
            sum += 2*first[row]*dot(b+3*row, last);
    }
    return sum;
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
            largest = max(largest, gaps[i].stiffness*own[i]);
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
        const double mean = accumulate(bridge, bridge+parts, 0.0)/parts;
        const double ofGap = ofChains[i] > 0 ? size*sqrt(own[i]/ofChains[i]) : 0;
        const double perSize = ofChains[i] > 0 ? M_SQRT1_2/sqrt(ofChains[i]) : 0;
        for (int part = 0; part < parts; part++) {
            bridge[part] = (bridge[part]-mean)*ofGap;
            reflection[part] = -log(max(LEAST_CHANCE, 0.5*erfc(reflection[part]*perSize)));
        }
    }
}

/** How far a gap moves without being noticed: thermally behind its surface, or in the step. */
double ReflectedGaps::scaleOf(int i) const {
    return min(sqrt(kT/gaps[i].stiffness), sqrt(kT*own[i]));
}

/** The force in a part of the step on a gap that a spring holds, which would end there. */
double ReflectedGaps::findPushOfSpring(int i, int part, double end) const {
    const Gap& gap = gaps[i];
    if (part < parts-1)
        return 0;
    const double response = ofChains[i], softer = 1/(1+gap.stiffness*response);
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
    const MotionOfPort &one = motions[gap.ports[0]], &other = motions[gap.ports[1]];
    const double end = gap.end+one.all+other.all-gap.ofChains*gap.push;
    if (!gap.isReflected)
        return findPushOfSpring(i, part, end);
    const double opening = one.opening+other.opening-gap.ofChains*gap.push;
    return reflect(gap.start+SHARE_AT_START*opening, end, gap.response, gap.ofChains, gap.variate);
}

/** Let a force on a gap move all ports of its chains. */
void ReflectedGaps::move(int i, double push, bool opens) {
    for (int port : {portOf[2*i], portOf[2*i+1]}) {
        if (port < 0)
            continue;
        const PortsOfChain& chain = chains[chainOf[port]];
        const double* const row = &responses[chain.matrix+(size_t) (port-chain.first)*chain.count];
        MotionOfPort* const to = &motions[chain.first];
        for (int k = 0; k < chain.count; k++) {
            const double way = push*row[k];
            to[k].all += way;
            to[k].opening += opens && row[k] > 0 ? way : 0;
        }
    }
}

/**
 * Go through the gaps of a part in turn, forwards and backwards, until no force changes: those that are pushed, and now
 * and then all.
 */
void ReflectedGaps::findPushesOfPart(int part) {
    const int count = gaps.size();
    motions.assign(ports.size()+1, MotionOfPort());
    for (int i = 0; i < count; i++) {
        inPart[i].push = own[i] > 0 ? pushes[(size_t) i*parts+part] : 0;
        if (inPart[i].push != 0)
            move(i, inPart[i].push, inPart[i].isReflected);
    }
    // The change of a gap, over what it may be.
    auto update = [&] (int i) {
        GapInPart& gap = inPart[i];
        const double push = findPush(i, part), change = push-gap.push, way = fabs(change)*gap.ofChains/gap.tolerance;
        // Written so that NaN is no change.
        if (!(way > LEAST_SHARE))
            return 0.0;
        gap.push = push;
        move(i, change, gap.isReflected);
        return way;
    };
    bool converged = false;
    for (int sweeps = 0; sweeps < MOST_SWEEPS; sweeps++) {
        double largest = 0;
        pushed.clear();
        for (int i = 0; i < count; i++)
            if (own[i] > 0) {
                largest = max(largest, update(i));
                if (inPart[i].push != 0)
                    pushed.push_back(i);
            }
        if (largest == 0 || (converged && largest <= 1))
            break;
        converged = false;
        for (int i = 0; i < SWEEPS_OF_PUSHED && !converged && ++sweeps < MOST_SWEEPS; i++) {
            const double before = largest;
            largest = 0;
            for (size_t k = 0; k < pushed.size(); k++)
                largest = max(largest, update(pushed[sweeps%2 == 0 ? k : pushed.size()-1-k]));
            // All that is left to change, if each sweep changes as much less than the one before.
            const double rate = min(largest/before, LARGEST_RATE);
            converged = largest*rate <= 1-rate;
        }
    }
    for (int i = 0; i < count; i++)
        pushes[(size_t) i*parts+part] = inPart[i].push;
}

/** Find the forces of all gaps from their starts, and their ends without forces. */
void ReflectedGaps::findPushes() {
    const int count = gaps.size(), none = ports.size();
    inPart.resize(count);
    forces.assign(count, 0.0);
    for (int i = 0; i < count; i++) {
        GapInPart& gap = inPart[i];
        predicted[i] = gaps[i].start;
        gap.isReflected = gaps[i].law == GapLaw::Reflection;
        gap.ofChains = ofChains[i];
        gap.response = own[i];
        gap.tolerance = OF_SWEEPS*scaleOf(i)+0.1*LEAST_CHANGE_OF_GAPS;
        for (int side = 0; side < 2; side++)
            gap.ports[side] = portOf[2*i+side] >= 0 ? portOf[2*i+side] : none;
    }
    for (int part = 0; part < parts; part++) {
        for (int i = 0; i < count; i++) {
            GapInPart& gap = inPart[i];
            gap.start = predicted[i];
            gap.end = gap.start+(free[i]-gaps[i].start)/parts+bridges[(size_t) i*parts+part];
            gap.variate = kT/parts*reflections[(size_t) i*parts+part];
        }
        findPushesOfPart(part);
        for (int i = 0; i < count; i++) {
            const GapInPart& gap = inPart[i];
            forces[i] += gap.push;
            predicted[i] = gap.end+motions[gap.ports[0]].all+motions[gap.ports[1]].all;
            if (gap.isReflected && part < parts-1)
                predicted[i] = max(predicted[i], 0.0);
        }
    }
}

void ReflectedGaps::push(const vector<PackStep*>& packs, CoupledEquations& coupled,
        const CoupledEquations::Demands& demands, const Loop& loop) {
    const size_t count = gaps.size();
    if (count == 0)
        return;
    free.resize(count);
    predicted.resize(count);
    const bool same = hasSamePorts();
    if (!same)
        findPorts();
    // Where no gap is left, all responses are zero.
    if (!same || find(known.begin(), known.end(), 0) != known.end()) {
        findResponses(packs, coupled, demands.single, loop);
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
            sum += dot(gaps[i].levers[lever].gradient, &moves[3*(equationOf[i]+lever)]);
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
    changes.resize(count, 0.0);
    motions.assign(ports.size()+1, MotionOfPort());
    for (size_t i = 0; i < count; i++)
        if (forces[i] != 0)
            move(i, forces[i], false);
    for (size_t i = 0; i < count; i++) {
        const double pushed = endMove(i, coupled.getPushedMoves());
        predicted[i] = free[i]-corrections[i]+pushed;
        // Responses may be those of an iteration before, and others push through links.
        const double correction = pushed-motions[inPart[i].ports[0]].all-motions[inPart[i].ports[1]].all;
        const double change = correction-corrections[i];
        const bool isBack = coupled.joinsPlaces() && change*changes[i] < 0;
        corrections[i] += isBack ? DAMPING_OF_GAPS*change : change;
        changes[i] = change;
    }
}

/** Whether a gap that no iteration knows of yet may be pushed. */
bool ReflectedGaps::wouldPush(const Gap& gap) const {
    if (gap.law != GapLaw::Reflection)
        return gap.law == GapLaw::Spring || gap.end < 0;
    return gap.end < 0 || gap.start*gap.end < LARGE_REFLECTION*kT*gap.response;
}

bool ReflectedGaps::isUnfinished(int i) const {
    return deviates(i, OF_ITERATIONS);
}

/** Whether a gap is farther from where the equations have led it than a share of its thermal scale. */
bool ReflectedGaps::deviates(int i, double share) const {
    if (!gaps[i].present)
        return false;
    if (i >= (int) predicted.size())
        return wouldPush(gaps[i]);
    return !(max(fabs(gaps[i].end-predicted[i]), fabs(changes[i])) <= share*scaleOf(i)+LEAST_CHANGE_OF_GAPS);
}

bool ReflectedGaps::anyUnfinished() {
    bool any = false;
    for (size_t i = 0; i < gaps.size(); i++) {
        if (!isUnfinished(i))
            continue;
        any = true;
        // Its chains may have turned so far that their responses have changed.
        for (int side = 0; side < 2 && i < predicted.size() && deviates(i, OF_RESPONSES); side++)
            if (portOf[2*i+side] >= 0)
                known[chainOf[portOf[2*i+side]]] = 0;
    }
    return any;
}

/**
 * Whether a gap that is held behind a ceiling is pulled back by much more than it would come out: where its contact has
 * gone on to another gap, which is pushed out, both turn their chains against each other.
 */
bool ReflectedGaps::isTorn(int i) const {
    const Gap& gap = gaps[i];
    if (gap.law != GapLaw::Spring || !(gap.ceiling < HUGE_VAL) || !(getForce(i) < 0))
        return false;
    return -forces[i]*own[i] > LARGEST_PULL*(fabs(free[i]-gap.ceiling)+sqrt(kT*own[i]));
}

void ReflectedGaps::findFailures(vector<bool>& failed) const {
    for (size_t i = 0; i < gaps.size(); i++)
        for (int side = 0; side < 2 && (isUnfinished(i) || isTorn(i)); side++)
            if (gaps[i].packOf(side) >= 0)
                failed[gaps[i].chainOf(side)] = true;
}
