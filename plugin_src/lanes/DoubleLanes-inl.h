// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What is computed in double precision beside packs in either precision.
 */

/** As many lanes of doubles: in one register, or in two where numbers are floats. */
#ifdef CYLCHAIN_SINGLE_PRECISION
template <int W> struct DoubleLanes {
    static constexpr int REGISTERS = 2;
    typedef double Type __attribute__((vector_size(4*W)));
    typedef float Half __attribute__((vector_size(2*W)));
};
#else
template <int W> struct DoubleLanes : Lanes<W> {
    static constexpr int REGISTERS = 1;
};
#endif

/** Bring lanes into those of one of the registers of doubles, and all of these back. */
template <int W> CYLCHAIN_INLINE typename DoubleLanes<W>::Type inDouble(const typename Lanes<W>::Type& value,
            [[maybe_unused]] int part) {
    if constexpr (DoubleLanes<W>::REGISTERS == 1)
        return value;
    else {
        typename DoubleLanes<W>::Half half;
        std::memcpy(&half, reinterpret_cast<const char*>(&value)+part*sizeof(half), sizeof(half));
        return __builtin_convertvector(half, typename DoubleLanes<W>::Type);
    }
}

template <int W> CYLCHAIN_INLINE typename Lanes<W>::Type fromDouble(const typename DoubleLanes<W>::Type* parts) {
    if constexpr (DoubleLanes<W>::REGISTERS == 1)
        return *parts;
    else {
        typename Lanes<W>::Type result;
        for (int part = 0; part < DoubleLanes<W>::REGISTERS; part++) {
            const auto half = __builtin_convertvector(parts[part], typename DoubleLanes<W>::Half);
            std::memcpy(reinterpret_cast<char*>(&result)+part*sizeof(half), &half, sizeof(half));
        }
        return result;
    }
}

template <int W> CYLCHAIN_INLINE Vector<typename DoubleLanes<W>::Type> inDouble(
            const Vector<typename Lanes<W>::Type>& vector, int part) {
    return {inDouble<W>(vector.x, part), inDouble<W>(vector.y, part), inDouble<W>(vector.z, part)};
}

template <int W> CYLCHAIN_INLINE Vector<typename Lanes<W>::Type> fromDouble(
            const Vector<typename DoubleLanes<W>::Type>* parts) {
    Vector<typename DoubleLanes<W>::Type> last = parts[DoubleLanes<W>::REGISTERS-1];
    const typename DoubleLanes<W>::Type x[] = {parts->x, last.x}, y[] = {parts->y, last.y}, z[] = {parts->z, last.z};
    return {fromDouble<W>(x), fromDouble<W>(y), fromDouble<W>(z)};
}
