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
        Vec* f = vectors.reserve<Vec>(6*n);
        y = f+n;
        start = {y+n, y+2*n, tethers.reserve<TetherVector>(pack.tethers.size())};
        forcesOnNodes = y+3*n;
        movesOfNodes = y+4*n;
        gatherStepStart<W>(pack, positions, box, settings.flow.present, start);
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
    }
    void eliminate(const CouplingTerm* newTerms, int count, double* moves) override {
        terms = newTerms;
        numTerms = count;
        step->getEquations().setTerms(terms, numTerms);
        step->eliminate(y, iteration);
        gatherMoves(step->getChange(), moves);
    }
    void respond(const double* forces, double* moves) override {
        spreadForces(forces);
        step->getEquations().respond(forcesOnNodes, movesOfNodes);
        gatherMoves(movesOfNodes, moves);
    }
    void findCompliances(double* compliances) override {
        step->getEquations().findResponses(UseOfResponses<W, CLOSED, true>(terms, numTerms, compliances));
    }
    void advance(const double* forces, double share, bool* unfinished) override {
        spreadForces(forces);
        step->getEquations().setForcesOfOthers(forcesOnNodes);
        step->getEquations().addForcesOfOthers();
        step->advance(y, iteration, active*splat<Real>(share));
        step->getEquations().setForcesOfOthers(NULL);
        iteration++;
        Real still = active;
        if (iteration >= step->leastIterations())
            step->getConvergence().anyUnfinished(still);
        for (int i = 0; i < W; i++)
            unfinished[i] = lane(still, i) != 0;
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
    }
private:
    const Pack& pack;
    StepSettings settings;
    Scratch vectors, tethers;
    StepStart<W> start;
    Vec *y, *forcesOnNodes, *movesOfNodes;
    mutable Real active;
    typename ImplicitStep<W, CLOSED>::Memory memory;
    std::unique_ptr<ImplicitStep<W, CLOSED> > step;
    const CouplingTerm* terms;
    int numTerms, iteration;

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
    /** The coordinates of a node in a lane are this many numbers apart. */
    static Scalar* coordinates(Vec* vectors, const CouplingTerm& term) {
        return reinterpret_cast<Scalar*>(vectors+term.node)+term.lane;
    }
    void spreadForces(const double* forces) {
        for (int node = 0; node < pack.nodes; node++)
            forcesOnNodes[node] = Vec {};
        for (int i = 0; i < numTerms; i++) {
            const Scalar second = terms[i].fraction, first = 1-second;
            Scalar* const force = coordinates(forcesOnNodes, terms[i]);
            for (int k = 0; k < 3; k++) {
                force[k*W] += first*forces[3*i+k];
                force[(3+k)*W] += second*forces[3*i+k];
            }
        }
        if (pack.planar)
            for (int node = 0; node < pack.nodes; node++)
                forcesOnNodes[node].z = Real{};
    }
    void gatherMoves(Vec* ofNodes, double* moves) const {
        for (int i = 0; i < numTerms; i++) {
            const double second = terms[i].fraction, first = 1-second;
            const Scalar* const move = coordinates(ofNodes, terms[i]);
            for (int k = 0; k < 3; k++)
                moves[3*i+k] = first*move[k*W]+second*move[(3+k)*W];
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
