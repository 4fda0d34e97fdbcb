/**
 * Random numbers in lanes. ChainLoops.h includes this file into the namespace of an instruction set.
 */

/** The Gaussian streams of all lanes, side by side. Each lane gives the numbers that its stream gives alone. */
template <int W> class GaussianLanes {
    typedef typename Lanes<W>::Type Real;
    typedef typename Lanes<W>::Bits Bits;
public:
    GaussianLanes(const ChainPack& pack, const StepSettings& settings) : layers(GaussianStream::layers()) {
        // Seeds have 32 bits; those above them tell the parts of a step apart.
        const std::uint64_t seed = settings.seed^((std::uint64_t) settings.part<<32);
        for (int i = 0; i < W; i++) {
            const GaussianStream stream(seed, settings.step, pack.chain[i]);
            for (int k = 0; k < 4; k++)
                word(state[k], i) = stream.state[k];
        }
    }
    Real next() {
        const Bits sum = state[0]+state[3];
        const Bits bits = ((sum<<23)|(sum>>41))+state[0];
        const Bits t = state[1]<<17;
        state[2] ^= state[0];
        state[3] ^= state[1];
        state[1] ^= state[2];
        state[0] ^= state[3];
        state[2] ^= t;
        state[3] = (state[3]<<45)|(state[3]>>19);

        // Adding 2^52 in the exponent's place turns 52 bits into a double.
        Real magnitude = reinterpreted((bits>>12)|0x4330000000000000ULL)-4503599627370496.0;
        Real width, inside;
        for (int i = 0; i < W; i++) {
            const GaussianStream::Layer& layer = layers[word(bits, i)&0xff];
            lane(width, i) = layer.width;
            lane(inside, i) = layer.inside;
        }
        Real result = magnitude*width;
        result = reinterpreted(asBits(result)|((bits&0x100)<<55));
        bool finished = true;
        for (int i = 0; i < W; i++)
            finished &= (lane(magnitude, i) < lane(inside, i));
        if (__builtin_expect(!finished, 0))
            for (int i = 0; i < W; i++)
                if (!(lane(magnitude, i) < lane(inside, i)))
                    lane(result, i) = finish(word(bits, i), i);
        return result;
    }
    /** The next normal number of one lane alone. */
    double nextOfLane(int i) {
        return advance(i, [] (GaussianStream& stream) {return stream.next();});
    }
    /** The next number of one lane alone that is uniform between 0 and 1. */
    double uniform(int i) {
        return advance(i, [] (GaussianStream& stream) {return stream.uniform();});
    }
private:
    const GaussianStream::Layer* layers;
    Bits state[4];
    template <class Draw> double advance(int i, Draw draw) {
        GaussianStream stream;
        for (int k = 0; k < 4; k++)
            stream.state[k] = word(state[k], i);
        const double result = draw(stream);
        for (int k = 0; k < 4; k++)
            word(state[k], i) = stream.state[k];
        return result;
    }
    static std::uint64_t word(const Bits& bits, int i) {
        return reinterpret_cast<const std::uint64_t*>(&bits)[i];
    }
    static std::uint64_t& word(Bits& bits, int i) {
        return reinterpret_cast<std::uint64_t*>(&bits)[i];
    }
    static Real reinterpreted(Bits bits) {
        Real result;
        std::memcpy(&result, &bits, sizeof(result));
        return result;
    }
    static Bits asBits(Real value) {
        Bits result;
        std::memcpy(&result, &value, sizeof(result));
        return result;
    }
    double finish(std::uint64_t bits, int i) {
        std::uint64_t own[4];
        for (int k = 0; k < 4; k++)
            own[k] = word(state[k], i);
        const double result = GaussianStream::finish(bits, own);
        for (int k = 0; k < 4; k++)
            word(state[k], i) = own[k];
        return result;
    }
};
