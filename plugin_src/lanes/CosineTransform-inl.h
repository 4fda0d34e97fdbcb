// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Cosine transforms of sequences in lanes: a pair of them, the real and the imaginary parts of numbers, takes one
 * complex Fourier transform of the same length, in the order of Makhoul, IEEE Trans. Acoust. Speech Signal Process.
 * 1980, 28, 27. This is stable, unlike methods that divide by cosines, which single precision would not survive.
 *
 * No library is used because none of them transforms the lanes of vector registers side by side: they vectorize within
 * a sequence, or take sequences whose numbers would have to be brought from lanes to rows and back.
 *
 * Fourier transforms are decimated in time, part by part down to the smallest one, so that what is at work at a time
 * stays near to the processor.
 */

template <class Real> struct Complex {
    Real re, im;
    CYLCHAIN_INLINE Complex operator+(const Complex& z) const {return {re+z.re, im+z.im};}
    CYLCHAIN_INLINE Complex operator-(const Complex& z) const {return {re-z.re, im-z.im};}
    CYLCHAIN_INLINE Complex operator*(Scalar s) const {return {re*s, im*s};}
    /** The product with a complex number that is the same in all lanes. */
    CYLCHAIN_INLINE Complex times(const Scalar* z) const {return {re*z[0]-im*z[1], re*z[1]+im*z[0]};}
    CYLCHAIN_INLINE Complex timesMinusI() const {return {im, Real{}-re};}
};

template <class Real> CYLCHAIN_INLINE void transformTwo(Complex<Real>& a, Complex<Real>& b) {
    const Complex<Real> difference = a-b;
    a = a+b;
    b = difference;
}

template <class Real> CYLCHAIN_INLINE void transformFour(Complex<Real>& a, Complex<Real>& b, Complex<Real>& c,
            Complex<Real>& d) {
    const Complex<Real> even = a+c, evenDifference = a-c, odd = b+d, oddDifference = (b-d).timesMinusI();
    a = even+odd;
    b = evenDifference+oddDifference;
    c = even-odd;
    d = evenDifference-oddDifference;
}

template <class Real> CYLCHAIN_INLINE void transformEight(Complex<Real>* z) {
    Complex<Real> a = z[0], b = z[2], c = z[4], d = z[6], e = z[1], f = z[3], g = z[5], h = z[7];
    transformFour(a, b, c, d);
    transformFour(e, f, g, h);
    const Scalar root = M_SQRT1_2;
    f = Complex<Real> {f.re+f.im, f.im-f.re}*root;
    g = g.timesMinusI();
    h = Complex<Real> {h.im-h.re, Real{}-(h.re+h.im)}*root;
    z[0] = a+e;
    z[1] = b+f;
    z[2] = c+g;
    z[3] = d+h;
    z[4] = a-e;
    z[5] = b-f;
    z[6] = c-g;
    z[7] = d-h;
}

/** The transform of an odd count of numbers, for the roots exp(2 pi i t/count). */
template <int LARGEST, class Real> CYLCHAIN_INLINE void transformOdd(Complex<Real>* z, int count,
            const Scalar* roots) {
    Complex<Real> sums[LARGEST/2+1], differences[LARGEST/2+1];
    const Complex<Real> first = z[0];
    for (int t = 1; 2*t < count; t++) {
        sums[t] = z[t]+z[count-t];
        differences[t] = z[t]-z[count-t];
        z[0] = z[0]+sums[t];
    }
    for (int k = 1; 2*k < count; k++) {
        Complex<Real> even = first, odd = {Real{}, Real{}};
        for (int t = 1, index = k; 2*t < count; t++) {
            even = even+sums[t]*roots[2*index];
            odd = odd+differences[t]*roots[2*index+1];
            index += (index+k < count ? k : k-count);
        }
        odd = odd.timesMinusI();
        z[k] = even+odd;
        z[count-k] = even-odd;
    }
}

/** The transform of a few numbers, as many as RADIX says unless that is zero. */
template <int RADIX, int LARGEST, class Real> CYLCHAIN_INLINE void transformFew(Complex<Real>* z, int radix,
            const Scalar* roots) {
    if constexpr (RADIX == 2)
        transformTwo(z[0], z[1]);
    else if constexpr (RADIX == 4)
        transformFour(z[0], z[1], z[2], z[3]);
    else if constexpr (RADIX == 8)
        transformEight(z);
    else if constexpr (RADIX > 0)
        transformOdd<RADIX>(z, RADIX, roots);
    else
        transformOdd<LARGEST>(z, radix, roots);
}

/** Join the transforms of the parts, which lie one after another in the output, or transform the input if it is few. */
template <int RADIX, class Real> void joinParts(const FourierTables<Scalar>& tables,
            const typename FourierTables<Scalar>::Pass& pass, const Complex<Real>* input, int stride,
            Complex<Real>* output) {
    constexpr int LARGEST = (RADIX > 0 ? RADIX : FourierTables<Scalar>::LARGEST_RADIX);
    const int radix = (RADIX > 0 ? RADIX : pass.radix), part = pass.size/radix;
    const Scalar* const roots = tables.numbers.data()+pass.roots;
    Complex<Real> z[LARGEST];
    if (part == 1) {
        z[0] = input[0];
        for (int t = 1; t < radix; t++)
            z[t] = input[t*stride];
        transformFew<RADIX, LARGEST>(z, radix, roots);
        for (int t = 0; t < radix; t++)
            output[t] = z[t];
        return;
    }
    const Scalar* twiddles = tables.numbers.data()+pass.twiddles;
    for (int k = 0; k < part; k++, twiddles += 2*(radix-1)) {
        z[0] = output[k];
        for (int t = 1; t < radix; t++)
            z[t] = output[t*part+k].times(twiddles+2*(t-1));
        transformFew<RADIX, LARGEST>(z, radix, roots);
        for (int t = 0; t < radix; t++)
            output[t*part+k] = z[t];
    }
}

template <class Real> void transformParts(const FourierTables<Scalar>& tables, int level, const Complex<Real>* input,
            int stride, Complex<Real>* output) {
    const typename FourierTables<Scalar>::Pass& pass = tables.passes[level];
    const int part = pass.size/pass.radix;
    for (int t = 0; t < pass.radix && part > 1; t++)
        transformParts(tables, level+1, input+t*stride, stride*pass.radix, output+t*part);
    switch (pass.radix) {
        case 2: return joinParts<2>(tables, pass, input, stride, output);
        case 3: return joinParts<3>(tables, pass, input, stride, output);
        case 4: return joinParts<4>(tables, pass, input, stride, output);
        case 5: return joinParts<5>(tables, pass, input, stride, output);
        case 7: return joinParts<7>(tables, pass, input, stride, output);
        case 8: return joinParts<8>(tables, pass, input, stride, output);
        default: return joinParts<0>(tables, pass, input, stride, output);
    }
}

/** Bluestein's method, for lengths with a large prime factor. */
template <class Real> void transformByConvolution(const FourierTables<Scalar>& tables, const Complex<Real>* input,
            Complex<Real>* output) {
    static thread_local Scratch scratch;
    const FourierTables<Scalar>& longer = *tables.convolution;
    Complex<Real>* values = scratch.reserve<Complex<Real> >(2*longer.length);
    Complex<Real>* spectrum = values+longer.length;
    for (int j = 0; j < tables.length; j++)
        values[j] = input[j].times(&tables.chirp[2*j]);
    for (int j = tables.length; j < longer.length; j++)
        values[j] = {Real{}, Real{}};
    transformParts(longer, 0, values, 1, spectrum);
    // A transform of numbers with exchanged parts is the inverse one.
    for (int j = 0; j < longer.length; j++) {
        const Complex<Real> product = spectrum[j].times(&tables.chirpSpectrum[2*j]);
        spectrum[j] = {product.im, product.re};
    }
    transformParts(longer, 0, spectrum, 1, values);
    for (int k = 0; k < tables.length; k++)
        output[k] = Complex<Real> {values[k].im, values[k].re}.times(&tables.chirp[2*k]);
}

/** The sums over j of input[j] exp(-2 pi i j k/length), for each k. */
template <class Real> void transformFourier(const FourierTables<Scalar>& tables, const Complex<Real>* input,
            Complex<Real>* output) {
    if (tables.convolution)
        transformByConvolution(tables, input, output);
    else if (tables.length == 1)
        output[0] = input[0];
    else
        transformParts(tables, 0, input, 1, output);
}

/** Where an element of a sequence is among those that a Fourier transform takes or gives. */
inline int fourierPlace(int element, int length) {
    return element%2 == 0 ? element/2 : length-1-element/2;
}

/**
 * The cosine sums of a pair of sequences for k and length-k, of their Fourier transform for both. Rotations are those
 * of k: cosine and sine.
 */
template <class Real> CYLCHAIN_INLINE void cosinesOfFourier(const Complex<Real>& direct, const Complex<Real>& mirrored,
            const Scalar* rotation, Complex<Real>& sums, Complex<Real>& mirroredSums) {
    const Scalar c = Scalar(0.5)*rotation[0], s = Scalar(0.5)*rotation[1];
    const Real firstReal = direct.re+mirrored.re, firstImaginary = direct.im-mirrored.im;
    const Real secondReal = direct.im+mirrored.im, secondImaginary = mirrored.re-direct.re;
    sums = {c*firstReal+s*firstImaginary, c*secondReal+s*secondImaginary};
    mirroredSums = {s*firstReal-c*firstImaginary, s*secondReal-c*secondImaginary};
}

/** The other way round, with real and imaginary parts exchanged so that another transform is the inverse one. */
template <class Real> CYLCHAIN_INLINE void fourierOfCosines(const Complex<Real>& sums,
            const Complex<Real>& mirroredSums, const Scalar* rotation, Complex<Real>& direct,
            Complex<Real>& mirrored) {
    const Scalar c = rotation[0], s = rotation[1];
    const Real firstReal = c*sums.re+s*mirroredSums.re, firstImaginary = s*sums.re-c*mirroredSums.re;
    const Real secondReal = c*sums.im+s*mirroredSums.im, secondImaginary = s*sums.im-c*mirroredSums.im;
    direct = {firstImaginary+secondReal, firstReal-secondImaginary};
    mirrored = {secondReal-firstImaginary, firstReal+secondImaginary};
}

template <int W> void transformCosinesInLanes(const CosineTables<Scalar>& tables, int count, double* values,
            bool inverse) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch scratch;
    const int n = tables.fourier.length;
    Complex<Real>* z = scratch.reserve<Complex<Real> >(2*n);
    Complex<Real>* spectrum = z+n;
    auto forNumbers = [&] (auto function) {
        for (int j = 0; j < n; j++)
            for (int i = 0; i < 2*W && i < count; i++)
                function(values[i*n+j], lane(i%2 == 0 ? z[j].re : z[j].im, i/2));
    };
    for (int j = 0; j < n; j++)
        z[j] = {Real{}, Real{}};
    forNumbers([] (double& value, Scalar& number) {number = value;});
    if (inverse) {
        spectrum[0] = {z[0].im, z[0].re};
        for (int k = 1; k <= n/2; k++)
            fourierOfCosines(z[k], z[n-k], &tables.rotations[2*k], spectrum[k], spectrum[n-k]);
        transformFourier(tables.fourier, spectrum, z);
        std::copy(z, z+n, spectrum);
        for (int j = 0; j < n; j++) {
            const Complex<Real> one = spectrum[fourierPlace(j, n)];
            z[j] = Complex<Real> {one.im, one.re}*(1/Scalar(n));
        }
    }
    else {
        for (int j = 0; j < n; j++)
            spectrum[fourierPlace(j, n)] = z[j];
        std::copy(spectrum, spectrum+n, z);
        transformFourier(tables.fourier, z, spectrum);
        z[0] = spectrum[0];
        for (int k = 1; k <= n/2; k++)
            cosinesOfFourier(spectrum[k], spectrum[n-k], &tables.rotations[2*k], z[k], z[n-k]);
    }
    forNumbers([] (double& value, Scalar& number) {value = number;});
}

inline void transformCosinesOf(int length, int count, double* values, bool inverse) {
    const std::shared_ptr<const CosineTables<Scalar> > tables = CosineTables<Scalar>::ofLength(length);
    for (int first = 0; first < count; first += 2*CYLCHAIN_LANES)
        transformCosinesInLanes<CYLCHAIN_LANES>(*tables, count-first, values+(std::size_t) first*length, inverse);
}
