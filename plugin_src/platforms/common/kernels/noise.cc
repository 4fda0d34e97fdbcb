/**
 * The random numbers of a step, which lanes/Noise.h describes: those of the processor but for rounding.
 */

typedef struct {
    unsigned int seed, level;
    mm_ulong step;
} NoiseKey;

/** The four words of Philox 4x32-10. */
typedef struct {unsigned int w0, w1, w2, w3;} Words;

inline DEVICE Words drawWords(unsigned int seed, unsigned int level, mm_ulong number, unsigned int kind,
        unsigned int chain, unsigned int part, unsigned int draw) {
    unsigned int key = seed, stream = kind<<29 | level<<24 | draw;
    Words c = {part, chain, (unsigned int) (number&0xffffffff), (unsigned int) (number>>32)};
    for (int round = 0; round < 10; round++) {
        mm_ulong first = (mm_ulong) c.w0*0xD2511F53u, second = (mm_ulong) c.w2*0xCD9E8D57u;
        c.w0 = (unsigned int) (second>>32)^c.w1^key;
        c.w1 = (unsigned int) (second&0xffffffff);
        c.w2 = (unsigned int) (first>>32)^c.w3^stream;
        c.w3 = (unsigned int) (first&0xffffffff);
        key += 0x9E3779B9u;
        stream += 0xBB67AE85u;
    }
    return c;
}

/** A pair of normal numbers from two words, with the polynomials of lanes/NoiseDouble-inl.h. */
inline DEVICE double2 normalPair(unsigned int a, unsigned int b) {
    // 2^41 u = 2^power m
    int power;
    double m = frexp((double) (((mm_ulong) a<<9)|((b>>24)<<1)|1), &power);
    if (m < 0.70710678118654757) {
        m = 2*m;
        power--;
    }
    double f = m-1, s = f/(2+f), z = s*s;
    double series = 4.000000000016848+z*(1.3333333048091949+z*(0.8000077173579951+z*(0.5706997198099943+
            z*0.47234929546248894)));
    double radius = sqrt((41-power)*1.3862943611198906-s*series);
    double angle = ((double) (((b&0x3fffff)<<1)|1)-4194304)*1.8725351414619643e-07; // pi/2^24
    double square = angle*angle;
    double sine = angle*(0.9999999999954503+square*(-0.16666666630446217+square*(0.008333328690152379+
            square*(-0.0001983917835543003+square*2.717152804771581e-06))));
    double cosine = 0.9999999999999347+square*(-0.4999999999927173+square*(0.04166666653373851+
            square*(-0.001388887993644608+square*(2.4798844637538058e-05-square*2.716800521187314e-07))));
    double x = (b>>22)&1 ? -radius*cosine : radius*cosine, y = radius*sine;
    return (b>>23)&1 ? make_double2(y, x) : make_double2(x, y);
}

/** The normal numbers 4 draw to 4 draw+3 of a place. */
DEVICE double4 drawNormals(NoiseKey key, unsigned int kind, unsigned int chain, unsigned int part,
        unsigned int draw) {
    double4 result = make_double4(0, 0, 0, 0);
    // Levy's construction, from the first level to that of the step.
    for (unsigned int level = 0; level <= key.level; level++) {
        mm_ulong number = key.step>>(key.level-level);
        Words words = drawWords(key.seed, level, level == 0 ? number : number>>1, kind, chain, part, draw);
        double2 first = normalPair(words.w0, words.w1), second = normalPair(words.w2, words.w3);
        double4 drawn = make_double4(first.x, first.y, second.x, second.y);
        if (level == 0)
            result = drawn;
        else
            result = (result+drawn*(number&1 ? -1.0 : 1.0))*0.70710678118654752440;
    }
    return result;
}
