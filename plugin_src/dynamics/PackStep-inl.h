// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The implicit step of a pack whose chains are coupled to others.
 */

template <int W, bool CLOSED> class ImplicitPackStep : public PackStep {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit ImplicitPackStep(const Pack& pack) : pack(pack) {
    }
    void begin(const double* positions, const double* forces, const double* box, const StepSettings& stepSettings,
            const bool* taken) override {
        settings = stepSettings;
        const int n = pack.nodes;
        Vec* f = vectors.reserve<Vec>(4*n);
        y = f+n;
        start = {y+n, y+2*n, tethers.reserve<TetherVector>(pack.tethers.size())};
        gatherStepStart<W>(pack, positions, box, settings, twists, start);
        turned = twists.reserveChanges<W>(pack);
        gatherForces<W>(pack, forces, f);
        for (int i = 0; i < W; i++)
            lane(active, i) = taken[i] ? 1 : 0;
        step.reset(new ImplicitStep<W, CLOSED>(pack, settings, start, memory));
        step->begin(f, y);
    }
    int getNumStages() const override {
        return step->getNumStages();
    }
    void beginStage(int stage) override {
        step->beginStage(stage, y);
        for (int node = 0; node < pack.nodes; node++)
            y[node] = y[node]*active;
        iteration = 0;
        changeBefore = Real{};
    }
    void eliminate(const CouplingTerm* newTerms, int count, double* moves) override {
        terms = newTerms;
        numTerms = count;
        // What fills up the last block is on nodes behind the last one.
        placed.assign(TermBlocks::fill(count), PlacedTerm {W*pack.nodes, 0, 0});
        for (int i = 0; i < count; i++)
            placed[i] = {W*terms[i].node+terms[i].lane, Scalar(1-terms[i].fraction), Scalar(terms[i].fraction)};
        step->getEquations().setTerms(terms, numTerms);
        step->eliminate(y, iteration);
        takeWorkspace();
        gatherMoves(step->getChange(), moves);
    }
    void prefetchStart() const override {
        step->prefetchStart();
        prefetchFirst(y, pack.nodes);
    }
    void prefetchElimination() const override {
        step->getEquations().prefetchElimination();
    }
    void respond(const double* forces, double* moves) override {
        respondAs(forces, moves);
    }
    void respond(const float* forces, float* moves) override {
        respondAs(forces, moves);
    }
    void respondToEach(const double* forces, double* moves, int count, std::size_t size) override {
        respondToEachAs(forces, moves, count, size);
    }
    void respondToEach(const float* forces, float* moves, int count, std::size_t size) override {
        respondToEachAs(forces, moves, count, size);
    }
    void findCompliances(double* compliances) override {
        step->getEquations().findResponses(UseOfResponses<W, CLOSED, true>(terms, numTerms, compliances));
    }
    void advance(const double* forces, const ShareOfChange& share, bool* unfinished, double* moves) override {
        takeWorkspace();
        if (forces != NULL && numTerms > 0) {
            spreadForces(forces);
            step->getEquations().setForcesOfOthers(forcesOnNodes);
            step->getEquations().addForcesOfOthers();
            gatherMoves(step->getChange(), moves);
        }
        step->advance(y, iteration, active*shareOf(share));
        step->getEquations().setForcesOfOthers(NULL);
        iteration++;
        for (int i = 0; i < W; i++)
            unfinished[i] = lane(active, i) != 0;
        if (iteration < step->leastIterations())
            return;
        Real change = step->getConvergence().findLastChange();
        for (int i = 0; i < W; i++)
            unfinished[i] &= !isLastChange(lane(change, i), lane(changeBefore, i), 1);
        changeBefore = change;
    }
    void findExcessiveChanges(bool* failed) const override {
        for (int i = 0; i < W; i++)
            failed[i] = false;
        step->getConvergence().findExcessiveChanges(y, failed);
    }
    void getPositions(const double* begun, double* positions) const override {
        forOwnNodes([&] (int k, double moved) {
            positions[k] = begun[k]+moved;
        });
    }
    void getDisplacements(double* displacements) const override {
        forOwnNodes([&] (int k, double moved) {
            displacements[k] = moved;
        });
        if (!pack.twist.isPresent())
            return;
        step->findTwists(y, turned);
        bool taken[W];
        for (int i = 0; i < W; i++)
            taken[i] = lane(active, i) != 0;
        scatterTwists<W>(pack, settings, turned, taken);
    }
private:
    const Pack& pack;
    StepSettings settings;
    Scratch vectors, tethers;
    TwistMemory twists;
    StepStart<W> start;
    typename DoubleLanes<W>::Type* turned;
    /** A vector of a node in a lane, and a fourth number that is not used. */
    typedef FourOf<Scalar> Record;
    Vec *y, *forcesOnNodes, *movesOfNodes;
    Record* records;
    mutable Real active;
    /** What findLastChange() has found in the iteration before. */
    Real changeBefore;
    typename ImplicitStep<W, CLOSED>::Memory memory;
    std::unique_ptr<ImplicitStep<W, CLOSED> > step;
    const CouplingTerm* terms;
    int numTerms, iteration;
    /** Where the terms are: the record of the first node, W before that of the second one, and the parts of both. */
    struct PlacedTerm {
        int first;
        Scalar ofFirst, ofSecond;
    };
    std::vector<PlacedTerm> placed;

    /** Call a function with each coordinate of the nodes of active lanes, and how much that has changed. */
    template <class Function> CYLCHAIN_INLINE void forOwnNodes(Function function) const {
        forPlacesOfLanes<W>(pack.ownNodes(), [&] (int node, int i) {
            const int particle = pack.particles[node*W+i];
            if (particle >= 0 && lane(active, i) != 0) {
                function(3*particle, lane(y[node].x, i));
                function(3*particle+1, lane(y[node].y, i));
                function(3*particle+2, lane(y[node].z, i));
            }
        });
    }
    Real shareOf(const ShareOfChange& share) {
        const Real part = splat<Real>(share.part);
        if (iteration == 0 || !(share.largestTurn < HUGE_VAL))
            return part;
        const Vec* const change = step->getChange();
        Real largest = Real{};
        for (int s = 0; s < pack.segments; s++) {
            const Vec difference = change[s+1]-change[s];
            const Real inverse = property<Real>(pack, s, Pack::InverseRestLength);
            largest = larger<Real>(largest, difference.dot(difference)*(inverse*inverse));
        }
        const Real turn = splat<Real>(share.largestTurn);
        return part*(turn/larger<Real>(root(largest), turn));
    }
    /** Use memory that the packs of a thread share: it stays in the nearest cache. */
    void takeWorkspace() {
        static thread_local Scratch memory, ofRecords;
        forcesOnNodes = memory.reserve<Vec>(2*pack.nodes);
        movesOfNodes = forcesOnNodes+pack.nodes;
        records = ofRecords.reserve<Record>((std::size_t) W*(pack.nodes+2));
    }
    template <class Number> void respondAs(const Number* forces, Number* moves) {
        takeWorkspace();
        spreadForces(forces);
        step->getEquations().respond(forcesOnNodes, movesOfNodes);
        gatherMoves(movesOfNodes, moves);
    }
    template <class Number> void respondToEachAs(const Number* forces, Number* moves, int count, std::size_t size) {
        if constexpr (W > 1)
            PackStep::respondToEach(forces, moves, count, size);
        else
            // A chain alone leaves lanes for forces.
            for (int first = 0; first < count; first += CYLCHAIN_LANES)
                respondInLanes(forces+first*size, moves+first*size, std::min(count-first, CYLCHAIN_LANES), size);
    }
    template <class Number> void respondInLanes(const Number* forces, Number* moves, int count, std::size_t size) {
        typedef typename Lanes<CYLCHAIN_LANES>::Type Many;
        static thread_local Scratch memory;
        // What fills up blocks of terms is on nodes behind the last one.
        Vector<Many>* const onNodes = memory.reserve<Vector<Many> >(2*((std::size_t) pack.nodes+2));
        Vector<Many>* const ofNodes = onNodes+pack.nodes+2;
        std::fill(onNodes, onNodes+pack.nodes+2, Vector<Many> {});
        for (int term = 0; term < numTerms; term++) {
            Vector<Many> force = {};
            for (int i = 0; i < count; i++) {
                const Number* const own = forces+i*size;
                lane(force.x, i) = own[TermBlocks::place(term, 0)];
                lane(force.y, i) = own[TermBlocks::place(term, 1)];
                if (!pack.planar)
                    lane(force.z, i) = own[TermBlocks::place(term, 2)];
            }
            Vector<Many>* const at = onNodes+placed[term].first;
            at[0] = at[0]+force*splat<Many>(placed[term].ofFirst);
            at[1] = at[1]+force*splat<Many>(placed[term].ofSecond);
        }
        step->getEquations().respondToEach(onNodes, ofNodes);
        for (int term = 0; term < numTerms; term++) {
            const Vector<Many>* const at = ofNodes+placed[term].first;
            Vector<Many> move = at[0]*splat<Many>(placed[term].ofFirst)+at[1]*splat<Many>(placed[term].ofSecond);
            for (int i = 0; i < count; i++) {
                Number* const own = moves+i*size;
                own[TermBlocks::place(term, 0)] = lane(move.x, i);
                own[TermBlocks::place(term, 1)] = lane(move.y, i);
                own[TermBlocks::place(term, 2)] = lane(move.z, i);
            }
        }
    }
    /** Bring the records of a node into lanes, and back. */
    static CYLCHAIN_INLINE void toVector(const Record* own, Vec& vector) {
        Scalar* const numbers = reinterpret_cast<Scalar*>(&vector);
        if constexpr (W == 1)
            for (int k = 0; k < 3; k++)
                numbers[k] = own[0][k];
        else
            for (int i = 0; i < W; i += 4) {
                Record rows[] = {own[i], own[i+1], own[i+2], own[i+3]};
                transpose<Scalar>(rows);
                for (int k = 0; k < 3; k++)
                    storeFour(rows[k], numbers+W*k+i);
            }
    }
    static CYLCHAIN_INLINE void toRecords(const Vec& vector, Record* own) {
        const Scalar* const numbers = reinterpret_cast<const Scalar*>(&vector);
        if constexpr (W == 1)
            own[0] = Record {numbers[0], numbers[1], numbers[2], 0};
        else
            for (int i = 0; i < W; i += 4) {
                Record rows[4] = {};
                for (int k = 0; k < 3; k++)
                    rows[k] = loadFour(numbers+W*k+i);
                transpose<Scalar>(rows);
                for (int k = 0; k < 4; k++)
                    own[i+k] = rows[k];
            }
    }
    template <class Number> void spreadForces(const Number* forces) {
        std::fill(records, records+W*(pack.nodes+2), Record {});
        for (int term = 0; term < numTerms; term += TermBlocks::SIZE) {
            Record rows[4] = {};
            for (int k = 0; k < 3; k++)
                rows[k] = __builtin_convertvector(loadFour(forces+TermBlocks::place(term, k)), Record);
            transpose<Scalar>(rows);
            for (int i = 0; i < TermBlocks::SIZE; i++) {
                const PlacedTerm& place = placed[term+i];
                records[place.first] += rows[i]*place.ofFirst;
                records[place.first+W] += rows[i]*place.ofSecond;
            }
        }
        for (int node = 0; node < pack.nodes; node++) {
            toVector(records+W*node, forcesOnNodes[node]);
            if (pack.planar)
                forcesOnNodes[node].z = Real{};
        }
    }
    template <class Number> void gatherMoves(const Vec* ofNodes, Number* moves) {
        if (numTerms == 0)
            return;
        for (int node = 0; node < pack.nodes; node++)
            toRecords(ofNodes[node], records+W*node);
        std::fill(records+W*pack.nodes, records+W*(pack.nodes+2), Record {});
        for (int term = 0; term < numTerms; term += TermBlocks::SIZE) {
            Record rows[4];
            for (int i = 0; i < TermBlocks::SIZE; i++) {
                const PlacedTerm& place = placed[term+i];
                rows[i] = records[place.first]*place.ofFirst+records[place.first+W]*place.ofSecond;
            }
            transpose<Scalar>(rows);
            for (int k = 0; k < 3; k++)
                storeFour(__builtin_convertvector(rows[k], FourOf<Number>), moves+TermBlocks::place(term, k));
        }
    }
};

template <int W> PackStep* newPackStep(const Pack& pack) {
#ifndef CYLCHAIN_SINGLE_PRECISION
    if (pack.closed)
        return new ImplicitPackStep<W, true>(pack);
#endif
    return new ImplicitPackStep<W, false>(pack);
}
