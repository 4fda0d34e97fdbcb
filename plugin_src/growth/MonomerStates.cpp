#include "growth/MonomerStates.h"
#include <cmath>
#include <numeric>

using namespace cylchain;
using namespace std;

void MonomersOfChain::add(int end) {
    if (end == 1)
        monomers.push_back({});
    else
        monomers.push_front({});
}

void MonomersOfChain::remove(int end) {
    if (end == 1)
        monomers.pop_back();
    else
        monomers.pop_front();
}

int MonomersOfChain::revealAt(size_t number, double time, RandomNumbers& random) {
    MonomerState& own = monomers[number];
    while (true) {
        const vector<double>& rates = states[own.state].switchRates;
        const double total = accumulate(rates.begin(), rates.end(), 0.0);
        const double next = total > 0 ? own.time+random.exponential()/total : HUGE_VAL;
        if (!(next < time))
            break;
        own.time = next;
        double chosen = random.uniform()*total;
        for (size_t to = 0; to < rates.size(); to++)
            if (rates[to] > 0) {
                own.state = to;
                chosen -= rates[to];
                if (chosen < 0)
                    break;
            }
    }
    own.time = time;
    return own.state;
}
