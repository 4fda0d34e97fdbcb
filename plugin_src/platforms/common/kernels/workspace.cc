/**
 * What a work-item knows of the chain that it computes, and its memory.
 *
 * Closed chains are unrolled as on the processor: their first two nodes come once more behind the last one.
 */

/** The constants of the stages of second order: see dynamics/ImplicitState-inl.h. */
#define DIAGONAL (1-0.70710678118654752440)
#define NOISE_OF_FIRST (DIAGONAL/(1-DIAGONAL))
#define TINY_NUMBER 1e-300
#define LEAST_NUMBER 1e-12

typedef struct {
    GLOBAL double* memory;
    GLOBAL const double* table;
    GLOBAL const double* positions;
    GLOBAL const double* flow;
    GLOBAL const double* box;
    GLOBAL const int* firstTethers;
    GLOBAL const double* tethers;
    GLOBAL double* tetherMemory;
#ifdef CHAIN_BY_GROUP
    LOCAL_ARG double* localMemory;
    LOCAL_ARG double* exchanged;
    LOCAL_ARG double* middle;
#endif
    size_t stride, tableStride;
    NoiseKey key;
    Vector shift, flowAtZero;
    double h, kT, nodeFriction;
    unsigned int chain;
    int nodes, own, segments, stage;
    bool twoStages, free, hasSegmentFriction, hasFlow, flowVaries, hasTethers, hasPropulsion, flowIsPeriodic, periodic;
} Step;

#ifdef CLOSED
#define NUM_FIELDS NUM_FIELDS_OF_RING
#else
#define NUM_FIELDS NUM_FIELDS_OF_OPEN_CHAIN
#endif
#define FIELD(field, place) loadField(step, field, place)
#define PROPERTY(property, place) step->table[(size_t) ((place)*NUM_PROPERTIES+(property))*step->tableStride]

#ifdef CHAIN_BY_GROUP
/**
 * Work-items of a group read the same field of neighbouring places together. As many fields as it has room for are in
 * the memory of the group: the last ones, which elimination leaves, and for which others wait.
 */
#define FIRST_LOCAL_FIELD (NUM_FIELDS-NUM_LOCAL_FIELDS)
#define PLACE_IN_LOCAL_MEMORY(field, place) step->localMemory[((field)-FIRST_LOCAL_FIELD)*NUM_PLACES+(place)]
#define PLACE_IN_MEMORY(field, place) step->memory[(field)*NUM_PLACES+(place)]

inline DEVICE double loadField(const Step* step, int field, int place) {
    if (field >= FIRST_LOCAL_FIELD)
        return PLACE_IN_LOCAL_MEMORY(field, place);
    return PLACE_IN_MEMORY(field, place);
}

inline DEVICE void storeField(const Step* step, int field, int place, double value) {
    if (field >= FIRST_LOCAL_FIELD)
        PLACE_IN_LOCAL_MEMORY(field, place) = value;
    else
        PLACE_IN_MEMORY(field, place) = value;
}
#else
#define PLACE_IN_MEMORY(field, place) step->memory[(size_t) ((place)*NUM_FIELDS+(field))*step->stride]

inline DEVICE double loadField(const Step* step, int field, int place) {
    return PLACE_IN_MEMORY(field, place);
}

inline DEVICE void storeField(const Step* step, int field, int place, double value) {
    PLACE_IN_MEMORY(field, place) = value;
}
#endif

inline DEVICE Vector loadVector(const Step* step, int field, int place) {
    return make_double3(FIELD(field, place), FIELD(field+1, place), FIELD(field+2, place));
}

inline DEVICE void storeVector(const Step* step, int field, int place, Vector v) {
    storeField(step, field, place, v.x);
    storeField(step, field+1, place, v.y);
    storeField(step, field+2, place, v.z);
}

inline DEVICE void addVector(const Step* step, int field, int place, Vector v) {
    storeVector(step, field, place, loadVector(step, field, place)+v);
}

inline DEVICE Matrix loadMatrix(const Step* step, int field, int place) {
    Matrix m;
    m.x = loadVector(step, field, place);
    m.y = loadVector(step, field+3, place);
    m.z = loadVector(step, field+6, place);
    return m;
}

inline DEVICE void storeMatrix(const Step* step, int field, int place, Matrix m) {
    storeVector(step, field, place, m.x);
    storeVector(step, field+3, place, m.y);
    storeVector(step, field+6, place, m.z);
}

inline DEVICE Symmetric loadSymmetric(const Step* step, int field, int place) {
    Symmetric m = {FIELD(field, place), FIELD(field+1, place), FIELD(field+2, place), FIELD(field+3, place),
            FIELD(field+4, place), FIELD(field+5, place)};
    return m;
}

inline DEVICE void storeSymmetric(const Step* step, int field, int place, Symmetric m) {
    storeField(step, field, place, m.xx);
    storeField(step, field+1, place, m.yx);
    storeField(step, field+2, place, m.yy);
    storeField(step, field+3, place, m.zx);
    storeField(step, field+4, place, m.zy);
    storeField(step, field+5, place, m.zz);
}

/** A vector without its part across the plane of chains that stay in one. */
inline DEVICE Vector inSpace(Vector v) {
#ifdef PLANAR
    v.z = 0;
#endif
    return v;
}

/** How much of the forces that last for the whole step a stage has, and of its noise. */
inline DEVICE double shareOfForces(const Step* step) {
    return step->stage == FIRST_STAGE ? DIAGONAL : 1;
}

inline DEVICE double shareOfNoise(const Step* step) {
    return step->stage == FIRST_STAGE ? NOISE_OF_FIRST : 1;
}

inline DEVICE Vector tangentAtStart(const Step* step, int s) {
    return loadVector(step, DIFFERENCE, s)*FIELD(INVERSE_LENGTH, s);
}

/** The velocity of the flow at a place; that of the part that is the same everywhere belongs to the chain. */
inline DEVICE Vector flowAt(const Step* step, Vector x) {
    GLOBAL const double* g = step->flow+FLOW_GRADIENT;
    return inSpace(step->flowAtZero+make_double3(x.x*g[0]+x.y*g[1]+x.z*g[2], x.x*g[3]+x.y*g[4]+x.z*g[5],
            x.x*g[6]+x.y*g[7]+x.z*g[8]));
}

/** Let the flow be that for the image of a chain whose first node is nearest to the origin. */
inline DEVICE void beginFlow(Step* step, Vector first) {
    GLOBAL const double* flow = step->flow;
    Vector r = first-make_double3(flow[FLOW_ORIGIN], flow[FLOW_ORIGIN+1], flow[FLOW_ORIGIN+2]);
    if (step->flowIsPeriodic)
        r = nearestImage(r, step->box);
    r = r-first;
    GLOBAL const double* g = flow+FLOW_GRADIENT;
    step->flowAtZero = make_double3(flow[0]+g[0]*r.x+g[1]*r.y+g[2]*r.z, flow[1]+g[3]*r.x+g[4]*r.y+g[5]*r.z,
            flow[2]+g[6]*r.x+g[7]*r.y+g[8]*r.z);
}

inline DEVICE Vector positionOf(const Step* step, int node) {
    int place = 3*(node%step->own);
    return make_double3(step->positions[place], step->positions[place+1], step->positions[place+2]);
}

/** The vector of a segment where its chain is. */
inline DEVICE Vector vectorOfSegment(const Step* step, int s) {
    Vector d = positionOf(step, s+1)-positionOf(step, s);
    if (step->periodic)
        d = nearestImage(d, step->box);
    return inSpace(d);
}

/** The vector from the point of a tether to its node. */
inline DEVICE Vector vectorOfTether(const Step* step, int node, int tether) {
    GLOBAL const double* own = step->tethers+(size_t) tether*NUM_TETHER_PROPERTIES;
    Vector d = positionOf(step, node)+step->shift-make_double3(own[0], own[1], own[2]);
    if (step->periodic)
        d = nearestImage(d, step->box);
    return inSpace(d);
}
