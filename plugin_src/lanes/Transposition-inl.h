// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Four numbers in a vector register, and four such vectors as the rows of a matrix that is transposed.
 */

template <class Number> struct Four;
template <> struct Four<float> {
    typedef float Type __attribute__((vector_size(16)));
    typedef std::int32_t Mask __attribute__((vector_size(16)));
};
template <> struct Four<double> {
    typedef double Type __attribute__((vector_size(32)));
    typedef std::int64_t Mask __attribute__((vector_size(32)));
};
template <class Number> using FourOf = typename Four<Number>::Type;

template <class Number> CYLCHAIN_INLINE FourOf<Number> loadFour(const Number* values) {
    FourOf<Number> result;
    std::memcpy(&result, values, sizeof(result));
    return result;
}

template <class Number> CYLCHAIN_INLINE void storeFour(const FourOf<Number>& values, Number* result) {
    std::memcpy(result, &values, sizeof(values));
}

/** Some four of the eight numbers of a and b. */
#ifdef __clang__
#define CYLCHAIN_CHOOSE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define CYLCHAIN_CHOOSE(a, b, ...) __builtin_shuffle(a, b, (typename Four<Number>::Mask) {__VA_ARGS__})
#endif

/** Turn rows into columns. */
template <class Number> CYLCHAIN_INLINE void transpose(FourOf<Number>* rows) {
    const FourOf<Number> a = CYLCHAIN_CHOOSE(rows[0], rows[1], 0, 4, 1, 5);
    const FourOf<Number> b = CYLCHAIN_CHOOSE(rows[2], rows[3], 0, 4, 1, 5);
    const FourOf<Number> c = CYLCHAIN_CHOOSE(rows[0], rows[1], 2, 6, 3, 7);
    const FourOf<Number> d = CYLCHAIN_CHOOSE(rows[2], rows[3], 2, 6, 3, 7);
    rows[0] = CYLCHAIN_CHOOSE(a, b, 0, 1, 4, 5);
    rows[1] = CYLCHAIN_CHOOSE(a, b, 2, 3, 6, 7);
    rows[2] = CYLCHAIN_CHOOSE(c, d, 0, 1, 4, 5);
    rows[3] = CYLCHAIN_CHOOSE(c, d, 2, 3, 6, 7);
}
