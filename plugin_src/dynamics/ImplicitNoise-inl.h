// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The random forces of an implicit step, which belong to friction, and the random values of coordinates.
 */

template <int W> class ImplicitNoise {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit ImplicitNoise(ImplicitState<W>& step) : step(step), pack(step.pack), segments(step.segments),
            random(step.random), amplitude(std::sqrt(2*step.settings.kT/step.h)) {
    }
    void draw() {
        const NoiseKey key = noiseKey(step.settings);
        const bool coordinatesOfNodes = Coordinates<W>::drawsWithNodes(pack);
        NoisePlaces<W> places = noisePlaces<W>(pack);
        PlaceNormals<Real> normals;
        for (int s = 0; s < step.n; s++, places.part += 1) {
            const bool ofNode = pack.hasNodeFriction && s < pack.ownNodes();
            if (ofNode || coordinatesOfNodes)
                drawNormals<W, 4>(key, NoiseKind::Node, places, normals.ofNode);
            if (ofNode)
                drawForceOnNode(normals.ofNode, s);
            if (pack.hasSegmentFriction && s < pack.segments) {
                drawNormals<W, 4>(key, NoiseKind::Segment, places, normals.ofSegment);
                drawForces(normals.ofSegment, s);
            }
            Coordinates<W>::draw(step, places, normals, s);
        }
    }
private:
    ImplicitState<W>& step;
    const Pack& pack;
    ImplicitSegment<Real>* const segments;
    Vec* const random;
    const Scalar amplitude;

    void drawForceOnNode(const Real* normals, int node) {
        const Real size = loaded<Real>(pack.rootNodeFriction, 0)*amplitude;
        random[node] = random[node]+nodeNoise<Real>(normals, pack.planar)*size;
    }
    CYLCHAIN_INLINE void drawForces(const Real* normals, int s) {
        ImplicitSegment<Real>& segment = segments[s];
        const Vec t = segment.tangent;
        Vec a, b;
        forceNoise<Real>(normals, pack.planar, a, b);
        const Real across = property<Real>(pack, s, Pack::RootPerpendicular);
        const Real along = property<Real>(pack, s, Pack::RootParallel);
        const Vec force = (a*across+t*((along-across)*t.dot(a)))*splat<Real>(Scalar(0.5)*amplitude);
        const Real perLength = amplitude/segment.length;
        const Vec pair = (b-t*t.dot(b))*(property<Real>(pack, s, Pack::RootRotational)*perLength);
        random[s] = random[s]+force-pair;
        random[s+1] = random[s+1]+force+pair;
        segment.randomForce = force;
        segment.randomPair = pair;
        segment.randomTension = t.dot(b)*(property<Real>(pack, s, Pack::RootExtensional)*perLength);
    }
};
