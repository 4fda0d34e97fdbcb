// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The coordinates of chains: q of one to three nodes that lie next to each other, each with the energy
 * k q^2/2. What takes a step asks all kinds of these for the same. It knows none of them but lengths, whose tensions
 * are unknowns of its equations.
 *
 * A kind of coordinates is a struct in its own file, whose static functions have the names of those below; one that
 * lacks a function does not compile. It is on nodes, on segments or on joints: see CoordinateKind-inl.h, which also has
 * what most kinds do not need. What an implicit step keeps of them is in ImplicitState-inl.h. Forces between chains
 * are no coordinates but couplings: see ImplicitCouplings.h.
 */

#include "dynamics/coordinates/Lengths-inl.h"
#include "dynamics/coordinates/Bends-inl.h"
#include "dynamics/coordinates/RestBends-inl.h"
#include "dynamics/coordinates/AngularBends-inl.h"
#include "dynamics/coordinates/LinearBends-inl.h"
#include "dynamics/coordinates/Tethers-inl.h"

/** Some kinds of coordinates. Implicit steps call these functions in the order in which they stand here. */
template <class... Kinds> class CoordinateList {
public:
    /** Describe the coordinates of a place at the start of a step: their values, and theta. */
    template <class State> static CYLCHAIN_INLINE void describe(const State& step, int place) {
        ((has<Kinds>(step.pack, place) ? Kinds::describe(step, place) : void()), ...);
    }
    /** Whether normal numbers of nodes are needed to draw. */
    static bool drawsWithNodes(const Pack& pack) {
        return ((Kinds::DRAWS_WITH_NODES && Kinds::isIn(pack)) || ...);
    }
    /** Draw coordinates from equilibrium. */
    template <class State, class Places, class Normals> static CYLCHAIN_INLINE void draw(const State& step,
                const Places& places, const Normals& normals, int place) {
        ((has<Kinds>(step.pack, place) ? Kinds::draw(step, places, normals, place) : void()), ...);
    }
    /** Say what a stage makes of these. The second one begins with the end of the first, y. */
    template <class State, class Vec> static CYLCHAIN_INLINE void prepare(const State& step, const Vec* y, int place) {
        ((has<Kinds>(step.pack, place) ? Kinds::prepare(step, y, place) : void()), ...);
    }
    /** When the iteration of a stage ends. */
    static NewtonLimits limitsOf(const Pack& pack) {
        NewtonLimits limits;
        ((Kinds::isIn(pack) ? Kinds::setLimits(limits) : void()), ...);
        return limits;
    }
    /** What takes roots and divisions where the coordinates of a joint are linearised. They may be done ahead. */
    struct Factors : FactorsOf<Kinds>... {};
    template <class State, class Geometry> static CYLCHAIN_INLINE void describeNew(const State& step, int s,
                const Geometry& previous, const Geometry& current, Factors& factors) {
        ((Kinds::isIn(step.pack) ? Kinds::describeNew(step, s, previous, current,
                static_cast<FactorsOf<Kinds>&>(factors).own) : void()), ...);
    }
    /** Linearise the coordinates of a node, a segment or a joint, and add them to the equations of their nodes. */
    template <class Place, class State, class... Arguments> static CYLCHAIN_INLINE void add(const State& step,
                int place, Arguments&&... arguments) {
        (addIfOn<Place, Kinds>(step, place, arguments...), ...);
    }
    /** The stiffness with which coordinates keep a segment from turning, where that is more than its tension may be. */
    template <class Real> static CYLCHAIN_INLINE Real stiffnessAgainstTurning(const Pack& pack, int s) {
        return ((Kinds::isIn(pack) ? Kinds::template stiffnessAgainstTurning<Real>(pack, s) : Real{})+ ...);
    }
    /**
     * Raise what is one where the coordinates of a segment are as far from the solution as they may be.
     *
     * @param square      the square of the segment's change in the last iteration
     * @param perEnergy   one over the energy of the largest error
     */
    template <class State, class Real> static CYLCHAIN_INLINE void measure(const State& step, int s, Real square,
                Real perEnergy, Real& excess) {
        ((Kinds::isIn(step.pack) ? Kinds::measure(step, s, square, perEnergy, excess) : void()), ...);
    }
    /** Mark lanes in which a segment has changed more in the step than its coordinates may. */
    template <class State, class Vec> static CYLCHAIN_INLINE void findExcessiveChange(const State& step, const Vec* y,
                int s, bool* failed) {
        ((Kinds::isIn(step.pack) ? Kinds::findExcessiveChange(step, y, s, failed) : void()), ...);
    }
    /** Add the forces of the coordinates of a node, a segment or a joint, and their energies unless that is NULL. */
    template <class Place, class... Arguments> static CYLCHAIN_INLINE void addForces(const Pack& pack, int place,
                Arguments&&... arguments) {
        (addForcesIfOn<Place, Kinds>(pack, place, arguments...), ...);
    }
    /** Whether each bending model has one kind of coordinates. */
    static constexpr bool bendAllModels() {
        return countWhere<BendingModel>(isBentOnce) == countOf<BendingModel>();
    }
private:
    template <class Kind> static CYLCHAIN_INLINE bool has(const Pack& pack, int place) {
        return Kind::isIn(pack) && Kind::isAt(pack, place);
    }
    template <class Place, class Kind, class State, class... Arguments> static CYLCHAIN_INLINE void addIfOn(
                const State& step, int place, Arguments&&... arguments) {
        if constexpr (std::is_base_of<Place, Kind>::value)
            if (Kind::isIn(step.pack))
                Kind::add(step, place, arguments...);
    }
    template <class Place, class Kind, class... Arguments> static CYLCHAIN_INLINE void addForcesIfOn(const Pack& pack,
                int place, Arguments&&... arguments) {
        if constexpr (std::is_base_of<Place, Kind>::value)
            if (Kind::isIn(pack))
                Kind::addForces(pack, place, arguments...);
    }
    static constexpr bool isBentOnce(BendingModel model) {
        return ((Kinds::bends(model) ? 1 : 0)+ ...) == 1;
    }
};

/** All kinds of coordinates. */
template <int W> using Coordinates = CoordinateList<Lengths<W>, AngularBends<W>, LinearBends<W>, Tethers<W> >;

static_assert(Coordinates<1>::bendAllModels(), "Each bending model is that of one kind of coordinates");
