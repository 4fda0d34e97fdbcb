#include "networks/CoupledEquations.h"
#include "dynamics/TermBlocks.h"
#include "mechanics/Prefetch.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <utility>

using namespace cylchain;
using namespace std;

namespace {

/**
 * The energy of an error that conjugate gradients leave anyway, for each pack, in units of k_B T. It is that of the
 * residual in A, where each place is held by the coupling alone. Where both places of one move as one, nothing but
 * friction holds them, and the same residual has as many times this energy as the coupling is stiffer. So the
 * tolerances are divided by that, but for a factor OF_STIFF: without it, free joints of stiff links straighten, and
 * with no such factor, some steps of welded beams are divided.
 */
const double LEAST_ENERGY = 5e-2;
/**
 * The tolerances over these where tensions of segments are wanted that are right. These energies are those of forces
 * in P, which is stiff where two places move as one: that of their motion in A is larger by the stiffness of the
 * coupling over that of the chains.
 */
const double OF_TENSIONS = 2e-4;
/**
 * The same where couplings that need it are stiffer than this, times their stiffness. What is left of the motion of
 * both places as one makes Newton's method go back and forth otherwise, and bends 2 to 3 % too large in second order.
 * The least energy is that of all packs then, because a single coupling may have it.
 */
const double STIFF = 2e3, OF_STIFF = 10;
/** Equations that a thread looks at together. */
const int CHUNK_OF_EQUATIONS = 256;

} // namespace

/** Whether an equation holds its places. */
template <class Equation> static bool isStiff(const Equation& equation) {
    return equation.stiffness[0] != 0 || equation.stiffness[3] != 0 || equation.stiffness[5] != 0;
}

/** Whether the terms of the last iteration had the same places but for their fractions. */
bool CoupledEquations::hasSamePlaces(const vector<CouplingEquation>& equations, const PackFlags& active,
            const Loop& loop) {
    if (2*equations.size() != sortedPlaces.size() || active != activeOfTerms)
        return false;
    atomic<bool> same(true);
    runInChunks(loop, sortedPlaces.size(), CHUNK_OF_EQUATIONS, [&] (int number) {
        if (!same.load(memory_order_relaxed))
            return;
        const PlaceOnChain& place = equations[number/2].places[number%2];
        const SortedPlace& sorted = sortedPlaces[number];
        if (place.pack != sorted.pack || (place.pack >= 0 && (place.node != sorted.node || place.lane != sorted.lane)))
            same.store(false, memory_order_relaxed);
    });
    return same;
}

/** Sort the places by packs and nodes, by counting. */
void CoupledEquations::sortPlaces(const vector<CouplingEquation>& equations, const PackFlags& active) {
    const int numPacks = active.size();
    firstOfPack.assign(numPacks+1, 0);
    auto forPlaces = [&] (auto function) {
        for (size_t i = 0; i < equations.size(); i++)
            for (int side = 0; side < 2; side++)
                if (equations[i].places[side].pack >= 0 && active[equations[i].places[side].pack])
                    function(equations[i].places[side], i, side);
    };
    forPlaces([&] (const PlaceOnChain& place, size_t, int) {
        firstOfPack[place.pack+1] = max(firstOfPack[place.pack+1], place.node+1);
    });
    for (int pack = 0; pack < numPacks; pack++)
        firstOfPack[pack+1] += firstOfPack[pack];
    firstOfNode.assign(firstOfPack[numPacks], 0);
    forPlaces([&] (const PlaceOnChain& place, size_t, int) {
        firstOfNode[firstOfPack[place.pack]+place.node]++;
    });
    gathered.first.resize(numPacks+1);
    gathered.count.resize(numPacks);
    gathered.first[0] = 0;
    for (int pack = 0; pack < numPacks; pack++) {
        int next = gathered.first[pack];
        for (int node = firstOfPack[pack]; node < firstOfPack[pack+1]; node++)
            next += exchange(firstOfNode[node], next);
        gathered.count[pack] = next-gathered.first[pack];
        gathered.first[pack+1] = gathered.first[pack]+TermBlocks::fill(gathered.count[pack]);
    }
    const size_t count = gathered.getNumTerms();
    gathered.terms.resize(count);
    gathered.partners.resize(count);
    gathered.coupled.assign(numPacks, 0);
    joins = false;
    change.resize(3*count);
    found.resize(3*count);
    termOf.assign(2*equations.size(), -1);
    forPlaces([&] (const PlaceOnChain& place, size_t i, int side) {
        termOf[2*i+side] = firstOfNode[firstOfPack[place.pack]+place.node]++;
        if (termOf[2*i+1-side] >= 0 && isStiff(equations[i]))
            gathered.coupled[place.pack] = gathered.coupled[equations[i].places[1-side].pack] = joins = true;
    });
    activeOfTerms = active;
    sortedPlaces.resize(termOf.size());
    for (size_t number = 0; number < sortedPlaces.size(); number++) {
        const PlaceOnChain& place = equations[number/2].places[number%2];
        sortedPlaces[number] = {place.pack, place.node, place.lane};
    }
}

bool CoupledEquations::gatherTerms(const vector<CouplingEquation>& equations, const PackFlags& active,
            const Loop& loop) {
    const bool areSame = hasSamePlaces(equations, active, loop);
    if (!areSame)
        sortPlaces(equations, active);
    runInChunks(loop, termOf.size(), CHUNK_OF_EQUATIONS, [&] (int number) {
        if (number+AHEAD < (int) termOf.size() && termOf[number+AHEAD] >= 0)
            prefetch(&gathered.terms[termOf[number+AHEAD]]);
        if (termOf[number] < 0)
            return;
        const int i = number/2, side = number%2;
        const PlaceOnChain& place = equations[i].places[side];
        CouplingTerm& term = gathered.terms[termOf[number]];
        gathered.partners[termOf[number]] = isStiff(equations[i]) ? termOf[2*i+1-side] : -1;
        term.node = place.node;
        term.lane = place.lane;
        term.fraction = place.fraction;
        term.hold = place.hold;
        for (int k = 0; k < 3; k++)
            term.force[k] = side == 0 ? equations[i].force[k] : -equations[i].force[k];
        copy(equations[i].stiffness, equations[i].stiffness+6, term.stiffness);
    });
    return areSame;
}

/** Tell packs that may move together the forces that the last iteration has found, or those of now. */
void CoupledEquations::tellForces(const vector<PackStep*>& packs, bool areSame) {
    const size_t size = 3*gathered.terms.size();
    const bool known = areSame && expected.size() == size;
    expected.resize(size);
    for (size_t pack = 0; pack < packs.size(); pack++) {
        if (!packs[pack]->mayMoveTogether())
            continue;
        for (int i = gathered.first[pack]; i < gathered.first[pack]+gathered.count[pack]; i++)
            if (!known || !isStiff(gathered.terms[i]))
                copy_n(gathered.terms[i].force, 3, &expected[3*i]);
        packs[pack]->setExpectedForces(expected.data()+3*gathered.first[pack]);
    }
}

/** Find the forces on places of packs that may move together, as they are after the last changes without turns. */
void CoupledEquations::noteForces() {
    for (size_t number = 0; number < termOf.size(); number++) {
        const int term = termOf[number];
        if (term < 0)
            continue;
        double pull[3];
        multiply(gathered.terms[term].stiffness, &moves[3*(number/2)], pull);
        for (int k = 0; k < 3; k++)
            expected[3*term+k] = gathered.terms[term].force[k]-(number%2 == 0 ? pull[k] : -pull[k]);
    }
}

/** Find the forces on places that make up for what joins them, where they move so without; false if single precision
 * was asked for, and did not do. */
bool CoupledEquations::findForces(const vector<PackStep*>& packs, const Demands& demands,
            const vector<double>& ofPlaces, vector<double>& forces, const Loop& loop) {
    // What is stiff, or must be right in tensions, needs more digits.
    const bool trySingle = demands.single && !demands.forTensions && !(demands.demandingStiffness > STIFF);
    auto solveIn = [&] (auto& gradients) {
        const bool solved = gradients.solve(packs, gathered, tighter*demands.tolerance, least, ofPlaces, forces, loop);
        iterations += gradients.getNumIterations();
        hasFound = gradients.hasFound();
        return solved;
    };
    const bool solved = trySingle && solveIn(single);
    if (!solved)
        solveIn(twice);
    return solved || !trySingle;
}

/** Add how forces on places move them. */
void CoupledEquations::addResponses(const vector<PackStep*>& packs, const vector<double>& forces,
            vector<double>& ofPlaces, const Loop& loop) const {
    loop(packs.size(), [&] (int pack) {
        if (gathered.count[pack] == 0)
            return;
        static thread_local vector<double> move;
        const int first = 3*gathered.first[pack], last = 3*gathered.first[pack+1];
        move.resize(last-first);
        packs[pack]->respond(forces.data()+first, move.data());
        for (int i = first; i < last; i++)
            ofPlaces[i] += move[i-first];
    });
}

/** Find how the first places of equations from a number on move against the second ones. */
void CoupledEquations::findMoves(size_t firstEquation, const vector<double>& ofPlaces, vector<double>& result,
            const Loop& loop) const {
    const int numEquations = termOf.size()/2-firstEquation;
    result.resize(3*(size_t) numEquations);
    runInChunks(loop, numEquations, CHUNK_OF_EQUATIONS, [&] (int i) {
        const int* const own = &termOf[2*(firstEquation+i)];
        for (int side = 0; side < 2 && i+AHEAD < numEquations; side++)
            if (const int ahead = own[2*AHEAD+side]; ahead >= 0)
                prefetch(&ofPlaces[TermBlocks::place(ahead, 1)]);
        const int first = own[0], second = own[1];
        for (int k = 0; k < 3; k++)
            result[3*i+k] = (first >= 0 ? ofPlaces[TermBlocks::place(first, k)] : 0)-
                    (second >= 0 ? ofPlaces[TermBlocks::place(second, k)] : 0);
    });
}

bool CoupledEquations::solve(const vector<PackStep*>& packs, const PackFlags& active,
            const vector<CouplingEquation>& equations, double kT, const Demands& demands, const Loop& loop) {
    const int numPacks = packs.size();
    const bool stiff = demands.demandingStiffness > STIFF;
    tighter = min({demands.forTensions ? OF_TENSIONS : 1, stiff ? OF_STIFF/demands.demandingStiffness : 1,
            OF_STIFF/max(OF_STIFF, demands.stiffness)});
    const bool areSame = gatherTerms(equations, active, loop);
    const bool mayMoveTogether = any_of(packs.begin(), packs.end(), [] (const PackStep* pack) {
        return pack->mayMoveTogether();
    });
    if (mayMoveTogether)
        tellForces(packs, areSame);
    else
        expected.clear();
    loop(numPacks, [&] (int pack) {
        if (pack+1 < numPacks && active[pack+1])
            packs[pack+1]->prefetchStart();
        const int first = gathered.first[pack];
        if (active[pack])
            packs[pack]->eliminate(gathered.terms.data()+first, gathered.count[pack], change.data()+3*first);
    });
    least = tighter*LEAST_ENERGY*kT*(stiff ? 1 : count(active.begin(), active.end(), 1));
    iterations = 0;
    return findForces(packs, demands, change, found, loop);
}

void CoupledEquations::predictMoves(const vector<PackStep*>& packs, size_t first, const Loop& loop) {
    if (!hasFound) {
        findMoves(first, change, moves, loop);
        return;
    }
    pushed = change;
    addResponses(packs, found, pushed, loop);
    findMoves(first, pushed, moves, loop);
}

void CoupledEquations::push(const vector<PackStep*>& packs, size_t firstEquation, const vector<double>& loads,
            const Demands& demands, const Loop& loop) {
    vector<double> ownForces(change.size(), 0.0);
    for (size_t i = firstEquation; 2*i < termOf.size(); i++)
        for (int side = 0; side < 2; side++)
            for (int k = 0; k < 3 && termOf[2*i+side] >= 0; k++)
                ownForces[TermBlocks::place(termOf[2*i+side], k)] = (side == 0 ? 1 : -1)*loads[3*(i-firstEquation)+k];
    pushed.assign(change.size(), 0.0);
    addResponses(packs, ownForces, pushed, loop);
    if (!exchange(hasFound, true))
        fill(found.begin(), found.end(), 0.0);
    if (joins) {
        foundByPush.resize(change.size());
        findForces(packs, demands, pushed, foundByPush, loop);
        if (hasFound) {
            addResponses(packs, foundByPush, pushed, loop);
            for (size_t i = 0; i < found.size(); i++)
                found[i] += foundByPush[i];
        }
        hasFound = true;
    }
    for (size_t i = 0; i < found.size(); i++)
        found[i] += ownForces[i];
}

array<double, 3> CoupledEquations::getPushedMove(size_t equation, int side) const {
    array<double, 3> result = {};
    const int term = termOf[2*equation+side];
    for (int k = 0; k < 3 && term >= 0; k++)
        result[k] = pushed[TermBlocks::place(term, k)];
    return result;
}

void CoupledEquations::advance(const vector<PackStep*>& packs, const PackFlags& active, const ShareOfChange& share,
            LaneFlags& unfinished, const Loop& loop) {
    loop(packs.size(), [&] (int pack) {
        if (pack+1 < (int) packs.size() && active[pack+1])
            packs[pack+1]->prefetchElimination();
        const int first = 3*gathered.first[pack];
        if (active[pack])
            packs[pack]->advance(hasFound ? found.data()+first : NULL, share, unfinished[pack].get(),
                    change.data()+first);
    });
    findMoves(0, change, moves, loop);
    if (!expected.empty())
        noteForces();
}

void CoupledEquations::findCompliancesOfTerms(const vector<PackStep*>& packs, const Loop& loop) {
    compliancesOfTerms.resize(6*gathered.terms.size());
    loop(packs.size(), [&] (int pack) {
        if (gathered.count[pack] > 0)
            packs[pack]->findCompliances(compliancesOfTerms.data()+6*gathered.first[pack]);
    });
}

void CoupledEquations::findJointStiffness(const vector<PackStep*>& packs, const Loop& loop) {
    auto needsIt = [&] (int pack) {
        return gathered.count[pack] > 0 && packs[pack]->needsJointStiffness();
    };
    bool any = false;
    for (size_t pack = 0; pack < packs.size(); pack++)
        any |= needsIt(pack);
    if (!any)
        return;
    findCompliancesOfTerms(packs, loop);
    jointStiffness.resize(6*gathered.terms.size());
    loop(packs.size(), [&] (int pack) {
        if (!needsIt(pack))
            return;
        const vector<int>& partners = gathered.partners;
        const int first = gathered.first[pack];
        for (int i = first; i < first+gathered.count[pack]; i++) {
            const double* const stiffness = gathered.terms[i].stiffness;
            double* const result = &jointStiffness[6*i];
            copy_n(stiffness, 6, result);
            if (partners[i] < 0)
                continue;
            // Column by column: K e, C K e, K C K e.
            int entry = 0;
            double columns[3][3] = {};
            for (int column = 0; column < 3; column++) {
                double unit[3] = {}, pull[3] = {}, move[3] = {};
                unit[column] = 1;
                multiply(stiffness, unit, pull);
                multiply(&compliancesOfTerms[6*partners[i]], pull, move);
                multiply(stiffness, move, columns[column]);
            }
            for (int row = 0; row < 3; row++)
                for (int column = row; column < 3; column++)
                    result[entry++] -= 0.5*(columns[column][row]+columns[row][column]);
        }
        packs[pack]->setJointStiffness(&jointStiffness[6*first]);
    });
}

void CoupledEquations::findCompliances(const vector<PackStep*>& packs, vector<double>& compliances,
            const Loop& loop) {
    findCompliancesOfTerms(packs, loop);
    compliances.assign(6*termOf.size(), 0.0);
    for (size_t i = 0; i < termOf.size(); i++)
        if (termOf[i] >= 0)
            copy_n(&compliancesOfTerms[6*termOf[i]], 6, &compliances[6*i]);
}
