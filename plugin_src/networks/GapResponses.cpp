#include "networks/GapResponses.h"
#include "dynamics/TermBlocks.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>
#include <utility>

using namespace cylchain;
using namespace std;

namespace {

/** What links between the two chains of a gap leave of its response at least. */
const double LEAST_SHARE_OF_LINKS = 0.02;
/** Pivots below this, over the diagonal, are those of ports that move as others do. */
const double LEAST_PIVOT = 1e-6;
/** Pivots that are as much below zero, over the diagonal, are of responses that do not go together. */
const double LARGEST_CONTRADICTION = 1e-3;
/** Rows are longer than needed by this share, so that most gaps that are added find room. */
const double ROOM_OF_ROWS = 0.25;
/** Ports of a chain whose responses are found together: a chain that is alone in its pack does so in lanes. */
const int PORTS_TOGETHER = 8;
/** Gaps that a thread looks at together. */
const int CHUNK_OF_PORTS = 256;

} // namespace

/** Make rows long enough for all ports, and have one for each coordinate of each link. */
void GapResponses::ChainPorts::grow(int newLinks) {
    const int before = stride;
    if (count() > stride)
        stride = count()+(int) ceil(ROOM_OF_ROWS*count());
    auto growRows = [&] (vector<double>& matrix, int rows, int knownRows) {
        if (stride == before && matrix.size() >= (size_t) rows*stride)
            return;
        vector<double> grown((size_t) rows*stride);
        for (int row = 0; row < knownRows; row++)
            copy_n(&matrix[(size_t) row*before], known, &grown[(size_t) row*stride]);
        matrix.swap(grown);
    };
    growRows(responses, stride, known);
    growRows(roots, stride, known);
    growRows(movesOfLinks, 3*newLinks, known > 0 ? 3*newLinks : 0);
    links = newLinks;
}

/**
 * Find the rows of the Cholesky factor from the number of those that are known on; false if responses that have been
 * found in different iterations are no positive matrix together, with which pushes would not converge.
 */
bool GapResponses::ChainPorts::findRoot() {
    for (int row = known; row < count(); row++) {
        const double* const matrix = &responses[(size_t) row*stride];
        double* const root = &roots[(size_t) row*stride];
        for (int column = 0; column <= row; column++) {
            const double* const other = &roots[(size_t) column*stride];
            double sum = matrix[column];
            for (int k = 0; k < column; k++)
                sum -= root[k]*other[k];
            if (column < row)
                root[column] = other[column] > 0 ? sum/other[column] : 0;
            else if (known > 0 && sum < -LARGEST_CONTRADICTION*matrix[row])
                return false;
            else
                root[row] = sum > LEAST_PIVOT*matrix[row] ? sqrt(sum) : 0;
        }
    }
    return true;
}

void GapResponses::begin(int numChains) {
    for (int chain : used) {
        chains[chain].ports.clear();
        chains[chain].known = 0;
    }
    chains.resize(numChains);
    used.clear();
    places.clear();
    numPorts = 0;
}

void GapResponses::setLinks(const vector<CouplingEquation>& equations) {
    links.setEquations(equations, chains.size());
    for (int chain : used) {
        const int count = links.end(chain)-links.begin(chain);
        if (exchange(chains[chain].links, count) != count)
            chains[chain].known = 0;
    }
}

void GapResponses::addPorts(const vector<Gap>& gaps) {
    const int numBefore = places.size()/2, count = gaps.size();
    if (numBefore == count)
        return;
    places.resize(2*(size_t) count);
    for (int i = numBefore; i < count; i++)
        for (int side = 0; side < 2; side++) {
            if (gaps[i].packOf(side) < 0)
                continue;
            const int chain = gaps[i].chainOf(side);
            ChainPorts& own = chains[chain];
            if (own.count() == 0)
                used.push_back(chain);
            places[2*i+side].chain = chain;
            places[2*i+side].port = own.count();
            own.ports.push_back({i, side});
        }
    sort(used.begin(), used.end());
    numPorts = 0;
    for (int chain : used) {
        chains[chain].first = numPorts;
        numPorts += chains[chain].count();
    }
}

bool GapResponses::isComplete() const {
    return all_of(used.begin(), used.end(), [&] (int chain) {
        return isComplete(chain);
    });
}

void GapResponses::forget(int gap) {
    for (int side = 0; side < 2; side++)
        if (places[2*gap+side].chain >= 0)
            chains[places[2*gap+side].chain].known = 0;
}

void GapResponses::find(const vector<Gap>& gaps, const vector<size_t>& firstEquations, const vector<PackStep*>& packs,
        CoupledEquations& coupled, Precision precision, bool single, const Loop& loop) {
    links.find(packs, coupled, precision, loop);
    vector<vector<int> > chainsOfPack(packs.size());
    for (int chain : used) {
        chains[chain].isNew = !isComplete(chain);
        if (chains[chain].isNew) {
            const Port& port = chains[chain].ports[0];
            chainsOfPack[gaps[port.gap].packOf(port.side)].push_back(chain);
        }
    }
    loop(packs.size(), [&] (int pack) {
        while (!chainsOfPack[pack].empty())
            if (single)
                findOfPack<float>(gaps, firstEquations, *packs[pack], pack, chainsOfPack[pack], coupled);
            else
                findOfPack<double>(gaps, firstEquations, *packs[pack], pack, chainsOfPack[pack], coupled);
    });
    findOwn(loop);
}

/** Find the responses of some chains, of which those are left that must be found once more. */
template <class Number> void GapResponses::findOfPack(const vector<Gap>& gaps, const vector<size_t>& firstEquations,
        PackStep& step, int pack, vector<int>& chainsOfPack, const CoupledEquations& coupled) {
    /** A term of a port, and the gradient there. */
    struct TermOfPort {
        int place;
        Number gradient[3];
    };
    constexpr int STRIDE = TermBlocks::SIZE;
    static thread_local vector<TermOfPort> terms;
    static thread_local vector<int> firstTerms, firstOfChain;
    static thread_local vector<Number> force, move;
    const size_t size = 3*(size_t) TermBlocks::fill(coupled.countTerms(pack));
    auto placeOf = [&] (size_t equation, int side) {
        return TermBlocks::place(coupled.getTerm(equation, side)-coupled.firstTerm(pack), 0);
    };
    force.assign(PORTS_TOGETHER*size, Number(0));
    move.resize(PORTS_TOGETHER*size);
    terms.clear();
    firstTerms.clear();
    firstOfChain.clear();
    int rounds = 0;
    for (int chain : chainsOfPack) {
        ChainPorts& own = chains[chain];
        own.grow(links.end(chain)-links.begin(chain));
        rounds = max(rounds, own.count()-own.known);
        firstOfChain.push_back(firstTerms.size());
        for (const Port& port : own.ports) {
            const Gap& gap = gaps[port.gap];
            const Number sign = port.side == 0 ? 1 : -1;
            firstTerms.push_back(terms.size());
            for (int lever = 0; lever < gap.numLevers; lever++) {
                const double* const gradient = gap.levers[lever].gradient;
                terms.push_back({placeOf(firstEquations[port.gap]+lever, port.side), {sign*(Number) gradient[0],
                        sign*(Number) gradient[1], sign*(Number) gradient[2]}});
            }
        }
    }
    firstTerms.push_back(terms.size());
    for (int firstRound = 0; firstRound < rounds; firstRound += PORTS_TOGETHER) {
        const int count = min(PORTS_TOGETHER, rounds-firstRound);
        auto forPortsOfRounds = [&] (auto function) {
            for (int i = 0; i < count; i++)
                for (size_t number = 0; number < chainsOfPack.size(); number++) {
                    ChainPorts& own = chains[chainsOfPack[number]];
                    const int port = own.known+firstRound+i;
                    if (port < own.count())
                        function(own, chainsOfPack[number], &firstTerms[firstOfChain[number]], port, i*size);
                }
        };
        auto setForces = [&] (Number scale) {
            forPortsOfRounds([&] (ChainPorts&, int, const int* first, int port, size_t begin) {
                for (int term = first[port]; term < first[port+1]; term++)
                    for (int k = 0; k < 3; k++)
                        force[begin+terms[term].place+STRIDE*k] = scale*terms[term].gradient[k];
            });
        };
        setForces(1);
        step.respondToEach(force.data(), move.data(), count, size);
        setForces(0);
        forPortsOfRounds([&] (ChainPorts& own, int chain, const int* first, int port, size_t begin) {
            double* const row = &own.responses[(size_t) port*own.stride];
            for (int other = 0; other <= port; other++) {
                Number sum = 0;
                for (int k = first[other]; k < first[other+1]; k++) {
                    const Number* const at = &move[begin+terms[k].place];
                    const Number* const gradient = terms[k].gradient;
                    sum += gradient[0]*at[0]+gradient[1]*at[STRIDE]+gradient[2]*at[2*STRIDE];
                }
                row[other] = sum;
            }
            double* to = &own.movesOfLinks[port];
            for (const LinkYielding::Side* side = links.begin(chain); side != links.end(chain); side++) {
                const Number* const at = &move[begin+placeOf(links.getLinks()[side->link].equation, side->side)];
                for (int k = 0; k < 3; k++, to += own.stride)
                    *to = at[STRIDE*k];
            }
        });
    }
    for (int chain : chainsOfPack) {
        ChainPorts& own = chains[chain];
        yield(chain);
        for (int row = own.known; row < own.count(); row++)
            for (int column = 0; column < row; column++)
                own.responses[(size_t) column*own.stride+row] = own.responses[(size_t) row*own.stride+column];
        own.known = own.findRoot() ? own.count() : 0;
    }
    chainsOfPack.erase(remove_if(chainsOfPack.begin(), chainsOfPack.end(), [&] (int chain) {
        return chains[chain].known > 0;
    }), chainsOfPack.end());
}

/** Add to the responses of a chain that have just been found what the yielding of its links does. */
void GapResponses::yield(int chain) {
    ChainPorts& own = chains[chain];
    auto movesOf = [&] (int link) {
        return &own.movesOfLinks[3*(size_t) link*own.stride];
    };
    for (int port = own.known; port < own.count(); port++) {
        double* const row = &own.responses[(size_t) port*own.stride];
        for (int number = 0; number < own.links; number++) {
            const LinkYielding::Side& side = links.begin(chain)[number];
            const LinkYielding::Link& link = links.getLinks()[side.link];
            auto moveOf = [&] (int link, int coordinate) {
                return movesOf(link)[(size_t) coordinate*own.stride+port];
            };
            double pull[3];
            for (int k = 0; k < 3; k++) {
                const double* const m = link.ofPlace[side.side]+k;
                pull[k] = m[0]*moveOf(number, 0)+m[3]*moveOf(number, 1)+m[6]*moveOf(number, 2);
            }
            if (link.chains[0] == link.chains[1]) {
                // What moves the other place pulls at this one.
                const int other = links.getNumber(side.link, 1-side.side);
                for (int k = 0; k < 3; k++)
                    for (int j = 0; j < 3; j++)
                        pull[k] += link.between[side.side == 0 ? 3*k+j : 3*j+k]*moveOf(other, j);
            }
            const double *const x = movesOf(number), *const y = x+own.stride, *const z = y+own.stride;
            for (int other = 0; other <= port; other++)
                row[other] += pull[0]*x[other]+pull[1]*y[other]+pull[2]*z[other];
        }
    }
}

/** How much farther a force moves a gap because links join its two chains. */
double GapResponses::yieldOf(int gap) const {
    const PlaceOfPort &one = places[2*gap], &other = places[2*gap+1];
    if (one.chain < 0 || other.chain < 0 || one.chain == other.chain)
        return 0;
    auto moveOf = [&] (const PlaceOfPort& place, int link, int coordinate) {
        const ChainPorts& ports = chains[place.chain];
        return ports.movesOfLinks[(3*(size_t) link+coordinate)*ports.stride+place.port];
    };
    double sum = 0;
    for (int number = 0; number < chains[one.chain].links; number++) {
        const LinkYielding::Side& side = links.begin(one.chain)[number];
        const LinkYielding::Link& link = links.getLinks()[side.link];
        if (link.chains[1-side.side] != other.chain)
            continue;
        const int partner = links.getNumber(side.link, 1-side.side);
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < 3; j++)
                sum += 2*link.between[side.side == 0 ? 3*k+j : 3*j+k]*moveOf(one, number, k)*moveOf(other, partner, j);
    }
    return sum;
}

/** Find how far forces on gaps move these. */
void GapResponses::findOwn(const Loop& loop) {
    const size_t count = places.size()/2;
    own.resize(count);
    ofChains.resize(count);
    runInChunks(loop, count, CHUNK_OF_PORTS, [&] (int i) {
        ofChains[i] = 0;
        forPorts(i, [&] (const ChainPorts& ports, int port) {
            ofChains[i] += ports.responsesOf(port)[port];
        });
        const PlaceOfPort &one = places[2*i], &other = places[2*i+1];
        if (one.chain >= 0 && one.chain == other.chain)
            ofChains[i] += 2*chains[one.chain].responsesOf(one.port)[other.port];
        own[i] = max(ofChains[i]+yieldOf(i), LEAST_SHARE_OF_LINKS*ofChains[i]);
    });
}
