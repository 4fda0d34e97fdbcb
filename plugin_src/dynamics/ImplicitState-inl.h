// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What an implicit step keeps of segments, of joints and of tethers while it is taken, and the forces of its stages.
 */

#include "dynamics/coordinates/CoordinateKind-inl.h"

/** What all iterations of a step look at in a segment, and in the joint with the segment before. */
template <class Real> struct IteratedSegment {
    // At the start: the vector, its direction and length, and where a bend turns around.
    Vector<Real> difference, tangent, bisector;
    Real length, inverse;
    // What a stage makes of noise and of theta: T = k (implicit q(y)+constant), with a part of the bend that turns with
    // the joint.
    Vector<Real> constantBend, turningBend;
    Real implicit, constantCoordinate, constantTension, jointImplicit;
    // Of the last iteration or stage: the direction of the new segment, its tension and how the tension changes.
    Vector<Real> newTangent;
    Real tension, response, multiplier, extra, tensionOfFlow;
    // The part of the response that stays with the nodes; what the direction of the tension lacks of the mean one; and
    // the tension that it was given.
    Real shift, multiplierBefore;
    Vector<Real> turned;
};

/** What a step keeps of a segment, and of the joint with the segment before. */
template <class Real> struct ImplicitSegment : IteratedSegment<Real> {
    // At the start: the coordinate of the length, and the bend.
    Vector<Real> bend;
    Real coordinate;
    // The noise, and theta of the segment and of the joint.
    Vector<Real> randomBend, randomForce, randomPair, metricForce;
    Real randomCoordinate, randomTension, theta, jointTheta;
};

/** What a step keeps of the twist of a joint, and of the segment behind it: see ImplicitTwist-inl.h. */
template <class Real> struct TwistedJoint {
    // The torque is implicit times the change of the twist, and constant.
    Real implicit, constant;
    // What joins the turns of both segments: implicit, less the friction of hands against both.
    Real coupling;
    // Of the segment: its friction over the step, the random torque, and what the elimination leaves.
    Real friction, random, inversePivot, border;
    // What this joint has of all torques when each twist changes by as much.
    Real share;
    // For some new nodes: the torque, how the segment turns.
    Real torque, turn;
    // In the middle of the step: half the curvature binormal, and one over one plus the cosine of the joint.
    Vector<Real> curvature;
    Real perCosine;
};

/** What a step keeps of a joint that is bent at rest: see coordinates/RestBends-inl.h. */
template <class Real> struct RestBend {
    // Where the first axis of the material is half-way over the joint at the start, and the bend at rest there.
    Vector<Real> axis, bend;
};

/** The vector from the point of a tether to its node. */
struct TetherVector {
    double d[3];
};

/**
 * What a step keeps of a tether: the vector from its point to its node at the start, its noise, and the same of a
 * stage.
 */
struct ImplicitTether {
    double start[3], random[3], theta;
    double constant[3], implicit;
};

/**
 * What a step begins with: the vectors of the segments and those of tethers. In single precision, they say more than
 * the nodes, which may be far from the origin: only a flow looks at these.
 */
template <int W> struct StepStart {
    Vector<typename Lanes<W>::Type> *nodes, *segments;
    TetherVector* tethers;
    /** By how much joints are twisted more than at rest, if they can be. */
    typename Lanes<W>::Type* twists = NULL;
    /**
     * For chains with twist, the vectors of segments in double precision, and if these are those before a step of which
     * this is a part, how far the nodes have moved since then, or NULL.
     */
    const Vector<typename DoubleLanes<W>::Type>* exact = NULL;
    const Vector<typename Lanes<W>::Type>* moved = NULL;
};

/** The stages that steps are made of: the one of scheme "implicit", and the two of second order. */
enum class Stage {Only, First, Second};
/**
 * The stages of second order are those of the L-stable singly diagonally implicit method, with this on the diagonal.
 */
const Scalar DIAGONAL = 1-M_SQRT1_2;
/** The first stage has this part of the noise, and its end is where that of the second begins. */
const Scalar NOISE_OF_FIRST = DIAGONAL/(1-DIAGONAL);

/** What the parts of an implicit step share: the start of the step, its unknowns and its forces. */
template <int W> class ImplicitState {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    struct Memory {
        Scratch segments, vectors, tethers, joints, newSegments, gradients, responses, restBends;
    };
    ImplicitState(const Pack& pack, const StepSettings& settings, const StepStart<W>& start, Memory& memory) :
            pack(pack), settings(settings), start(start), n(pack.nodes), h(settings.stepSize), kT(settings.kT),
            twoStages(settings.scheme == Scheme::ImplicitSecondOrder),
            segments(memory.segments.template reserve<ImplicitSegment<Real> >(n)),
            tethers(memory.tethers.template reserve<ImplicitTether>(pack.tethers.size())),
            f(memory.vectors.template reserve<Vec>(7*n)),
            loads(settings.flow.present || pack.twist.isPresent() ? f+3*n : f), change(f+n), rest(f+2*n),
            external(twoStages ? f+4*n : f), random(twoStages ? f+5*n : f), drift(twoStages ? f+6*n : f),
            joints(memory.joints.template reserve<TwistedJoint<Real> >(pack.twist.isPresent() ? n : 0)),
            newSegments(memory.newSegments.template reserve<NewSegmentGeometry<Real> >(
                    pack.twist.isPresent() ? n : 0)),
            gradient(memory.gradients.template reserve<Vec>(pack.twist.isHeld ? 3*n : 0)),
            responsesOfTensions(memory.responses.template reserve<Real>(pack.twist.isHeld ? n : 0)),
            restBends(memory.restBends.template reserve<RestBend<Real> >(pack.twist.isBentAtRest() ? n : 0)) {
    }
    const Pack& pack;
    const StepSettings& settings;
    const StepStart<W>& start;
    const int n;
    const Scalar h, kT;
    const bool twoStages;
    ImplicitSegment<Real>* const segments;
    ImplicitTether* const tethers;
    // All forces of a stage, the same with the drag of the flow, the changes of an iteration, and memory of its own.
    Vec *const f, *const loads, *const change, *const rest;
    // Forces from outside, of noise and the metric ones; all of them are f if there is one stage alone.
    Vec *const external, *const random, *const drift;
    // Of twist, if there is any, with the segments of an iteration; the others are the gradient of what a chain shares,
    // memory of its own, and how tensions respond to that gradient.
    TwistedJoint<Real>* const joints;
    NewSegmentGeometry<Real>* const newSegments;
    Vec* const gradient;
    Real* const responsesOfTensions;
    RestBend<Real>* const restBends;
    Stage stage = Stage::Only;
    /** How much of the forces that last for the whole step a stage has. */
    Scalar shareOfForces() const {
        return stage == Stage::First ? DIAGONAL : 1;
    }
    /** Add the forces of a stage. */
    void combineForces() {
        if (!twoStages)
            return;
        const Real ofForces = splat<Real>(shareOfForces());
        const Real ofNoise = splat<Real>(stage == Stage::First ? NOISE_OF_FIRST : 1);
        for (int node = 0; node < n; node++)
            f[node] = external[node]*ofForces+random[node]*ofNoise+drift[node]*(ofNoise*ofNoise);
    }
};
