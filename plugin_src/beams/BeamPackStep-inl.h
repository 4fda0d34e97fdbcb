// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The step of a pack of beam chains that are coupled to others.
 */

template <int W> class BeamPackStep : public PackStep {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef SixVector<Real> Six;
public:
    explicit BeamPackStep(const BeamPack& pack) : pack(pack), terms(pack) {
    }
    void begin(const double* positions, const double* forces, const double* box, const StepSettings& stepSettings,
            const bool* taken) override {
        settings = stepSettings;
        const int n = pack.nodes;
        Six* const f = vectors.reserve<Six>(4*n);
        y = f+n;
        ofPlaces = f+2*n;
        moved = f+3*n;
        start = startMemory.reserve(pack);
        gatherBeams<W>(pack, positions, box, start);
        gatherBeamForces<W>(pack, forces, f);
        for (int i = 0; i < W; i++)
            lane(active, i) = taken[i] ? 1 : 0;
        step.reset(new BeamStep<W>(pack, settings, start, memory));
        step->begin(f, y);
    }
    int getNumStages() const override {
        return 1;
    }
    void beginStage(int) override {
        iteration = 0;
    }
    void eliminate(const CouplingTerm* newTerms, int count, double* moves) override {
        given = newTerms;
        joints = NULL;
        terms.set(newTerms, count);
        step->eliminate(y, &terms);
        terms.gather(step->getChange(), moves);
    }
    void respond(const double* forces, double* moves) override {
        respondAs(forces, moves);
    }
    void respond(const float* forces, float* moves) override {
        respondAs(forces, moves);
    }
    void findCompliances(double* compliances) override {
        terms.findCompliances(step->getEquations(), compliances);
    }
    bool needsJointStiffness() const override {
        return settings.kT > 0;
    }
    void setJointStiffness(const double* stiffness) override {
        const int count = terms.size();
        joints = jointMemory.reserve<CouplingTerm>(count);
        std::copy(given, given+count, joints);
        for (int i = 0; i < count; i++)
            std::copy(stiffness+6*i, stiffness+6*i+6, joints[i].stiffness);
    }
    void advance(const double* forces, const ShareOfChange& share, bool* unfinished, double* moves) override {
        if (forces != NULL)
            addForces(forces, moves);
        if (joints != NULL)
            softenJoints();
        step->advance(y, iteration, active*splat<Real>(share.part));
        iteration++;
        Real still = active;
        if (iteration >= LEAST_BEAM_ITERATIONS)
            step->anyUnfinished(still);
        for (int i = 0; i < W; i++)
            unfinished[i] = lane(still, i) != 0;
    }
    void findExcessiveChanges(bool* failed) const override {
        std::fill(failed, failed+W, false);
        step->findExcessiveChanges(y, failed);
    }
    void getPositions(const double* begun, double* positions) const override {
        forOwnParticles([&] (int k, double change) {
            positions[k] = begun[k]+change;
        });
    }
    void getDisplacements(double* displacements) const override {
        forOwnParticles([&] (int k, double change) {
            displacements[k] = change;
        });
    }
private:
    const BeamPack& pack;
    StepSettings settings;
    Scratch vectors;
    BeamStartMemory<W> startMemory;
    BeamStart<W> start;
    BeamTerms<W> terms;
    Six *y, *ofPlaces, *moved;
    Real active;
    typename BeamStep<W>::Memory memory;
    std::unique_ptr<BeamStep<W> > step;
    const CouplingTerm* given;
    /** The terms, softened; no std::vector, whose functions files for other instruction sets would share. */
    CouplingTerm* joints = NULL;
    Scratch jointMemory;
    int iteration;

    void addForces(const double* forces, double* moves) {
        terms.spread(forces, pack.nodes, ofPlaces);
        step->respond(ofPlaces, moved);
        Six* const change = step->getChange();
        for (int node = 0; node < pack.nodes; node++) {
            change[node].position = change[node].position+moved[node].position;
            change[node].control = change[node].control+moved[node].control;
        }
        terms.gather(change, moves);
    }
    template <class Number> void respondAs(const Number* forces, Number* moves) {
        terms.spread(forces, pack.nodes, ofPlaces);
        step->respond(ofPlaces, moved);
        terms.gather(moved, moves);
    }

    /**
     * Eliminate once more for the metric forces, which need to know how strains respond to tensions: with places that
     * were held as if what they are linked to could not move, bends of single elements would be 5 % too small.
     */
    void softenJoints() {
        Six* const change = step->getChange();
        std::copy(change, change+pack.nodes, moved);
        terms.set(joints, terms.size());
        step->eliminate(y, &terms);
        std::copy(moved, moved+pack.nodes, change);
        joints = NULL;
    }

    /** Call a function with each coordinate of the particles of active lanes, and how much that has changed. */
    template <class Function> void forOwnParticles(Function function) const {
        Real takes = active;
        for (int node = 0; node < pack.nodes; node++) {
            Vec changes[] = {y[node].position, y[node].position+y[node].control};
            for (int i = 0; i < W; i++) {
                if (node >= pack.ownNodes(i) || lane(takes, i) == 0)
                    continue;
                for (int which = 0; which < 2; which++) {
                    const int particle = pack.particles[(2*node+which)*W+i];
                    function(3*particle, lane(changes[which].x, i));
                    function(3*particle+1, lane(changes[which].y, i));
                    function(3*particle+2, lane(changes[which].z, i));
                }
            }
        }
    }
};
