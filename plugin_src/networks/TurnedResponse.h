#ifndef CYLCHAIN_TURNED_RESPONSE_H_
#define CYLCHAIN_TURNED_RESPONSE_H_

#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>

namespace cylchain {

/**
 * Find how a force along a coupling moves what it holds, if others hold that together with it. The compliance is small
 * along these others and large across, so that its product with the direction changes much as soon as that turns by
 * little. But couplings that share places turn together: what counts is where they are against each other, which the
 * first iteration knows. So its response turns with the direction. Taken with a direction that turns alone, it would
 * not let the iteration end.
 *
 * @param direction       m, of any size
 * @param first           t, that of the first iteration, a unit vector
 * @param firstResponse   w, to a unit force along t
 * @param[out] response   to a force m
 */
inline void turnResponse(const double* direction, const double* first, const double* firstResponse, double* response) {
    const double *m = direction, *t = first, *w = firstResponse;
    const double least = 1e-30, size = std::sqrt(dot(m, m)), perSize = 1/std::max(size, least);
    double axis[3];
    for (int k = 0; k < 3; k++)
        axis[k] = (t[(k+1)%3]*m[(k+2)%3]-t[(k+2)%3]*m[(k+1)%3])*perSize;
    const double cosine = dot(t, m)*perSize, along = dot(axis, w)/std::max(1+cosine, least);
    for (int k = 0; k < 3; k++)
        response[k] = size*(cosine*w[k]+axis[(k+1)%3]*w[(k+2)%3]-axis[(k+2)%3]*w[(k+1)%3]+along*axis[k]);
}

} // namespace cylchain

#endif /*CYLCHAIN_TURNED_RESPONSE_H_*/
