/**
 * This tests how segments of chains that are bent at rest turn: that any step leaves the distribution of equilibrium as
 * it is, of few segments, of rings, and of more than a block has, beside sums over all turns.
 */

#include "TestChains.h"
#include "dynamics/FrameTurns.h"
#include <algorithm>
#include <functional>

static const double KT = 2.5, SIGMAS = 4;

/** A chain whose nodes rest: joints with the stiffness, the torque, and the bend C cos(g-angle) of each. */
struct TestChain {
    bool closed;
    int segments;
    double stiffness, bend;
    double torqueOf(int joint) const {
        return 0.3*KT*sin(1.3*joint);
    }
    double angleOf(int joint) const {
        return 0.7*joint;
    }
    /** Of joints of an open chain, the first and the last are those to frames that are held. */
    bool isBent(int joint) const {
        return joint > 0 && (closed || joint < segments);
    }
    /** The energy of a joint between segments that have turned so far, over k_B T. */
    double energyOf(int joint, double before, double behind) const {
        const double twist = behind-before, mean = 0.5*(before+behind);
        const double ofBend = isBent(joint) ? bend*cos(mean-angleOf(joint)) : 0;
        return (0.5*stiffness*twist*twist+torqueOf(joint)*twist-ofBend)/KT;
    }
};

/** A mean over steps, with its error from blocks of them. */
class MeanOfSteps {
public:
    void add(double value) {
        ofBlock += value;
        if (++count%BLOCK == 0) {
            blocks.push_back(ofBlock/BLOCK);
            ofBlock = 0;
        }
    }
    double mean() const {
        double sum = 0;
        for (double value : blocks)
            sum += value;
        return sum/blocks.size();
    }
    double error() const {
        double square = 0;
        for (double value : blocks)
            square += (value-mean())*(value-mean());
        return sqrt(square)/blocks.size();
    }
private:
    static const int BLOCK = 200;
    double ofBlock = 0;
    int count = 0;
    Array blocks;
};

/** Take steps, and call a function with the turns after each of them. */
static void takeSteps(const TestChain& chain, double share, int steps, const function<void(const Array&)>& look) {
    FrameTurns frames;
    Array turns(chain.segments);
    auto turnOf = [&] (int s) {
        return chain.closed ? turns[(s+chain.segments)%chain.segments] : s < 0 || s == chain.segments ? 0 : turns[s];
    };
    for (int step = 0; step < steps; step++) {
        frames.begin(chain.segments, chain.closed, KT);
        for (int joint = chain.closed ? 1 : 0; joint <= chain.segments; joint++) {
            const double before = turnOf(joint-1), behind = turnOf(joint), mean = 0.5*(before+behind);
            const double bend = chain.isBent(joint) ? chain.bend : 0, angle = chain.angleOf(joint)-mean;
            // What turns do beyond those that there are.
            frames.joint(joint) = {chain.stiffness, chain.torqueOf(joint)+chain.stiffness*(behind-before),
                    bend*cos(angle), bend*sin(angle)};
        }
        for (int s = 0; s < chain.segments; s++)
            frames.setFriction(s, chain.stiffness/share);
        frames.take({7, 0, (uint64_t) step}, 3);
        double turn = 0;
        for (int s = 0; s < chain.segments; s++) {
            turn += frames.changeOf(s);
            turns[s] += turn;
        }
        look(turns);
    }
}

/** Means over all joints: the cosines of bends, and the squares of twists. */
struct Means {
    double cosine = 0, square = 0;
};

/**
 * These in equilibrium, by sums over turns that are so far apart, from forward and backward sums along the chain. All
 * of a ring turns by less than once.
 */
static Means meansOfSums(const TestChain& chain, double largest, double apart) {
    const int places = 2*(int) round(largest/apart)+1, whole = chain.closed ? (int) round(2*M_PI/apart) : 1;
    const int joints = chain.segments+(chain.closed ? 0 : 1), first = chain.closed ? 1 : 0;
    Means result;
    double all = 0;
    for (int place = 0; place < whole; place++) {
        const double begin = chain.closed ? 2*M_PI*place/whole : 0;
        // Of the segment before each joint and the one behind it: those of ends, and the first of rings, are known.
        auto turnOf = [&] (int i) {
            return begin+(i-places/2)*apart;
        };
        auto isKnown = [&] (int side) {
            return side == 0 || side == joints;
        };
        vector<Array> forward(joints+1, Array(places)), backward(forward);
        forward[0][places/2] = backward[joints][places/2] = 1;
        auto visit = [&] (int number, const function<void(int, int, double)>& use) {
            for (int i = 0; i < places; i++)
                for (int j = 0; j < places; j++)
                    if ((!isKnown(number) || i == places/2) && (!isKnown(number+1) || j == places/2))
                        use(i, j, exp(-chain.energyOf(first+number, turnOf(i), turnOf(j))));
        };
        for (int number = 0; number < joints; number++) {
            visit(number, [&] (int i, int j, double weight) {
                forward[number+1][j] += forward[number][i]*weight*apart;
            });
            visit(joints-1-number, [&] (int i, int j, double weight) {
                backward[joints-1-number][i] += backward[joints-number][j]*weight*apart;
            });
        }
        all += forward[joints][places/2];
        for (int number = 0; number < joints; number++)
            visit(number, [&] (int i, int j, double weight) {
                const double share = forward[number][i]*weight*apart*backward[number+1][j]/joints;
                const double before = turnOf(i), behind = turnOf(j);
                result.cosine += share*cos(0.5*(before+behind)-chain.angleOf(first+number));
                result.square += share*(behind-before)*(behind-before);
            });
    }
    return {result.cosine/all, result.square/all};
}

static void checkEquilibrium(const string& name, const TestChain& chain, const Means& expected, double share,
            int steps) {
    MeanOfSteps cosines, squares;
    const int joints = chain.segments+(chain.closed ? 0 : 1), first = chain.closed ? 1 : 0;
    takeSteps(chain, share, steps, [&] (const Array& turns) {
        double cosine = 0, square = 0;
        for (int joint = first; joint <= chain.segments; joint++) {
            const double before = joint > 0 ? turns[joint-1] : 0;
            const double behind = joint < chain.segments ? turns[joint] : chain.closed ? turns[0] : 0;
            cosine += cos(0.5*(before+behind)-chain.angleOf(joint))/joints;
            square += (behind-before)*(behind-before)/joints;
        }
        cosines.add(cosine);
        squares.add(square);
    });
    const string label = name+" in steps of "+to_string(share);
    check(SIGMAS*cosines.error() < 0.02 && SIGMAS*squares.error() < 0.05*expected.square, label+": too few steps");
    checkClose(expected.cosine, cosines.mean(), cosines.error(), SIGMAS, label+": cosines of bends");
    checkClose(expected.square, squares.mean(), squares.error(), SIGMAS, label+": squares of twists");
}

static void testEquilibrium() {
    const struct {
        const char* name;
        TestChain chain;
        double largest, apart;
        int steps;
    } cases[] = {
        {"two segments between frames", {false, 2, 2*KT, 3*KT}, 6, 0.1, 40000},
        {"short chain", {false, 4, 5*KT, 2*KT}, 6, 0.1, 20000},
        {"ring", {true, 3, 2*KT, 2*KT}, 6, 0.2, 40000},
        {"chain of two blocks", {false, 150, 5*KT, 0.7*KT}, 24, 0.2, 8000}
    };
    for (const auto& own : cases) {
        const Means expected = meansOfSums(own.chain, own.largest, own.apart);
        for (double share : {0.3, 3.0, 100.0})
            checkEquilibrium(own.name, own.chain, expected, share, own.steps);
    }
}

int main() {
    return runTests({testEquilibrium});
}
