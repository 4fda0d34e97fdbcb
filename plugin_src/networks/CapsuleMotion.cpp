#include "networks/CapsuleMotion.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** Capsules that a thread follows together. */
const int CHUNK_OF_MOTIONS = 128;

} // namespace

void CapsuleMotion::Largest::include(double motion) {
    second = max(second, min(first, motion));
    first = max(first, motion);
}

void CapsuleMotion::takeNoteOf(int number, const double* moved) {
    const Capsule& capsule = (*capsules)[number];
    copy_n(moved+3*capsule.first, 3, &searched[6*number]);
    copy_n(moved+3*capsule.end(), 3, &searched[6*number+3]);
}

void CapsuleMotion::begin(const vector<Capsule>& newCapsules, const double* moved, const Loop& loop) {
    capsules = &newCapsules;
    searched.resize(6*capsules->size());
    before.resize(6*capsules->size());
    runInChunks(loop, capsules->size(), CHUNK_OF_MOTIONS, [&] (int i) {
        takeNoteOf(i, moved);
        copy_n(&searched[6*i], 6, &before[6*i]);
    });
    travelled.assign(capsules->size(), 0.0);
    motion.assign(capsules->size(), 0.0);
}

void CapsuleMotion::beginAgain(const double* moved, const Loop& loop) {
    runInChunks(loop, capsules->size(), CHUNK_OF_MOTIONS, [&] (int i) {
        takeNoteOf(i, moved);
        motion[i] = 0;
    });
}

void CapsuleMotion::beginAgain(const vector<int>& numbers, const double* moved) {
    for (int number : numbers) {
        takeNoteOf(number, moved);
        motion[number] = 0;
    }
}

/** Find how far a capsule has moved. */
double CapsuleMotion::followOne(int number, const double* moved) {
    const Capsule& capsule = (*capsules)[number];
    double inAll = 0, lately = 0;
    for (int end = 0; end < 2; end++) {
        const double* now = moved+3*(end == 0 ? capsule.first : capsule.end());
        const double* const then = &searched[6*number+3*end];
        double* const last = &before[6*number+3*end];
        double squares[2] = {};
        for (int k = 0; k < 3; k++) {
            squares[0] += (now[k]-then[k])*(now[k]-then[k]);
            squares[1] += (now[k]-last[k])*(now[k]-last[k]);
            last[k] = now[k];
        }
        inAll = max(inAll, squares[0]);
        lately = max(lately, squares[1]);
    }
    travelled[number] += sqrt(lately);
    return motion[number] = sqrt(inAll);
}

void CapsuleMotion::follow(const function<bool(int)>& takesPart, const double* moved, double reach, const Loop& loop,
        const function<void(const vector<int>&)>& use) {
    const int count = capsules->size(), chunks = (count+CHUNK_OF_MOTIONS-1)/CHUNK_OF_MOTIONS;
    parts.resize(chunks);
    loop(chunks, [&] (int chunk) {
        Largest& part = parts[chunk];
        part.first = part.second = 0;
        part.movers.clear();
        part.taken.clear();
        for (int i = chunk*CHUNK_OF_MOTIONS; i < min(count, (chunk+1)*CHUNK_OF_MOTIONS); i++) {
            if (takesPart(i)) {
                part.taken.push_back(i);
                if (2*followOne(i, moved) > reach)
                    part.movers.push_back(i);
            }
            part.include(motion[i]);
        }
        use(part.taken);
    });
    Largest all;
    movers.clear();
    for (const Largest& part : parts) {
        all.include(part.first);
        all.include(part.second);
        movers.insert(movers.end(), part.movers.begin(), part.movers.end());
    }
    exceeds = all.first+all.second > reach;
}

int cylchain::findFastest(const vector<Capsule>& capsules, const double* begun, const double* moved) {
    auto motionOf = [&] (const Capsule& capsule) {
        double square = 0;
        for (int k = 3*capsule.first; k < 3*capsule.first+3; k++)
            square += (moved[k]-begun[k])*(moved[k]-begun[k]);
        return square;
    };
    return max_element(capsules.begin(), capsules.end(), [&] (const Capsule& one, const Capsule& other) {
        return motionOf(one) < motionOf(other);
    })-capsules.begin();
}
