#include "dynamics/CoupledEquations.h"
#include <algorithm>
#include <cstddef>
#include <numeric>

using namespace cylchain;
using namespace std;

namespace {

/** What conjugate gradients leave of the energy of the error that they begin with. */
const double RELATIVE_TOLERANCE = 0.05;
/** The energy of an error that is left anyway, for each pack, in units of k_B T. */
const double LEAST_ENERGY = 1e-2;
const int LARGEST_NUMBER_OF_ITERATIONS = 1000;

/** Add the product of a symmetric matrix and a vector, times a factor. */
inline void addProduct(const double* k, const double* v, double factor, double* result) {
    result[0] += factor*(k[0]*v[0]+k[1]*v[1]+k[2]*v[2]);
    result[1] += factor*(k[1]*v[0]+k[3]*v[1]+k[4]*v[2]);
    result[2] += factor*(k[2]*v[0]+k[4]*v[1]+k[5]*v[2]);
}

} // namespace

void CoupledEquations::gatherTerms(const vector<CouplingEquation>& equations, int numPacks) {
    // Sort the places by packs and nodes, by counting.

    firstOfPack.assign(numPacks+1, 0);
    auto forPlaces = [&] (auto function) {
        for (size_t i = 0; i < equations.size(); i++)
            for (int side = 0; side < 2; side++)
                if (equations[i].places[side].pack >= 0)
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
    sums.assign(numPacks, 0.0);
    for (vector<double>* values : {&change, &residual, &response, &force, &direction, &nextDirection, &found})
        values->assign(3*count, 0.0);
    termOf.assign(2*equations.size(), -1);
    forPlaces([&] (const PlaceOnChain& place, size_t i, int side) {
        const int number = firstOfNode[firstOfPack[place.pack]+place.node]++;
        termOf[2*i+side] = number;
        CouplingTerm& term = terms[number];
        term.node = place.node;
        term.lane = place.lane;
        term.fraction = place.fraction;
        for (int k = 0; k < 3; k++)
            term.force[k] = side == 0 ? equations[i].force[k] : -equations[i].force[k];
        copy(equations[i].stiffness, equations[i].stiffness+6, term.stiffness);
    });
    forPlaces([&] (const PlaceOnChain& place, size_t i, int side) {
        partners[termOf[2*i+side]] = termOf[2*i+1-side];
        if (termOf[2*i+1-side] >= 0)
            coupled[place.pack] = 1;
    });
}

double CoupledEquations::total() const {
    double sum = 0;
    for (double ofPack : sums)
        sum += ofPack;
    return sum;
}

void CoupledEquations::solve(const vector<PackStep*>& packs, const vector<CouplingEquation>& equations, double kT,
            const Loop& loop) {
    const int numPacks = packs.size();
    gatherTerms(equations, numPacks);
    loop(numPacks, [&] (int pack) {
        const int first = firstTerms[pack];
        packs[pack]->eliminate(terms.data()+first, firstTerms[pack+1]-first, change.data()+3*first);
    });
    auto forCoupled = [&] (auto function) {
        loop(numPacks, [&] (int pack) {
            if (coupled[pack])
                function(pack, firstTerms[pack], firstTerms[pack+1]);
        });
    };
    // Of the matrix, X joins places of different terms: its product with a vector is that of K with the partner's.
    auto respond = [&] (int pack, int first, int last) {
        packs[pack]->respond(residual.data()+3*first, response.data()+3*first);
        sums[pack] = inner_product(residual.begin()+3*first, residual.begin()+3*last, response.begin()+3*first, 0.0);
    };
    forCoupled([&] (int pack, int first, int last) {
        for (int i = first; i < last; i++)
            if (partners[i] >= 0)
                addProduct(terms[i].stiffness, &change[3*partners[i]], 1, &residual[3*i]);
        respond(pack, first, last);
    });
    iterations = 1;
    double energy = total(), ratio = 0;
    const double least = max(RELATIVE_TOLERANCE*energy, LEAST_ENERGY*kT*numPacks);
    while (energy > least && iterations < LARGEST_NUMBER_OF_ITERATIONS) {
        forCoupled([&] (int pack, int first, int last) {
            double sum = 0;
            for (int i = first; i < last; i++) {
                double image[3];
                for (int k = 0; k < 3; k++) {
                    force[3*i+k] = residual[3*i+k]+ratio*force[3*i+k];
                    nextDirection[3*i+k] = response[3*i+k]+ratio*direction[3*i+k];
                    image[k] = force[3*i+k];
                }
                if (partners[i] >= 0) {
                    double ofPartner[3];
                    for (int k = 0; k < 3; k++)
                        ofPartner[k] = response[3*partners[i]+k]+ratio*direction[3*partners[i]+k];
                    addProduct(terms[i].stiffness, ofPartner, -1, image);
                }
                for (int k = 0; k < 3; k++)
                    sum += nextDirection[3*i+k]*image[k];
            }
            sums[pack] = sum;
        });
        const double length = energy/total();
        direction.swap(nextDirection);
        forCoupled([&] (int pack, int first, int last) {
            for (int i = 3*first; i < 3*last; i++) {
                found[i] += length*force[i];
                change[i] += length*direction[i];
                residual[i] -= length*force[i];
            }
            for (int i = first; i < last; i++)
                if (partners[i] >= 0)
                    addProduct(terms[i].stiffness, &direction[3*partners[i]], length, &residual[3*i]);
            respond(pack, first, last);
        });
        iterations++;
        const double before = energy;
        energy = total();
        ratio = energy/before;
    }
    moves.assign(3*equations.size(), 0.0);
    for (size_t i = 0; i < 2*equations.size(); i++)
        for (int k = 0; k < 3 && termOf[i] >= 0; k++)
            moves[3*(i/2)+k] += (i%2 == 0 ? 1 : -1)*change[3*termOf[i]+k];
}

void CoupledEquations::advance(const vector<PackStep*>& packs, double share, LaneFlags& unfinished,
            const Loop& loop) {
    loop(packs.size(), [&] (int pack) {
        packs[pack]->advance(found.data()+3*firstTerms[pack], share, unfinished[pack].get());
    });
}

void CoupledEquations::findCompliances(const vector<PackStep*>& packs, vector<double>& compliances,
            const Loop& loop) {
    compliancesOfTerms.resize(6*terms.size());
    loop(packs.size(), [&] (int pack) {
        if (firstTerms[pack] < firstTerms[pack+1])
            packs[pack]->findCompliances(compliancesOfTerms.data()+6*firstTerms[pack]);
    });
    compliances.assign(6*termOf.size(), 0.0);
    for (size_t i = 0; i < termOf.size(); i++)
        if (termOf[i] >= 0)
            copy_n(&compliancesOfTerms[6*termOf[i]], 6, &compliances[6*i]);
}
