#include "dynamics/CoupledEquations.h"
#include "dynamics/SymmetricMatrices.h"
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <numeric>
#include <type_traits>

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
const int LARGEST_NUMBER_OF_ITERATIONS = 1000;
/** Where energies grow by more, single precision has rounded away what matters: in stiff links of free particles. */
const double LARGEST_GROWTH = 1e6;
/** Equations that a thread looks at together. */
const int CHUNK_OF_EQUATIONS = 256;
/** What a term far from the processor's caches shows is asked for this many terms ahead. */
const int AHEAD = 16;

/** Vectors in registers: the fourth number is none of theirs. */
template <class Real> struct Four {
    typedef Real Type __attribute__((vector_size(4*sizeof(Real))));
    static Type load(const Real* values) {
        Type result;
        memcpy(&result, values, sizeof(result));
        return result;
    }
};

/** In lanes, as compilers may not add in another order. */
template <class Real> double sumOfProducts(const Real* a, const Real* b, int first, int last) {
    const int LANES = 8;
    double sums[LANES] = {};
    for (; first+LANES <= last; first += LANES)
        for (int lane = 0; lane < LANES; lane++)
            sums[lane] += (double) a[first+lane]*b[first+lane];
    for (int lane = 0; first < last; first++, lane++)
        sums[lane] += (double) a[first]*b[first];
    double sum = 0;
    for (double ofLane : sums)
        sum += ofLane;
    return sum;
}

inline void respondTo(PackStep& pack, const double* forces, int, double* moves) {
    pack.respond(forces, moves);
}

inline void respondTo(PackStep& pack, const float* forces, int numTerms, float* moves) {
    pack.respond(forces, numTerms, moves);
}

} // namespace

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
    firstOfNode.assign(firstOfPack[numPacks]+1, 0);
    forPlaces([&] (const PlaceOnChain& place, size_t, int) {
        firstOfNode[firstOfPack[place.pack]+place.node+1]++;
    });
    for (size_t i = 1; i < firstOfNode.size(); i++)
        firstOfNode[i] += firstOfNode[i-1];
    const size_t count = firstOfNode.back();
    firstTerms.resize(numPacks+1);
    for (int pack = 0; pack <= numPacks; pack++)
        firstTerms[pack] = firstOfNode[firstOfPack[pack]];
    terms.resize(count);
    partners.resize(count);
    coupled.assign(numPacks, 0);
    change.resize(3*count);
    found.resize(3*count);
    termOf.assign(2*equations.size(), -1);
    forPlaces([&] (const PlaceOnChain& place, size_t i, int side) {
        termOf[2*i+side] = firstOfNode[firstOfPack[place.pack]+place.node]++;
        if (termOf[2*i+1-side] >= 0)
            coupled[place.pack] = coupled[equations[i].places[1-side].pack] = 1;
    });
    activeOfTerms = active;
    sortedPlaces.resize(termOf.size());
    for (size_t number = 0; number < sortedPlaces.size(); number++) {
        const PlaceOnChain& place = equations[number/2].places[number%2];
        sortedPlaces[number] = {place.pack, place.node, place.lane};
    }
}

void CoupledEquations::gatherTerms(const vector<CouplingEquation>& equations, const PackFlags& active,
            const Loop& loop) {
    if (!hasSamePlaces(equations, active, loop))
        sortPlaces(equations, active);
    sums.assign(active.size(), 0.0);
    runInChunks(loop, termOf.size(), CHUNK_OF_EQUATIONS, [&] (int number) {
        if (termOf[number] < 0)
            return;
        const int i = number/2, side = number%2;
        const PlaceOnChain& place = equations[i].places[side];
        CouplingTerm& term = terms[termOf[number]];
        partners[termOf[number]] = termOf[2*i+1-side];
        term.node = place.node;
        term.lane = place.lane;
        term.fraction = place.fraction;
        for (int k = 0; k < 3; k++)
            term.force[k] = side == 0 ? equations[i].force[k] : -equations[i].force[k];
        copy(equations[i].stiffness, equations[i].stiffness+6, term.stiffness);
    });
}

double CoupledEquations::total() const {
    double sum = 0;
    for (double ofPack : sums)
        sum += ofPack;
    return sum;
}

bool CoupledEquations::solve(const vector<PackStep*>& packs, const PackFlags& active,
            const vector<CouplingEquation>& equations, double kT, const Demands& demands, const Loop& loop) {
    const int numPacks = packs.size();
    const bool stiff = demands.demandingStiffness > STIFF;
    const double tighter = min({demands.forTensions ? OF_TENSIONS : 1, stiff ? OF_STIFF/demands.demandingStiffness : 1,
            OF_STIFF/max(OF_STIFF, demands.stiffness)});
    gatherTerms(equations, active, loop);
    loop(numPacks, [&] (int pack) {
        const int first = firstTerms[pack], last = firstTerms[pack+1];
        fill(found.begin()+3*first, found.begin()+3*last, 0.0);
        if (active[pack])
            packs[pack]->eliminate(terms.data()+first, last-first, change.data()+3*first);
    });
    const double least = tighter*LEAST_ENERGY*kT*(stiff ? 1 : count(active.begin(), active.end(), 1));
    // What is stiff, or must be right in tensions, needs more digits.
    const bool trySingle = demands.single && !demands.forTensions && !stiff;
    const bool solved = trySingle && iterate(packs, single, tighter*demands.tolerance, least, loop);
    if (!solved)
        iterate(packs, twice, tighter*demands.tolerance, least, loop);
    moves.resize(3*equations.size());
    runInChunks(loop, equations.size(), CHUNK_OF_EQUATIONS, [&] (int i) {
        const int first = termOf[2*i], second = termOf[2*i+1];
        for (int k = 0; k < 3; k++)
            moves[3*i+k] = (first >= 0 ? change[3*first+k] : 0)-(second >= 0 ? change[3*second+k] : 0);
    });
    return solved || !trySingle;
}

/**
 * Conjugate gradients, until what is left of the energy is less than a part of it, or than some energy. Where numbers
 * in single precision do not get there, it returns false, and nothing is found.
 */
template <class Real> bool CoupledEquations::iterate(const vector<PackStep*>& packs, Vectors<Real>& vectors,
            double tolerance, double leastEnergy, const Loop& loop) {
    const size_t count = terms.size();
    for (vector<Real>* values :
            {&vectors.residual, &vectors.response, &vectors.force, &vectors.direction, &vectors.image, &vectors.found,
            &vectors.change})
        values->resize(3*count);
    vectors.exchanged.resize(count);
    vectors.stiffness.resize(count);
    Real *const residual = vectors.residual.data(), *const response = vectors.response.data();
    Real *const force = vectors.force.data(), *const direction = vectors.direction.data();
    Real *const image = vectors.image.data(), *const ownFound = vectors.found.data();
    Real* const ownChange = vectors.change.data();
    auto* const stiffness = vectors.stiffness.data();
    auto* const exchanged = vectors.exchanged.data();
    typedef typename Four<Real>::Type Vector;
    auto load = [] (const Real* values) {
        return Four<Real>::load(values);
    };
    auto forCoupled = [&] (auto function) {
        loop(packs.size(), [&] (int pack) {
            if (coupled[pack])
                function(pack, firstTerms[pack], firstTerms[pack+1]);
        });
    };
    // Of the matrix, X joins places of different terms: its product with a vector is that of K with the partner's.
    auto respond = [&] (int pack, int first, int last) {
        respondTo(*packs[pack], residual+3*first, last-first, response+3*first);
        sums[pack] = sumOfProducts(residual, response, 3*first, 3*last);
        for (int i = first; i < last; i++)
            for (int k = 0; k < 3; k++)
                exchanged[i].response[k] = response[3*i+k];
    };
    forCoupled([&] (int pack, int first, int last) {
        for (int i = first; i < last; i++) {
            double pull[3] = {};
            if (partners[i] >= 0)
                multiply(terms[i].stiffness, &change[3*partners[i]], pull);
            const double* const s = terms[i].stiffness;
            const double columns[3][4] = {{s[0], s[1], s[2], 0}, {s[1], s[3], s[4], 0}, {s[2], s[4], s[5], 0}};
            for (int column = 0; column < 3; column++)
                for (int k = 0; k < 4; k++)
                    stiffness[i].of[column][k] = columns[column][k];
            exchanged[i] = {};
            for (int k = 0; k < 3; k++) {
                residual[3*i+k] = pull[k];
                force[3*i+k] = direction[3*i+k] = ownFound[3*i+k] = ownChange[3*i+k] = 0;
            }
        }
        respond(pack, first, last);
    });
    iterations = 1;
    double energy = total();
    const double least = max(tolerance*energy, leastEnergy);
    const double largest = LARGEST_GROWTH*energy;
    Real ratio = 0;
    while (energy > least && iterations < LARGEST_NUMBER_OF_ITERATIONS) {
        forCoupled([&] (int pack, int first, int last) {
            for (int i = first; i < last; i++) {
                if (i+AHEAD < last && partners[i+AHEAD] >= 0)
                    __builtin_prefetch(&exchanged[partners[i+AHEAD]]);
                Vector pull = {};
                if (partners[i] >= 0) {
                    const auto& partner = exchanged[partners[i]];
                    const Vector ofPartner = load(partner.response)+load(partner.direction)*ratio;
                    const auto& columns = stiffness[i].of;
                    pull = load(columns[0])*ofPartner[0]+load(columns[1])*ofPartner[1]+load(columns[2])*ofPartner[2];
                }
                for (int k = 0; k < 3; k++)
                    image[3*i+k] = pull[k];
            }
            for (int j = 3*first; j < 3*last; j++) {
                force[j] = residual[j]+ratio*force[j];
                direction[j] = response[j]+ratio*direction[j];
                image[j] = force[j]-image[j];
            }
            sums[pack] = sumOfProducts(direction, image, 3*first, 3*last);
        });
        const Real step = energy/total();
        forCoupled([&] (int pack, int first, int last) {
            for (int j = 3*first; j < 3*last; j++) {
                ownFound[j] += step*force[j];
                ownChange[j] += step*direction[j];
                residual[j] -= step*image[j];
            }
            for (int i = first; i < last; i++)
                for (int k = 0; k < 3; k++)
                    exchanged[i].direction[k] = direction[3*i+k];
            respond(pack, first, last);
        });
        iterations++;
        const double before = energy;
        energy = total();
        ratio = energy/before;
        // Written so that NaN is too large.
        if (is_same<Real, float>::value && !(energy >= -least && energy < largest))
            return false;
    }
    if (is_same<Real, float>::value && energy > least)
        return false;
    forCoupled([&] (int, int first, int last) {
        for (int j = 3*first; j < 3*last; j++) {
            found[j] = ownFound[j];
            change[j] += ownChange[j];
        }
    });
    return true;
}

void CoupledEquations::advance(const vector<PackStep*>& packs, const PackFlags& active, double share,
            LaneFlags& unfinished, const Loop& loop) {
    loop(packs.size(), [&] (int pack) {
        if (active[pack])
            packs[pack]->advance(found.data()+3*firstTerms[pack], share, unfinished[pack].get());
    });
}

void CoupledEquations::findCompliancesOfTerms(const vector<PackStep*>& packs, const Loop& loop) {
    compliancesOfTerms.resize(6*terms.size());
    loop(packs.size(), [&] (int pack) {
        if (firstTerms[pack] < firstTerms[pack+1])
            packs[pack]->findCompliances(compliancesOfTerms.data()+6*firstTerms[pack]);
    });
}

void CoupledEquations::findJointStiffness(const vector<PackStep*>& packs, const Loop& loop) {
    auto needsIt = [&] (int pack) {
        return firstTerms[pack] < firstTerms[pack+1] && packs[pack]->needsJointStiffness();
    };
    bool any = false;
    for (size_t pack = 0; pack < packs.size(); pack++)
        any |= needsIt(pack);
    if (!any)
        return;
    findCompliancesOfTerms(packs, loop);
    jointStiffness.resize(6*terms.size());
    loop(packs.size(), [&] (int pack) {
        if (!needsIt(pack))
            return;
        for (int i = firstTerms[pack]; i < firstTerms[pack+1]; i++) {
            double* const result = &jointStiffness[6*i];
            copy_n(terms[i].stiffness, 6, result);
            if (partners[i] < 0)
                continue;
            // Column by column: K e, C K e, K C K e.
            int entry = 0;
            double columns[3][3] = {};
            for (int column = 0; column < 3; column++) {
                double unit[3] = {}, pull[3] = {}, move[3] = {};
                unit[column] = 1;
                multiply(terms[i].stiffness, unit, pull);
                multiply(&compliancesOfTerms[6*partners[i]], pull, move);
                multiply(terms[i].stiffness, move, columns[column]);
            }
            for (int row = 0; row < 3; row++)
                for (int column = row; column < 3; column++)
                    result[entry++] -= 0.5*(columns[column][row]+columns[row][column]);
        }
        packs[pack]->setJointStiffness(&jointStiffness[6*firstTerms[pack]]);
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
