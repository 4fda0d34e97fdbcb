/**
 * This tests rigid bodies: turns as Gibbs vectors, frames from positions, and steps of bodies: their diffusion, and the
 * equilibrium of bodies on springs against the distribution of von Mises and Fisher and a quadrature.
 */

#include "TestChains.h"
#include "mechanics/RigidBody.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/BodyStep.h"
#include "networks/CoupledEquations.h"
#include <algorithm>
#include <array>
#include <memory>

typedef array<double, 3> Vec;

static void testTurns() {
    NormalNumbers normal(1);
    for (int i = 0; i < 50; i++) {
        const Array g = normal(3), other = normal(3), a = normal(3);
        double after[3], mean[3], turned[3];
        GibbsVector::turn(g.data(), a.data(), after);
        for (int k = 0; k < 3; k++)
            mean[k] = 0.5*(a[k]+after[k]);
        cross(g.data(), mean, turned);
        for (int k = 0; k < 3; k++)
            checkClose(after[k]-a[k], turned[k], 1, 1e-13, "a turn is a discrete gradient");
        checkClose(dot(a.data(), a.data()), dot(after, after), 1, 1e-12, "a turn keeps lengths");
        Array both = g;
        GibbsVector::follow(other.data(), both.data());
        double one[3], two[3], half[3], quarter[3], whole[3];
        GibbsVector::turn(other.data(), after, one);
        GibbsVector::turn(both.data(), a.data(), two);
        GibbsVector::halve(g.data(), half);
        GibbsVector::turn(half, a.data(), quarter);
        GibbsVector::turn(half, quarter, whole);
        for (int k = 0; k < 3; k++) {
            checkClose(one[k], two[k], 1, 1e-12, "one turn after the other");
            checkClose(after[k], whole[k], 1, 1e-12, "two halves of a turn");
        }
    }
    const double vector[] = {0, 0, 0.7}, x[] = {1, 0, 0};
    double g[3], after[3];
    GibbsVector::fromRotationVector(vector, g);
    GibbsVector::turn(g, x, after);
    checkClose(cos(0.7), after[0], 1, 1e-14, "a turn by an angle");
    checkClose(sin(0.7), after[1], 1, 1e-14, "a turn by an angle");
    Array half = {0, 0, 1.9}, more = {0, 0, 3};
    check(!GibbsVector::follow(more.data(), half.data()), "more than half a turn");
}

static RigidBody bodyOf(const Array& places, double friction = 1, const Array& rotational = {1, 0, 0, 1, 0, 1}) {
    RigidBody body;
    body.places = places;
    for (size_t i = 0; i < places.size()/3; i++)
        body.particles.push_back(i);
    body.friction = friction;
    copy(rotational.begin(), rotational.end(), body.rotationalFriction);
    return body;
}

static void testFrames() {
    NormalNumbers normal(2);
    const RigidBody body = bodyOf(normal(15));
    const Array g = normal(3), centre = normal(3);
    RigidFrame frame;
    GibbsVector::turn(g.data(), RigidFrame(), frame);
    copy(centre.begin(), centre.end(), frame.centre);
    Array positions(15);
    for (int i = 0; i < 5; i++) {
        double arm[3], back[3];
        frame.turn(&body.places[3*i], arm);
        frame.turnBack(arm, back);
        for (int k = 0; k < 3; k++) {
            positions[3*i+k] = centre[k]+arm[k];
            checkClose(body.places[3*i+k], back[k], 1, 1e-13, "there and back");
        }
    }
    const RigidFrameFinder finder(body);
    check(!finder.isOnLine(), "a body that is on no line");
    const RigidFrame found = finder.find(body, positions.data());
    for (int k = 0; k < 9; k++)
        checkClose(frame.rotation[k], found.rotation[k], 1, 1e-12, "the rotation of a frame");
    for (int k = 0; k < 3; k++)
        checkClose(centre[k], found.centre[k], 1, 1e-12, "the centre of a frame");
    checkClose(0, findDeformation(body, found, positions.data()), 1, 1e-12, "a body that is rigid");
    positions[13] += 0.25;
    check(findDeformation(body, finder.find(body, positions.data()), positions.data()) > 0.1, "one that is not");
    check(RigidFrameFinder(bodyOf({0, 0, 0, 1, 1, 0, 3, 3, 1e-6})).isOnLine(), "particles on a line");
}

/** Springs of no rest length from places to points: the number of a place, the point and the stiffness. */
struct Spring {
    int place;
    Vec point;
    double stiffness;
};

/** Many bodies that are alike, each on springs of its own. */
class Bodies {
public:
    Bodies(const RigidBody& body, int count, const vector<Spring>& springs, double kT = 1) : springs(springs),
            places(body.particles.size()), all(count, body), random(4) {
        for (int i = 0; i < count; i++)
            for (int& particle : all[i].particles) {
                const double* const place = &body.places[3*particle];
                x.insert(x.end(), place, place+3);
                particle += i*places;
            }
        step.reset(new BodyStep(all));
        settings.kT = kT;
        settings.scheme = Scheme::Implicit;
        settings.seed = 7;
    }
    const double* at(int body, int place) const {
        return &x[3*(body*places+place)];
    }
    int size() const {
        return all.size();
    }
    /** A step of Newton's method with springs as LinkEquations has them. */
    void take(double stepSize) {
        settings.stepSize = stepSize;
        settings.step++;
        const int count = size(), numTerms = count*springs.size();
        const unique_ptr<bool[]> flags(new bool[count]);
        fill_n(flags.get(), count, true);
        const Array forces(x.size());
        step->begin(x.data(), forces.data(), NULL, settings, flags.get());
        const double rate = springs.empty() ? 0 : totalStiffness()/leastFriction();
        const double theta = max(0.5, 1-1/(stepSize*rate));
        const Array noise = random(3*numTerms), begun = x;
        Array now = x, moves(3*TermBlocks::fill(numTerms)), stiffness(6*(size_t) numTerms), expected(3*numTerms);
        vector<CouplingTerm> terms(numTerms);
        bool any = true;
        for (int iteration = 0; any; iteration++) {
            check(iteration < 30, "equations are solved");
            for (int i = 0; i < numTerms; i++) {
                const Spring& spring = springs[i%springs.size()];
                const int body = i/springs.size();
                CouplingTerm& term = terms[i] = CouplingTerm();
                term.lane = body;
                term.node = spring.place;
                for (int k = 0; k < 3; k++) {
                    const int place = 3*(body*places+spring.place)+k;
                    const double before = begun[place]-spring.point[k], after = now[place]-spring.point[k];
                    term.force[k] = -spring.stiffness*(theta*after+(1-theta)*before-
                            sqrt((2*theta-1)*settings.kT/spring.stiffness)*noise[3*i+k]);
                }
                for (int k : {0, 3, 5})
                    stiffness[6*i+k] = term.stiffness[k] = theta*spring.stiffness;
                copy(term.force, term.force+3, expected.begin()+3*i);
            }
            step->setExpectedForces(expected.data());
            step->eliminate(terms.data(), numTerms, moves.data());
            if (iteration == 0)
                step->setJointStiffness(stiffness.data());
            step->advance(NULL, ShareOfChange(), flags.get(), moves.data());
            step->getPositions(begun.data(), now.data());
            any = find(flags.get(), flags.get()+count, true) != flags.get()+count;
        }
        x = now;
    }
private:
    double totalStiffness() const {
        double sum = 0;
        for (const Spring& spring : springs)
            sum += spring.stiffness;
        return sum;
    }
    double leastFriction() const {
        double least = HUGE_VAL;
        for (const Spring& spring : springs) {
            const double* const place = &all[0].places[3*spring.place];
            least = min(least, 1/(1/all[0].friction+dot(place, place)/all[0].rotationalFriction[0]));
        }
        return least;
    }
    const vector<Spring> springs;
    const int places;
    vector<RigidBody> all;
    Array x;
    unique_ptr<BodyStep> step;
    StepSettings settings = {};
    NormalNumbers random;
};

/** The mean of many numbers, and its standard error. */
struct Mean {
    double value, error;
    explicit Mean(const Array& numbers) {
        double sum = 0, square = 0;
        for (double number : numbers) {
            sum += number;
            square += number*number;
        }
        value = sum/numbers.size();
        error = sqrt((square/numbers.size()-value*value)/numbers.size());
    }
};

static void checkMean(double expected, const Array& numbers, double largest, const string& what) {
    const Mean mean(numbers);
    check(4*mean.error < largest*fabs(expected), what+": not enough of them");
    checkClose(expected, mean.value, 4*mean.error, 1, what);
}

/** A body with three kinds of axes: mean squares of the motion of its centre, and decays of its axes. */
static void testDiffusion() {
    const Array rotational = {1, 0, 0, 2, 0, 4};
    const int count = 20000;
    for (double stepSize : {0.01, 0.05}) {
        Bodies bodies(bodyOf({1, 0, 0, 0, 1, 0, 0, 0, 1}, 3, rotational), count, {});
        const int steps = 4;
        for (int i = 0; i < steps; i++)
            bodies.take(stepSize);
        const double time = steps*stepSize;
        Array squares(count), axes[3] = {Array(count), Array(count), Array(count)};
        for (int i = 0; i < count; i++) {
            Vec centre = {};
            // The three axes end on the corners of a triangle, whose normal tells where they begin.
            double first[3], second[3], normal[3];
            for (int k = 0; k < 3; k++) {
                first[k] = bodies.at(i, 1)[k]-bodies.at(i, 0)[k];
                second[k] = bodies.at(i, 2)[k]-bodies.at(i, 0)[k];
                centre[k] = (bodies.at(i, 0)[k]+bodies.at(i, 1)[k]+bodies.at(i, 2)[k])/3;
            }
            cross(first, second, normal);
            for (int k = 0; k < 3; k++)
                centre[k] -= normal[k]/3;
            squares[i] = dot(centre.data(), centre.data());
            for (int axis = 0; axis < 3; axis++)
                axes[axis][i] = bodies.at(i, axis)[axis]-centre[axis];
        }
        const string name = " in steps of "+to_string(stepSize);
        checkMean(6*time/3, squares, 0.1, "motion"+name);
        // An axis decays by the turns about the other two.
        const double rates[] = {0.5+0.25, 1+0.25, 1+0.5};
        for (int axis = 0; axis < 3; axis++)
            checkMean(exp(-rates[axis]*time), axes[axis], 0.05, "axis "+to_string(axis)+name);
    }
}

/**
 * Two equal springs from opposite places to points at the distance D: the direction of the body has the weight
 * exp(c cos), with c = k a D/k_B T, and the centre moves as on both springs.
 */
static void checkTwoSprings(double stepSize) {
    const double arm = 1, stiffness = 30;
    const vector<Spring> springs = {{1, {0.8, 0, 0}, stiffness}, {2, {-0.8, 0, 0}, stiffness}};
    const double c = stiffness*2*arm*0.8, expected = 1/tanh(c)-1/c;
    const RigidBody body = bodyOf({0, 0, 0, arm, 0, 0, -arm, 0, 0, 0, arm, 0}, 1, {1.3, 0, 0, 1.3, 0, 1.3});
    Bodies bodies(body, 4000, springs);
    const int steps = stepSize < 0.001 ? 300 : 40;
    for (int i = 0; i < steps; i++)
        bodies.take(stepSize);
    Array bends(bodies.size()), squares(bodies.size());
    for (int i = 0; i < bodies.size(); i++) {
        bends[i] = 1-0.5*(bodies.at(i, 1)[0]-bodies.at(i, 2)[0])/arm;
        squares[i] = 2*stiffness*dot(bodies.at(i, 0), bodies.at(i, 0));
    }
    const string name = " in steps of "+to_string(stepSize);
    checkMean(1-expected, bends, 0.08, "bends"+name);
    checkMean(3, squares, 0.08, "motion of the centre"+name);
}

static void testTwoSprings() {
    checkTwoSprings(0.005);
    checkTwoSprings(0.05);
}

static void testTwoSpringsInShortSteps() {
    checkTwoSprings(0.0005);
}

/** What forces of places against each other do to a body is nothing: they are taken off, and all else is kept. */
static void testWhatMoves() {
    NormalNumbers normal(3);
    const int count = 12;
    const vector<RigidBody> bodies = {bodyOf(normal(3*count))};
    BodyStep step(bodies);
    const Array forces(3*count), &x = bodies[0].places;
    StepSettings settings = {};
    settings.stepSize = 1;
    settings.scheme = Scheme::Implicit;
    const bool taken[] = {true};
    step.begin(x.data(), forces.data(), NULL, settings, taken);
    vector<CouplingTerm> terms(count);
    for (int i = 0; i < count; i++) {
        terms[i] = CouplingTerm();
        terms[i].node = i;
    }
    Array moves(3*TermBlocks::fill(count)), again(moves), given = normal(moves.size()), expected(3*count);
    step.setExpectedForces(expected.data());
    step.eliminate(terms.data(), count, moves.data());
    step.respond(given.data(), moves.data());
    Array kept = given;
    step.keepWhatMoves(kept.data());
    step.respond(kept.data(), again.data());
    double before = 0, after = 0, change = 0;
    Array twice = kept;
    step.keepWhatMoves(twice.data());
    for (int i = 0; i < 3*count; i++) {
        checkClose(moves[i], again[i], 1, 1e-9, "what moves is kept");
        checkClose(kept[i], twice[i], 1, 1e-9, "what is kept is kept again");
        before += given[i]*given[i];
        after += kept[i]*kept[i];
        change += fabs(given[i]-kept[i]);
    }
    check(change > 1 && after < before, "what moves nothing is taken off");
}

int main() {
    return runTests({
        testTurns,
        testFrames,
        testDiffusion,
        testTwoSprings,
        testWhatMoves
    }, {
        testTwoSpringsInShortSteps
    });
}
