#ifndef CYLCHAIN_COSINE_TABLES_H_
#define CYLCHAIN_COSINE_TABLES_H_

#include <cstddef>
#include <memory>
#include <vector>

namespace cylchain {

/**
 * What a discrete Fourier transform of some length takes: see CosineTransform-inl.h. Complex numbers are pairs of a
 * real part and an imaginary one.
 */
template <class Scalar> struct FourierTables {
    /** Transforms of this size are made of as many smaller ones as the radix says. */
    struct Pass {
        int size, radix;
        /** Where exp(-2 pi i t k/size) begins in numbers, for k below size/radix and t from 1 to radix-1. */
        std::size_t twiddles;
        /** Where exp(2 pi i t/radix) begins, for an odd radix. */
        std::size_t roots;
    };
    /** Prime numbers up to this one have passes of their own, in which each number meets all others. */
    static constexpr int LARGEST_RADIX = 61;
    explicit FourierTables(int length);
    int length;
    /** From the largest one on. There are none if Bluestein's method is used. */
    std::vector<Pass> passes;
    std::vector<Scalar> numbers;
    /**
     * For lengths with a larger prime factor, Bluestein's method: the transform of a product with the chirp
     * exp(-pi i j^2/length) is a convolution, which a longer transform does; its length is the one of these tables.
     */
    std::unique_ptr<const FourierTables> convolution;
    std::vector<Scalar> chirp, chirpSpectrum;
private:
    void addPass(int size, int radix);
    void addChirp();
};

/** What a cosine transform of some length takes, as much memory as a few numbers for each element. */
template <class Scalar> struct CosineTables {
    explicit CosineTables(int length);
    /** Get the tables of a length. Those who use them at the same time share them. */
    static std::shared_ptr<const CosineTables> ofLength(int length);
    FourierTables<Scalar> fourier;
    /** Cosine and sine of pi k/(2 length), for k up to half the length. */
    std::vector<Scalar> rotations;
};

/**
 * Transform sequences that come one after another in memory: into sums over j of x[j] cos(pi p (j+1/2)/length), or
 * these sums into the sequence. This is for tests: steps keep in lanes what they transform.
 */
void transformCosines(int length, int count, double* values, bool inverse);

/** The same in single precision. */
void transformCosinesInSinglePrecision(int length, int count, double* values, bool inverse);

} // namespace cylchain

#endif /*CYLCHAIN_COSINE_TABLES_H_*/
