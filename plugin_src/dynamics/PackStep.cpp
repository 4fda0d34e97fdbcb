#include "dynamics/PackStep.h"
#include <algorithm>
#include <vector>

using namespace cylchain;
using namespace std;

void PackStep::respond(const float* forces, int numTerms, float* moves) {
    thread_local vector<double> given, found;
    given.assign(forces, forces+3*numTerms);
    found.resize(given.size());
    respond(given.data(), found.data());
    copy(found.begin(), found.end(), moves);
}
