#include "lanes/CosineTables.h"
#include <cmath>
#include <complex>
#include <cstdint>
#include <map>
#include <mutex>

using namespace cylchain;
using namespace std;

typedef complex<double> Number;

/** exp(2 pi i numerator/denominator), from an angle that is as small as can be. */
static Number unitRoot(int64_t numerator, int64_t denominator) {
    numerator %= denominator;
    const int64_t quarters = (8*numerator+denominator)/(2*denominator);
    const double angle = M_PI*(4*numerator-quarters*denominator)/(2.0*denominator);
    const double c = cos(angle), s = sin(angle);
    switch (quarters%4) {
        case 0: return {c, s};
        case 1: return {-s, c};
        case 2: return {-c, -s};
        default: return {s, -c};
    }
}

template <class Scalar> static void append(vector<Scalar>& numbers, Number number) {
    numbers.push_back(number.real());
    numbers.push_back(number.imag());
}

static int largestPrimeFactor(int number) {
    int largest = 1;
    for (int factor = 2; number > 1; factor++)
        for (; number%factor == 0; number /= factor)
            largest = factor;
    return largest;
}

/**
 * Radices, odd ones first and large ones last: the last pass takes no twiddle factors. As many powers of two as
 * possible are taken in passes of eight, because passes are what moves data.
 */
static vector<int> radicesOf(int length) {
    vector<int> radices;
    int twos = 0;
    for (; length%2 == 0; length /= 2)
        twos++;
    for (int factor = 3; length > 1; factor += 2)
        for (; length%factor == 0; length /= factor)
            radices.insert(radices.begin(), factor);
    if (twos == 1)
        radices.push_back(2);
    const int fours = (twos == 1 ? 0 : (3-twos%3)%3);
    radices.insert(radices.end(), fours, 4);
    radices.insert(radices.end(), (twos-2*fours)/3, 8);
    return radices;
}

/** The transform of a few numbers in double precision, whose count has small factors. */
static vector<Number> transformed(const vector<Number>& values, const vector<int>& radices, size_t level = 0) {
    const int64_t size = values.size();
    if (size == 1)
        return values;
    const int radix = radices[level], part = size/radix;
    vector<Number> result(size);
    for (int t = 0; t < radix; t++) {
        vector<Number> some(part);
        for (int j = 0; j < part; j++)
            some[j] = values[j*radix+t];
        some = transformed(some, radices, level+1);
        for (int64_t k = 0; k < size; k++)
            result[k] += some[k%part]*conj(unitRoot(t*k, size));
    }
    return result;
}

template <class Scalar> FourierTables<Scalar>::FourierTables(int length) : length(length) {
    if (largestPrimeFactor(length) > LARGEST_RADIX) {
        addChirp();
        return;
    }
    int size = length;
    for (int radix : radicesOf(length)) {
        addPass(size, radix);
        size /= radix;
    }
}

template <class Scalar> void FourierTables<Scalar>::addPass(int size, int radix) {
    Pass pass = {size, radix, numbers.size(), 0};
    const int part = size/radix;
    for (int64_t k = 0; k < part && part > 1; k++)
        for (int t = 1; t < radix; t++)
            append(numbers, conj(unitRoot(t*k, size)));
    pass.roots = numbers.size();
    for (int t = 0; t < radix && radix%2 == 1; t++)
        append(numbers, unitRoot(t, radix));
    passes.push_back(pass);
}

template <class Scalar> void FourierTables<Scalar>::addChirp() {
    int longer = 1;
    while (longer < 2*length-1)
        longer *= 2;
    if (longer/8*5 >= 2*length-1)
        longer = longer/8*5;
    else if (longer/4*3 >= 2*length-1)
        longer = longer/4*3;
    vector<Number> around(longer);
    for (int64_t j = 0; j < length; j++) {
        const Number root = unitRoot(j*j, 2LL*length);
        append(chirp, conj(root));
        around[j] = root;
        around[(longer-j)%longer] = root;
    }
    for (const Number& number : transformed(around, radicesOf(longer)))
        append(chirpSpectrum, number/(double) longer);
    convolution.reset(new FourierTables(longer));
}

template <class Scalar> CosineTables<Scalar>::CosineTables(int length) : fourier(length) {
    for (int k = 0; k <= length/2; k++)
        append(rotations, unitRoot(k, 4LL*length));
}

template <class Scalar> shared_ptr<const CosineTables<Scalar> > CosineTables<Scalar>::ofLength(int length) {
    static mutex access;
    static map<int, weak_ptr<const CosineTables> > all;
    lock_guard<mutex> lock(access);
    weak_ptr<const CosineTables>& known = all[length];
    shared_ptr<const CosineTables> tables = known.lock();
    if (!tables)
        known = tables = make_shared<const CosineTables>(length);
    return tables;
}

template struct cylchain::FourierTables<float>;
template struct cylchain::FourierTables<double>;
template struct cylchain::CosineTables<float>;
template struct cylchain::CosineTables<double>;
