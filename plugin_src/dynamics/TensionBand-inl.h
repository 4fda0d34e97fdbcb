// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Linear equations of the nodes y of chains and of the tensions T of their segments:
 *
 *     A y + sum_s T_s (0 ... -t_s t_s ... 0) = right,      t_s.(y_(s+1)-y_s) = compliance_s (T_s-start_s),
 *
 * with A symmetric, its 3x3 blocks coupling each node to the next two. Tensions are unknowns of their own, because a
 * stiff length inside of A would leave nothing of how a chain moves along itself but rounding errors.
 *
 * Nodes are eliminated from the first to the last, each with the tension before it: y_0; y_1, T_0; y_2, T_1; ... In a
 * ring, the first two nodes come last, and all others are coupled to them.
 */

/** What a node of a ring has besides that of an open chain: a matrix and a vector for each of the first two nodes. */
template <class Real, bool CLOSED> struct ToBorder {};
template <class Real> struct ToBorder<Real, true> {
    Matrix<Real> border[2];
};
template <class Real, bool CLOSED> struct TensionToBorder {};
template <class Real> struct TensionToBorder<Real, true> {
    Vector<Real> tensionBorder[2];
};

/** The equations of a node while they are gathered: its own block, and those to the next node and to the one after. */
template <class Real, bool CLOSED> struct BandRow : ToBorder<Real, CLOSED> {
    Symmetric<Real> diagonal;
    Matrix<Real> upper, second;
    Vector<Real> right;
};

/**
 * What elimination leaves of a node and of the tension T(-1) of the segment before it, in terms of the next two nodes
 * and of the tension T of the segment behind it. In a ring, y has the term -border[k] y_k as well, and T(-1) the term
 * tensionBorder[k].y_k, for k = 0 and 1.
 *
 *     y = solution-next y(+1)-second y(+2)+pull T,
 *     T(-1) = tension+first.y(+1)+last.y(+2)+share T.
 *
 * A force on the node alone moves it by its inverse, and changes T(-1) by its product with give; a unit of
 * compliance times start of T(-1) moves it by -give, and changes T(-1) by reciprocal. What depends on right sides is in
 * EliminatedRight: where there are many chains, all that is kept from one substitution to the next takes time to fetch.
 */
template <class Real, bool CLOSED> struct EliminatedPair : ToBorder<Real, CLOSED>, TensionToBorder<Real, CLOSED> {
    Symmetric<Real> inverse;
    Matrix<Real> next, second;
    Vector<Real> pull, first, last, give;
    Real share, reciprocal;
};

/** What depends on right sides of the same. */
template <class Real> struct EliminatedRight {
    Vector<Real> solution;
    Real tension;
};

/** What elimination leaves of a chain alone, in all lanes. */
template <class Many, class Real, bool CLOSED> CYLCHAIN_INLINE decltype(auto) inLanes(
        const EliminatedPair<Real, CLOSED>& pair) {
    if constexpr (std::is_same_v<Many, Real>)
        return (pair);
    else {
        EliminatedPair<Many, CLOSED> result;
        if constexpr (CLOSED)
            for (int k = 0; k < 2; k++) {
                result.border[k] = inLanes<Many>(pair.border[k]);
                result.tensionBorder[k] = inLanes<Many>(pair.tensionBorder[k]);
            }
        result.inverse = inLanes<Many>(pair.inverse);
        result.next = inLanes<Many>(pair.next);
        result.second = inLanes<Many>(pair.second);
        result.pull = inLanes<Many>(pair.pull);
        result.first = inLanes<Many>(pair.first);
        result.last = inLanes<Many>(pair.last);
        result.give = inLanes<Many>(pair.give);
        result.share = splat<Many>(pair.share);
        result.reciprocal = splat<Many>(pair.reciprocal);
        return result;
    }
}

/** The equation of the tension of a segment. */
template <class Real> struct TensionEquation {
    Vector<Real> direction;
    Real compliance, start;
};

/** What a substitution finds: nodes and tensions, what to add to them, or nodes alone. */
enum class Goal {Find, Add, Nodes};

#include "dynamics/TensionResponses-inl.h"

template <int W, bool CLOSED> class TensionBand {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef Symmetric<Real> Sym;
public:
    typedef BandRow<Real, CLOSED> Row;
    struct Memory {
        Scratch nodes, compliances, tensions;
    };
    TensionBand(const Pack& pack, Memory& memory) : pack(pack), n(pack.ownNodes()) {
        nodes = memory.nodes.template reserve<EliminatedPair<Real, CLOSED> >(n);
        compliances = memory.compliances.template reserve<Real>(n);
        tensions = memory.tensions.template reserve<Real>(n);
    }
    /** Begin to eliminate. Equations of tensions last until the next elimination or substitution of any pack. */
    void begin() {
        takeWorkspace();
        // There is no tension before the first node.
        link = Link {};
        link.resistance = splat<Real>(1);
    }
    /** Set the equation of the tension of a segment, before its first node is eliminated. */
    CYLCHAIN_INLINE void setTension(int s, const Vec& direction, Real compliance, Real start) {
        equations[s] = {direction, compliance, start};
        compliances[s] = compliance;
    }
    /**
     * Eliminate a node from the equations of the next ones. All that belongs to its row has been gathered.
     *
     * @param FOLLOWING   how many nodes follow in an open chain, or 2 if there are more
     */
    template <int FOLLOWING> CYLCHAIN_INLINE void eliminate(int node, Row& row, Row& next, Row& second) {
        if constexpr (CLOSED)
            eliminateOfRing(node, row, next, second);
        else
            eliminatePair<FOLLOWING>(node, row, next, second);
    }
    /** Eliminate the first two nodes of a ring, whose rows have been begun a second time behind the last node. */
    void close(const Row& first, const Row& second) {
        static_assert(CLOSED, "An open chain has no border");
        border[0].diagonal.add(first.diagonal);
        border[0].upper = border[0].upper+first.upper;
        border[0].right = border[0].right+first.right;
        border[1].diagonal.add(second.diagonal);
        border[1].right = border[1].right+second.right;
        link.first = link.first+link.border[0];
        link.last = link.border[1];
        Row none;
        eliminatePair<1>(0, border[0], border[1], none);
        eliminatePair<0>(1, border[1], none, none);
    }
    /**
     * Find nodes and tensions, or add them to what is there.
     *
     * @param y        those of a ring must have place for the first two nodes once more
     * @param GOAL     what to find, or add to
     * @param use      is called with the number of each segment and its tension, when its nodes have been found
     */
    template <Goal GOAL, class Function> CYLCHAIN_INLINE void substitute(Vec* y, Function use) {
        substitute<GOAL>(y, rights, use);
    }
    /** Find how forces on nodes move these, many of them on one chain alone: each in a lane of its own. */
    template <class Many> void respondToEach(const Vector<Many>* forces, Vector<Many>* moves) {
        static thread_local Scratch ofRights;
        EliminatedRight<Many>* const each = ofRights.template reserve<EliminatedRight<Many> >(n);
        setForcesOnNodes(forces, each);
        substitute<Goal::Nodes>(moves, each, [] (int, Real) {});
    }
    /** Find what nodes and tensions respond with to the right sides; those that have been found stay. */
    void respond(Vec* moves, Real* ofTensions) {
        std::swap(tensions, ofTensions);
        substitute<Goal::Find>(moves, [] (int, Real) {});
        std::swap(tensions, ofTensions);
    }
    /** Add a multiple of a response to what has been found. */
    template <class Function> void addResponse(const Vec* moves, const Real* ofTensions, Real factor, Vec* y,
            Function use) {
        for (int node = 0; node < pack.nodes; node++)
            y[node] = y[node]+moves[node]*factor;
        for (int s = 0; s < pack.segments; s++) {
            tensions[s] = tensions[s]+ofTensions[s]*factor;
            use(s, tensions[s]);
        }
    }
    /**
     * Take new right sides, and none of tensions, with the same elimination.
     *
     * @param forceOf   returns the force of each segment on its first node; its second node has the opposite one
     */
    template <class Function> CYLCHAIN_INLINE void setForces(Function forceOf) {
        Vec forceBefore = {}, ofBorder[2] = {};
        if constexpr (CLOSED) {
            const Vec force0 = forceOf(0), force1 = forceOf(1);
            ofBorder[0] = force0-forceOf(n-1);
            ofBorder[1] = force1-force0;
            forceBefore = force1;
        }
        takeWorkspace();
        setRightSides(ofBorder, rights, [&] (int node, Vec right) {
            right = right-forceBefore;
            if (CLOSED || node < n-1) {
                forceBefore = forceOf(node);
                right = right+forceBefore;
            }
            return right;
        });
    }
    /** The same with a force on each node. Those on the first two nodes of a ring may come a second time behind it. */
    CYLCHAIN_INLINE void setForcesOnNodes(const Vec* forces) {
        takeWorkspace();
        setForcesOnNodes(forces, rights);
    }
    /** Ask for the memory that begins an elimination, and what comes with it. */
    void prefetchElimination() const {
        prefetchFirst(nodes, n);
    }
    /** See TensionResponses-inl.h. */
    template <class Use> void findResponses(const Use& use) const {
        cylchain::CYLCHAIN_LOOPS::findResponses<W, CLOSED>(n, nodes, compliances, use);
    }
private:
    const Pack& pack;
    const int n;
    EliminatedPair<Real, CLOSED>* nodes;
    EliminatedRight<Real>* rights;
    TensionEquation<Real>* equations;
    Real *compliances, *tensions;
    struct BorderVectors {
        Vec border[2];
    };
    struct NoBorder {};
    /** The equation of the tension before a node, while it is gathered: resistance T = right+first.y+last.y(+1). */
    struct Link : std::conditional<CLOSED, BorderVectors, NoBorder>::type {
        Real resistance, right;
        Vec first, last;
    };
    Link link;
    Row border[CLOSED ? 2 : 1];

    /** Use memory that the packs of a thread share: substitution follows before another pack takes it. */
    void takeWorkspace() {
        static thread_local Scratch ofRights, ofEquations;
        rights = ofRights.template reserve<EliminatedRight<Real> >(n);
        equations = ofEquations.template reserve<TensionEquation<Real> >(n);
    }

    template <class Many> CYLCHAIN_INLINE void setForcesOnNodes(const Vector<Many>* forces,
            EliminatedRight<Many>* rights) {
        Vector<Many> ofBorder[2] = {};
        if constexpr (CLOSED)
            for (int k = 0; k < 2; k++)
                ofBorder[k] = forces[k]+forces[n+k];
        setRightSides(ofBorder, rights, [&] (int node, const Vector<Many>& right) {return right+forces[node];});
    }
    /** Begin the border of a ring with some right sides; a function adds what others have to what is there. */
    template <class Many, class Function> CYLCHAIN_INLINE void setRightSides(Vector<Many>* ofBorder,
            EliminatedRight<Many>* rights, Function added) {
        typedef Vector<Many> Vec;
        Vec here = {}, next = {};
        Many start = {};
        for (int node = CLOSED ? 2 : 0; node < n; node++) {
            if (node+2 < n)
                prefetch(&nodes[node+2]);
            decltype(auto) own = inLanes<Many>(nodes[node]);
            const Vec right = added(node, here);
            rights[node] = {own.inverse*right-own.give*start, own.reciprocal*start+own.give.dot(right)};
            if constexpr (CLOSED)
                for (int k = 0; k < 2; k++)
                    ofBorder[k] = ofBorder[k]-own.border[k].transposedTimes(right)-own.tensionBorder[k]*start;
            else if (node == n-1)
                return;
            here = next-own.next.transposedTimes(right)-own.first*start;
            next = -(own.second.transposedTimes(right)+own.last*start);
            // Less the solution along the segment behind it, since pull is the inverse times its direction.
            start = own.share*start-own.pull.dot(right);
        }
        if constexpr (CLOSED) {
            auto setRight = [&] (int node, const Vec& right) {
                decltype(auto) own = inLanes<Many>(nodes[node]);
                rights[node] = {own.inverse*right-own.give*start, own.reciprocal*start+own.give.dot(right)};
            };
            setRight(0, ofBorder[0]);
            decltype(auto) own = inLanes<Many>(nodes[0]);
            const Vec right = ofBorder[1]-own.next.transposedTimes(ofBorder[0])-own.first*start;
            start = own.share*start-own.pull.dot(ofBorder[0]);
            setRight(1, right);
        }
    }
    template <int FOLLOWING> CYLCHAIN_INLINE void eliminatePair(int node, const Row& row, Row& next, Row& second) {
        EliminatedPair<Real, CLOSED>& result = nodes[node];
        if (node+1 < n)
            prefetch(&nodes[node+1]);
        Sym inverse = inverseOfMobile(row.diagonal, property<Real>(pack, node, Pack::Mobile));
        const Vec raised = inverse*link.first;
        const Real reciprocal = 1/(link.resistance+link.first.dot(raised));
        const Vec give = raised*reciprocal;
        inverse.addOuter(-raised, give);
        const Vec solution = inverse*row.right-give*link.right;
        const Real tension = link.right*reciprocal+give.dot(row.right);
        result.inverse = inverse;
        result.give = give;
        result.reciprocal = reciprocal;
        rights[node] = {solution, tension};
        if (FOLLOWING == 0)
            return;
        const TensionEquation<Real>& behind = equations[node];
        const Vec t = behind.direction, lastBefore = link.last;
        const Vec pull = inverse*t;
        const Mat toNext = inverse*row.upper+Mat::outer(give, lastBefore);
        const Vec first = lastBefore*reciprocal-row.upper.transposedTimes(give);
        result.pull = pull;
        result.share = give.dot(t);
        result.next = toNext;
        result.first = first;
        next.right = next.right-row.upper.transposedTimes(solution)-lastBefore*tension;
        next.diagonal.subtractTransposedProduct(row.upper, toNext);
        next.diagonal.addOuter(lastBefore, first);
        link.resistance = behind.compliance+t.dot(pull);
        link.right = behind.compliance*behind.start-t.dot(solution);
        link.first = t+toNext.transposedTimes(t);
        if (FOLLOWING > 1) {
            const Mat toSecond = inverse*row.second;
            const Vec last = -row.second.transposedTimes(give);
            result.second = toSecond;
            result.last = last;
            link.last = toSecond.transposedTimes(t);
            next.upper = next.upper-row.upper.transposedTimes(toSecond)+Mat::outer(lastBefore, last);
            second.diagonal.subtractTransposedProduct(row.second, toSecond);
            second.right = second.right-row.second.transposedTimes(solution);
        }
        else {
            result.second = Mat {};
            result.last = Vec {};
            link.last = Vec {};
        }
    }
    void eliminateOfRing(int node, Row& row, Row& next, Row& second) {
        if (node < 2) {
            border[node].diagonal = row.diagonal;
            border[node].right = row.right;
            second.border[node] = row.second.transposed();
            if (node == 0)
                border[0].upper = row.upper;
            else {
                next.border[1] = row.upper.transposed();
                const TensionEquation<Real>& behind = equations[1];
                link = Link {};
                link.resistance = behind.compliance;
                link.right = behind.compliance*behind.start;
                link.first = behind.direction;
                link.border[1] = -behind.direction;
            }
            return;
        }
        // The nodes behind the last one are the first two.
        if (node == n-2) {
            row.border[0] = row.border[0]+row.second;
            row.second = Mat {};
        }
        if (node == n-1) {
            row.border[0] = row.border[0]+row.upper;
            row.border[1] = row.border[1]+row.second;
            row.upper = row.second = Mat {};
            link.border[0] = link.border[0]+link.last;
            link.last = Vec {};
        }
        const Link before = link;
        eliminatePair<2>(node, row, next, second);
        EliminatedPair<Real, CLOSED>& result = nodes[node];
        for (int k = 0; k < 2; k++) {
            const Mat coupling = result.inverse*row.border[k]+Mat::outer(result.give, before.border[k]);
            const Vec ofTension = before.border[k]*result.reciprocal-row.border[k].transposedTimes(result.give);
            result.border[k] = coupling;
            result.tensionBorder[k] = ofTension;
            next.border[k] = next.border[k]-row.upper.transposedTimes(coupling)+Mat::outer(before.last, ofTension);
            second.border[k] = second.border[k]-row.second.transposedTimes(coupling);
            border[k].diagonal.subtractTransposedProduct(row.border[k], coupling);
            border[k].diagonal.addOuter(before.border[k], ofTension);
            border[k].right =
                    border[k].right-row.border[k].transposedTimes(rights[node].solution)-
                    before.border[k]*rights[node].tension;
            link.border[k] = coupling.transposedTimes(equations[node].direction);
        }
        border[0].upper = border[0].upper-row.border[0].transposedTimes(result.border[1])+
                Mat::outer(before.border[0], result.tensionBorder[1]);
    }
    template <Goal GOAL, class Many, class Function> CYLCHAIN_INLINE void substitute(Vector<Many>* y,
                const EliminatedRight<Many>* rights, Function use) {
        constexpr bool WITH_TENSIONS = GOAL != Goal::Nodes;
        Vector<Many> next = {}, second = {};
        Many tension = {};
        if constexpr (CLOSED) {
            decltype(auto) own = inLanes<Many>(nodes[0]);
            const Vector<Many> found1 = rights[1].solution;
            const Many tension0 = rights[1].tension;
            const Vector<Many> found0 = rights[0].solution-own.next*found1+own.pull*tension0;
            const Many tensionLast = rights[0].tension+own.first.dot(found1)+own.share*tension0;
            if constexpr (WITH_TENSIONS) {
                tensions[0] = GOAL == Goal::Add ? tensions[0]+tension0 : tension0;
                tensions[n-1] = GOAL == Goal::Add ? tensions[n-1]+tensionLast : tensionLast;
            }
            tension = tensionLast;
            y[0] = GOAL == Goal::Add ? y[0]+found0 : found0;
            y[1] = GOAL == Goal::Add ? y[1]+found1 : found1;
            y[n] = y[0];
            y[n+1] = y[1];
            for (int node = n-1; node > 1; node--) {
                substitutePair<GOAL>(node, rights[node], found0, found1, next, second, tension, y);
                if constexpr (WITH_TENSIONS)
                    use(node, tensions[node]);
            }
            if constexpr (WITH_TENSIONS) {
                use(1, tensions[1]);
                use(0, tensions[0]);
            }
        }
        else
            for (int node = n-1; node >= 0; node--) {
                substitutePair<GOAL>(node, rights[node], next, next, next, second, tension, y);
                if constexpr (WITH_TENSIONS)
                    if (node < n-1)
                        use(node, tensions[node]);
            }
    }
    template <Goal GOAL, class Many> CYLCHAIN_INLINE void substitutePair(int node, const EliminatedRight<Many>& right,
                const Vector<Many>& found0, const Vector<Many>& found1, Vector<Many>& next, Vector<Many>& second,
                Many& tension, Vector<Many>* y) {
        decltype(auto) own = inLanes<Many>(nodes[node]);
        Vector<Many> here = right.solution;
        Many found = right.tension;
        if (CLOSED || node < n-1) {
            here = here-own.next*next-own.second*second+own.pull*tension;
            found = found+own.first.dot(next)+own.last.dot(second)+own.share*tension;
        }
        if constexpr (CLOSED) {
            here = here-own.border[0]*found0-own.border[1]*found1;
            found = found+own.tensionBorder[0].dot(found0)+own.tensionBorder[1].dot(found1);
        }
        y[node] = GOAL == Goal::Add ? y[node]+here : here;
        if constexpr (GOAL != Goal::Nodes)
            if (node > 0)
                tensions[node-1] = GOAL == Goal::Add ? tensions[node-1]+found : found;
        tension = found;
        second = next;
        next = here;
    }
};
