/**
 * The loops over the segments of a pack. This file is compiled once for each instruction set, into a namespace of its
 * own, CYLCHAIN_LOOPS, so that no function of one is used by another, and for up to CYLCHAIN_LANES lanes.
 */

#include "ChainPack.h"
#include "Gaussian.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <type_traits>

namespace cylchain {
namespace CYLCHAIN_LOOPS {

// Called functions cannot keep vectors in registers.
#define CYLCHAIN_INLINE inline __attribute__((always_inline))

template <int W> struct Lanes {
    typedef double Type __attribute__((vector_size(8*W)));
    typedef std::uint64_t Bits __attribute__((vector_size(8*W)));
};
template <> struct Lanes<1> {
    typedef double Type;
    typedef std::uint64_t Bits;
};

template <class Real> CYLCHAIN_INLINE double& lane(Real& value, int i) {
    return reinterpret_cast<double*>(&value)[i];
}

template <class Real> CYLCHAIN_INLINE Real root(Real value) {
    Real result;
    for (int i = 0; i < (int) (sizeof(Real)/sizeof(double)); i++)
        lane(result, i) = std::sqrt(lane(value, i));
    return result;
}

template <class Real> struct Vector {
    Real x, y, z;
    CYLCHAIN_INLINE Vector operator+(const Vector& v) const {return {x+v.x, y+v.y, z+v.z};}
    CYLCHAIN_INLINE Vector operator-(const Vector& v) const {return {x-v.x, y-v.y, z-v.z};}
    CYLCHAIN_INLINE Vector operator*(Real s) const {return {x*s, y*s, z*s};}
    CYLCHAIN_INLINE Real dot(const Vector& v) const {return x*v.x+y*v.y+z*v.z;}
};

template <class Real> CYLCHAIN_INLINE Vector<Real> crossProduct(const Vector<Real>& a, const Vector<Real>& b) {
    return {a.y*b.z-a.z*b.y, a.z*b.x-a.x*b.z, a.x*b.y-a.y*b.x};
}

/** A symmetric 3x3 matrix. */
template <class Real> struct Symmetric {
    Real xx, yx, yy, zx, zy, zz;
    Vector<Real> operator*(const Vector<Real>& v) const {
        return {xx*v.x+yx*v.y+zx*v.z, yx*v.x+yy*v.y+zy*v.z, zx*v.x+zy*v.y+zz*v.z};
    }
    /** Add s 1 + r tt. */
    void addAxial(Real s, Real r, const Vector<Real>& t) {
        const Vector<Real> rt = t*r;
        xx += s+rt.x*t.x;
        yx += rt.y*t.x;
        yy += s+rt.y*t.y;
        zx += rt.z*t.x;
        zy += rt.z*t.y;
        zz += s+rt.z*t.z;
    }
    Symmetric operator-(const Symmetric& m) const {
        return {xx-m.xx, yx-m.yx, yy-m.yy, zx-m.zx, zy-m.zy, zz-m.zz};
    }
    Symmetric inverse(Real scale) const {
        Symmetric c = {yy*zz-zy*zy, zx*zy-yx*zz, xx*zz-zx*zx, yx*zy-yy*zx, yx*zx-xx*zy, xx*yy-yx*yx};
        const Real factor = scale/(xx*c.xx+yx*c.yx+zx*c.zx);
        return {c.xx*factor, c.yx*factor, c.yy*factor, c.zx*factor, c.zy*factor, c.zz*factor};
    }
};

#include "Matrix.h"

/** Memory that a thread keeps between calls, aligned for vector registers. */
class Scratch {
public:
    ~Scratch() {
        std::free(data);
    }
    template <class T> T* reserve(std::size_t count) {
        const std::size_t bytes = (count*sizeof(T)+63)/64*64;
        if (bytes > size) {
            std::free(data);
            data = std::aligned_alloc(64, bytes);
            if (data == NULL)
                throw std::bad_alloc();
            size = bytes;
        }
        return static_cast<T*>(data);
    }
private:
    void* data = NULL;
    std::size_t size = 0;
};

template <class Real> CYLCHAIN_INLINE Real loaded(const std::vector<double>& values, std::size_t index) {
    Real result;
    for (int i = 0; i < (int) (sizeof(Real)/sizeof(double)); i++)
        lane(result, i) = values[index*(sizeof(Real)/sizeof(double))+i];
    return result;
}

/** Bring an array of three doubles for each particle into lanes. */
template <int W> void gather(const ChainPack& pack, const double* values, Vector<typename Lanes<W>::Type>* result) {
    for (int node = 0; node < pack.nodes; node++)
        for (int i = 0; i < W; i++) {
            const int particle = pack.particles[node*W+i];
            if (particle < 0) {
                lane(result[node].x, i) = lane(result[node].y, i) = lane(result[node].z, i) = 0;
                continue;
            }
            lane(result[node].x, i) = values[3*particle];
            lane(result[node].y, i) = values[3*particle+1];
            lane(result[node].z, i) = values[3*particle+2];
        }
}

/** Bring forces into lanes: once for nodes that come twice, and in the plane for chains that stay there. */
template <int W> void gatherForces(const ChainPack& pack, const double* forces, Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    gather<W>(pack, forces, f);
    for (int node = pack.ownNodes(); node < pack.nodes; node++)
        f[node] = Vector<Real> {};
    if (pack.planar)
        for (int node = 0; node < pack.nodes; node++)
            f[node].z = Real{};
}

/** Write vectors, times a factor, to an array of three doubles for each particle. */
template <int W> void scatter(const ChainPack& pack, Vector<typename Lanes<W>::Type>* values, double factor, double* result) {
    for (int node = 0; node < pack.ownNodes(); node++)
        for (int i = 0; i < W; i++) {
            const int particle = pack.particles[node*W+i];
            if (particle >= 0) {
                result[3*particle] = factor*lane(values[node].x, i);
                result[3*particle+1] = factor*lane(values[node].y, i);
                result[3*particle+2] = factor*lane(values[node].z, i);
            }
        }
}

/** Bring positions into lanes. Each node is the image that is nearest to the one before it if there is a box. */
template <int W> void gatherPositions(const ChainPack& pack, const double* positions, const double* box,
            Vector<typename Lanes<W>::Type>* x) {
    gather<W>(pack, positions, x);
    for (int i = 0; i < W; i++) {
        for (int node = pack.nodesOfLane[i]; node < pack.nodes; node++) {
            lane(x[node].x, i) = lane(x[node-1].x, i)+1;
            lane(x[node].y, i) = lane(x[node-1].y, i);
            lane(x[node].z, i) = lane(x[node-1].z, i);
        }
        if (box != NULL)
            for (int node = 1; node < pack.nodesOfLane[i]; node++) {
                double d[] = {lane(x[node].x, i)-lane(x[node-1].x, i), lane(x[node].y, i)-lane(x[node-1].y, i),
                        lane(x[node].z, i)-lane(x[node-1].z, i)};
                takeToNearestImage(d, box);
                lane(x[node].x, i) = lane(x[node-1].x, i)+d[0];
                lane(x[node].y, i) = lane(x[node-1].y, i)+d[1];
                lane(x[node].z, i) = lane(x[node-1].z, i)+d[2];
            }
    }
}

/** Bring the positions a step begins with into lanes. Chains that stay in a plane are seen in it. */
template <int W> void gatherStart(const ChainPack& pack, const double* positions, const double* box,
            Vector<typename Lanes<W>::Type>* x) {
    gatherPositions<W>(pack, positions, box, x);
    if (pack.planar)
        for (int node = 1; node < pack.nodes; node++)
            x[node].z = x[0].z;
}

template <class Real> CYLCHAIN_INLINE Real property(const ChainPack& pack, int segment, int which) {
    return loaded<Real>(pack.properties, (std::size_t) segment*ChainPack::NumProperties+which);
}

/** The slope dV/dc of the bending energy of a joint with the cosine c and the sine s. */
template <int W> inline typename Lanes<W>::Type bendingSlope(BendingModel model, typename Lanes<W>::Type stiffness,
            typename Lanes<W>::Type c, typename Lanes<W>::Type sineSquared) {
    typedef typename Lanes<W>::Type Real;
    if (model == BendingModel::InscribedCircle)
        return -4*stiffness/((1+c)*(1+c));
    if (model == BendingModel::KratkyPorod)
        return -stiffness;
    Real slope;
    for (int i = 0; i < W; i++) {
        const double sine = std::sqrt(lane(sineSquared, i)), angle = std::atan2(sine, lane(c, i));
        lane(slope, i) = -lane(stiffness, i)*(sine > 1e-8 ? angle/sine : 1.0);
    }
    return slope;
}

inline double bendingEnergy(BendingModel model, double stiffness, double c, double sineSquared) {
    if (model == BendingModel::InscribedCircle)
        return 2*stiffness*sineSquared/((1+c)*(1+c));
    if (model == BendingModel::KratkyPorod)
        return c > 0 ? stiffness*sineSquared/(1+c) : stiffness*(1-c);
    const double angle = std::atan2(std::sqrt(sineSquared), c);
    return 0.5*stiffness*angle*angle;
}

/** The vector from a tether's point to its node. */
template <int W> void tetherVector(const LaneTether& tether, const Vector<typename Lanes<W>::Type>* x, const double* box,
            double* d) {
    Vector<typename Lanes<W>::Type> node = x[tether.node];
    d[0] = lane(node.x, tether.lane)-tether.point[0];
    d[1] = lane(node.y, tether.lane)-tether.point[1];
    d[2] = lane(node.z, tether.lane)-tether.point[2];
    if (box != NULL)
        takeToNearestImage(d, box);
}

/** Add the propulsion of segments, half of it on each end. */
template <int W> void addPropulsion(const ChainPack& pack, const Vector<typename Lanes<W>::Type>* x,
            Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    if (pack.propulsions.empty())
        return;
    for (int s = 0; s < pack.segments; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Vector<Real> half = difference*(loaded<Real>(pack.propulsions, s)/root(difference.dot(difference)));
        f[s] = f[s]+half;
        f[s+1] = f[s+1]+half;
    }
}

template <int W> ChainEnergy addForcesTo(const ChainPack& pack, const double* positions, double* forces,
            const double* box, bool includeEnergy) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch scratch;
    Vector<Real>* x = scratch.reserve<Vector<Real>>(2*pack.nodes);
    Vector<Real>* f = x+pack.nodes;
    gatherPositions<W>(pack, positions, box, x);
    ChainEnergy energy;
    Vector<Real> before = {}, push = {};
    Real inverseBefore = {};
    for (int s = 0; s < pack.nodes-1; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real length = root(difference.dot(difference));
        const Real inverse = 1/length;
        const Vector<Real> t = difference*inverse;

        // Stretching.
        const Real stiffness = property<Real>(pack, s, ChainPack::Stiffness);
        const Real extension = length-property<Real>(pack, s, ChainPack::RestLength);
        Real tension = stiffness*extension;
        if (pack.stretching == StretchingModel::FENE) {
            const Real relative = extension*property<Real>(pack, s, ChainPack::InverseExtension);
            tension = tension/(1-relative*relative);
        }
        // The last segment of an unrolled chain is there for its joint alone.
        const bool twice = (s >= pack.segments);
        Vector<Real> pull = twice ? Vector<Real> {} : t*tension;

        // Bending at the joint with the segment before.
        if (s > 0) {
            const Real joint = loaded<Real>(pack.joints, s);
            const Real c = before.dot(t);
            const Vector<Real> normal = crossProduct(before, t);
            const Real sineSquared = normal.dot(normal);
            const Real slope = bendingSlope<W>(pack.bending, joint, c, sineSquared);
            const Vector<Real> first = (t-before*c)*(-slope*inverseBefore);
            const Vector<Real> second = (before-t*c)*(-slope*inverse);
            f[s-1] = f[s-1]-first;
            push = push+first-second;
            f[s] = push+pull;
            push = second;
            if (includeEnergy)
                for (int i = 0; i < W; i++) {
                    Real k = joint, cosine = c, square = sineSquared;
                    if (s < pack.nodesOfLane[i]-1)
                        energy.bending += bendingEnergy(pack.bending, lane(k, i), lane(cosine, i), lane(square, i));
                }
        }
        else
            f[s] = pull;
        push = push-pull;
        if (includeEnergy)
            for (int i = 0; i < W; i++) {
                if (s >= pack.segmentsOfLane[i])
                    continue;
                Real k = stiffness, e = extension, d = property<Real>(pack, s, ChainPack::InverseExtension);
                const double square = lane(e, i)*lane(e, i), relative = lane(d, i)*lane(d, i)*square;
                energy.stretching += pack.stretching == StretchingModel::Harmonic ? 0.5*lane(k, i)*square :
                        -0.5*lane(k, i)/(lane(d, i)*lane(d, i))*std::log1p(-relative);
            }
        before = t;
        inverseBefore = inverse;
    }
    f[pack.nodes-1] = push;
    addPropulsion<W>(pack, x, f);
    for (const LaneTether& tether : pack.tethers) {
        double d[3];
        tetherVector<W>(tether, x, box, d);
        lane(f[tether.node].x, tether.lane) -= tether.stiffness*d[0];
        lane(f[tether.node].y, tether.lane) -= tether.stiffness*d[1];
        lane(f[tether.node].z, tether.lane) -= tether.stiffness*d[2];
        energy.tethers += 0.5*tether.stiffness*(d[0]*d[0]+d[1]*d[1]+d[2]*d[2]);
    }
    for (int node = 0; node < pack.nodes; node++)
        for (int i = 0; i < W; i++) {
            const int particle = pack.particles[node*W+i];
            if (particle >= 0) {
                forces[3*particle] += lane(f[node].x, i);
                forces[3*particle+1] += lane(f[node].y, i);
                forces[3*particle+2] += lane(f[node].z, i);
            }
        }
    return energy;
}

/** What elimination leaves of a node for substitution, and the coupling s 1 + r tt to the next node. */
template <class Real> struct Eliminated {
    Symmetric<Real> inverse;
    Vector<Real> right, tangent;
    Real coupling, axial;
};

/** The inverse for a mobile node, and zero for a fixed one, which neither moves nor passes anything on. */
template <class Real> inline Symmetric<Real> inverseOfMobile(Symmetric<Real> diagonal, Real mobile) {
    const Real held = 1-mobile;
    diagonal.xx += held;
    diagonal.yy += held;
    diagonal.zz += held;
    return diagonal.inverse(mobile);
}

/** The friction of a segment on its ends: (s 1 + r tt) on the velocity of the same end, and of the other. */
template <class Real> struct EndFriction {
    Real same, sameAxial, other, otherAxial;
    CYLCHAIN_INLINE EndFriction(const ChainPack& pack, int s, Real inverseSquare) {
        const Real acrossTrans = 0.25*property<Real>(pack, s, ChainPack::Perpendicular);
        const Real alongTrans = 0.25*property<Real>(pack, s, ChainPack::Parallel);
        const Real acrossTurn = property<Real>(pack, s, ChainPack::Rotational)*inverseSquare;
        const Real alongTurn = property<Real>(pack, s, ChainPack::Extensional)*inverseSquare;
        same = acrossTrans+acrossTurn;
        sameAxial = alongTrans+alongTurn-same;
        other = acrossTrans-acrossTurn;
        otherAxial = alongTrans-alongTurn-other;
    }
};

/** Solve Z(x) v = f for a pack: v = Z^-1 f by block elimination from the first node to the last and back. */
template <int W> void redistribute(const ChainPack& pack, const Vector<typename Lanes<W>::Type>* x,
            const Vector<typename Lanes<W>::Type>* f, Eliminated<typename Lanes<W>::Type>* nodes,
            Vector<typename Lanes<W>::Type>* v) {
    typedef typename Lanes<W>::Type Real;
    Symmetric<Real> diagonal = {};
    Vector<Real> right = f[0];
    const int last = pack.nodes-1;
    for (int s = 0; s < last; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real inverseSquare = 1/difference.dot(difference);
        const Vector<Real> t = difference*root(inverseSquare);
        const EndFriction<Real> friction(pack, s, inverseSquare);
        const Real same = friction.same, sameAxial = friction.sameAxial;
        const Real other = friction.other, otherAxial = friction.otherAxial;
        diagonal.addAxial(same, sameAxial, t);

        // Eliminate node s.
        Eliminated<Real>& node = nodes[s];
        node.inverse = inverseOfMobile(diagonal, loaded<Real>(pack.mobile, s));
        node.right = right;
        node.tangent = t;
        node.coupling = other;
        node.axial = otherAxial;
        const Vector<Real> g = node.inverse*t;
        const Real tgt = t.dot(g);
        Symmetric<Real> next = {};
        const Real square = other*other, cross = other*otherAxial;
        const Real axial = otherAxial*otherAxial*tgt;
        const Symmetric<Real>& inverse = node.inverse;
        next.xx = -(square*inverse.xx+2*cross*t.x*g.x+axial*t.x*t.x);
        next.yx = -(square*inverse.yx+cross*(t.y*g.x+t.x*g.y)+axial*t.y*t.x);
        next.yy = -(square*inverse.yy+2*cross*t.y*g.y+axial*t.y*t.y);
        next.zx = -(square*inverse.zx+cross*(t.z*g.x+t.x*g.z)+axial*t.z*t.x);
        next.zy = -(square*inverse.zy+cross*(t.z*g.y+t.y*g.z)+axial*t.z*t.y);
        next.zz = -(square*inverse.zz+2*cross*t.z*g.z+axial*t.z*t.z);
        next.addAxial(same, sameAxial, t);
        diagonal = next;
        const Vector<Real> moved = node.inverse*right;
        right = f[s+1]-moved*other-t*(otherAxial*t.dot(moved));
    }
    v[last] = inverseOfMobile(diagonal, loaded<Real>(pack.mobile, last))*right;
    for (int s = last-1; s >= 0; s--) {
        const Eliminated<Real>& node = nodes[s];
        v[s] = node.inverse*(node.right-v[s+1]*node.coupling-node.tangent*(node.axial*node.tangent.dot(v[s+1])));
    }
}

/**
 * Solve Z(x) v = f for a pack of closed chains: elimination from the second node to the last, each of which is also
 * coupled to the first one then, which comes last.
 */
template <int W> void redistributeClosed(const ChainPack& pack, const Vector<typename Lanes<W>::Type>* x,
            const Vector<typename Lanes<W>::Type>* f, Eliminated<typename Lanes<W>::Type>* nodes,
            Matrix<typename Lanes<W>::Type>* toFirst, Vector<typename Lanes<W>::Type>* v) {
    typedef typename Lanes<W>::Type Real;
    typedef Matrix<Real> Mat;
    const int count = pack.segments;
    Symmetric<Real> diagonal = {}, first = {};
    Vector<Real> right = {}, rightOfFirst = f[0]+f[count];
    Mat coupling = {};
    for (int s = 0; s < count; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real inverseSquare = 1/difference.dot(difference);
        const Vector<Real> t = difference*root(inverseSquare);
        const EndFriction<Real> friction(pack, s, inverseSquare);
        const Mat other = Mat::axial(friction.other, friction.otherAxial, t);
        if (s == 0)
            first.addAxial(friction.same, friction.sameAxial, t);
        else
            diagonal.addAxial(friction.same, friction.sameAxial, t);
        Symmetric<Real> next = {};
        (s == count-1 ? first : next).addAxial(friction.same, friction.sameAxial, t);
        Vector<Real> nextRight = f[s+1];
        Mat nextCoupling = {};
        if (s == 0)
            nextCoupling = other;
        else {
            // Eliminate node s.
            if (s == count-1)
                coupling = coupling+other;
            Eliminated<Real>& node = nodes[s];
            node.inverse = inverseOfMobile(diagonal, loaded<Real>(pack.mobile, s));
            node.right = right;
            node.tangent = t;
            node.coupling = friction.other;
            node.axial = friction.otherAxial;
            toFirst[s] = coupling;
            const Mat inverse = Mat::of(node.inverse), passed = inverse*coupling;
            const Vector<Real> moved = node.inverse*right;
            first = first-(coupling.transposed()*passed).lower();
            rightOfFirst = rightOfFirst-coupling.transposed()*moved;
            if (s < count-1) {
                next = next-(other*(inverse*other)).lower();
                nextRight = nextRight-other*moved;
                nextCoupling = other*passed*(-1+Real{});
            }
        }
        diagonal = next;
        right = nextRight;
        coupling = nextCoupling;
    }
    v[0] = inverseOfMobile(first, loaded<Real>(pack.mobile, 0))*rightOfFirst;
    for (int s = count-1; s > 0; s--) {
        const Eliminated<Real>& node = nodes[s];
        Vector<Real> rest = node.right-toFirst[s]*v[0];
        if (s < count-1)
            rest = rest-v[s+1]*node.coupling-node.tangent*(node.axial*node.tangent.dot(v[s+1]));
        v[s] = node.inverse*rest;
    }
    v[count] = v[0];
    v[count+1] = v[1];
}

/** The flow for each lane: in a periodic box, with the image of the lane's chain whose first node is nearest to the origin. */
template <int W> class LaneFlow {
    typedef typename Lanes<W>::Type Real;
public:
    LaneFlow(const BackgroundFlow& flow, const ChainPack& pack, Vector<Real> first) : gradient(flow.gradient),
            planar(pack.planar) {
        for (int i = 0; i < W; i++) {
            // What a node at zero would have to be carried along with.
            const double x[] = {lane(first.x, i), lane(first.y, i), lane(first.z, i)};
            double u[3];
            flow.getVelocity(x, u);
            for (int k = 0; k < 3; k++)
                for (int j = 0; j < 3; j++)
                    u[k] -= gradient[3*k+j]*x[j];
            lane(velocity.x, i) = u[0];
            lane(velocity.y, i) = u[1];
            lane(velocity.z, i) = u[2];
        }
    }
    CYLCHAIN_INLINE Vector<Real> at(const Vector<Real>& x) const {
        const double* g = gradient;
        return {velocity.x+x.x*g[0]+x.y*g[1]+x.z*g[2], velocity.y+x.x*g[3]+x.y*g[4]+x.z*g[5],
                planar ? Real{} : velocity.z+x.x*g[6]+x.y*g[7]+x.z*g[8]};
    }
private:
    Vector<Real> velocity;
    const double* gradient;
    bool planar;
};

/** Add the drag of the fluid on nodes at rest, Z u. It varies linearly, so the velocities of the ends say all of it. */
template <int W> void addDrag(const ChainPack& pack, const Vector<typename Lanes<W>::Type>* x, const LaneFlow<W>& flow,
            Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    for (int s = 0; s < pack.segments; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real inverseSquare = 1/difference.dot(difference);
        const Vector<Real> t = difference*root(inverseSquare);
        const EndFriction<Real> friction(pack, s, inverseSquare);
        const Vector<Real> first = flow.at(x[s]), second = flow.at(x[s+1]);
        f[s] = f[s]+first*friction.same+second*friction.other+
                t*(friction.sameAxial*t.dot(first)+friction.otherAxial*t.dot(second));
        f[s+1] = f[s+1]+second*friction.same+first*friction.other+
                t*(friction.sameAxial*t.dot(second)+friction.otherAxial*t.dot(first));
    }
}

/** The Gaussian streams of all lanes, side by side. Each lane gives the numbers that its stream gives alone. */
template <int W> class GaussianLanes {
    typedef typename Lanes<W>::Type Real;
    typedef typename Lanes<W>::Bits Bits;
public:
    GaussianLanes(const ChainPack& pack, const StepSettings& settings) : layers(GaussianStream::layers()) {
        // Seeds have 32 bits; those above them tell the parts of a step apart.
        const std::uint64_t seed = settings.seed^((std::uint64_t) settings.part<<32);
        for (int i = 0; i < W; i++) {
            const GaussianStream stream(seed, settings.step, pack.chain[i]);
            for (int k = 0; k < 4; k++)
                word(state[k], i) = stream.state[k];
        }
    }
    Real next() {
        const Bits sum = state[0]+state[3];
        const Bits bits = ((sum<<23)|(sum>>41))+state[0];
        const Bits t = state[1]<<17;
        state[2] ^= state[0];
        state[3] ^= state[1];
        state[1] ^= state[2];
        state[0] ^= state[3];
        state[2] ^= t;
        state[3] = (state[3]<<45)|(state[3]>>19);

        // Adding 2^52 in the exponent's place turns 52 bits into a double.
        Real magnitude = reinterpreted((bits>>12)|0x4330000000000000ULL)-4503599627370496.0;
        Real width, inside;
        for (int i = 0; i < W; i++) {
            const GaussianStream::Layer& layer = layers[word(bits, i)&0xff];
            lane(width, i) = layer.width;
            lane(inside, i) = layer.inside;
        }
        Real result = magnitude*width;
        result = reinterpreted(asBits(result)|((bits&0x100)<<55));
        bool finished = true;
        for (int i = 0; i < W; i++)
            finished &= (lane(magnitude, i) < lane(inside, i));
        if (__builtin_expect(!finished, 0))
            for (int i = 0; i < W; i++)
                if (!(lane(magnitude, i) < lane(inside, i)))
                    lane(result, i) = finish(word(bits, i), i);
        return result;
    }
    /** The next normal number of one lane alone. */
    double nextOfLane(int i) {
        return advance(i, [] (GaussianStream& stream) {return stream.next();});
    }
    /** The next number of one lane alone that is uniform between 0 and 1. */
    double uniform(int i) {
        return advance(i, [] (GaussianStream& stream) {return stream.uniform();});
    }
private:
    const GaussianStream::Layer* layers;
    Bits state[4];
    template <class Draw> double advance(int i, Draw draw) {
        GaussianStream stream;
        for (int k = 0; k < 4; k++)
            stream.state[k] = word(state[k], i);
        const double result = draw(stream);
        for (int k = 0; k < 4; k++)
            word(state[k], i) = stream.state[k];
        return result;
    }
    static std::uint64_t word(const Bits& bits, int i) {
        return reinterpret_cast<const std::uint64_t*>(&bits)[i];
    }
    static std::uint64_t& word(Bits& bits, int i) {
        return reinterpret_cast<std::uint64_t*>(&bits)[i];
    }
    static Real reinterpreted(Bits bits) {
        Real result;
        std::memcpy(&result, &bits, sizeof(result));
        return result;
    }
    static Bits asBits(Real value) {
        Bits result;
        std::memcpy(&result, &value, sizeof(result));
        return result;
    }
    double finish(std::uint64_t bits, int i) {
        std::uint64_t own[4];
        for (int k = 0; k < 4; k++)
            own[k] = word(state[k], i);
        const double result = GaussianStream::finish(bits, own);
        for (int k = 0; k < 4; k++)
            word(state[k], i) = own[k];
        return result;
    }
};

/** Three normal numbers, or two for a chain that stays in its plane. */
template <int W> CYLCHAIN_INLINE Vector<typename Lanes<W>::Type> gaussianVector(GaussianLanes<W>& gaussian, bool planar) {
    Vector<typename Lanes<W>::Type> result = {gaussian.next(), gaussian.next(), gaussian.next()};
    if (planar)
        result.z = typename Lanes<W>::Type {};
    return result;
}

/** Add the random forces, step (1) of Section 4, and for Euler's scheme the thermal torques (15), step (2). */
template <int W> void addRandomForces(const ChainPack& pack, const Vector<typename Lanes<W>::Type>* x,
            const StepSettings& settings, Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    GaussianLanes<W> gaussian(pack, settings);
    const double amplitude = std::sqrt(2*settings.kT/settings.stepSize);
    const double thermal = (settings.scheme == Scheme::Euler ? settings.kT : 0.0);
    for (int s = 0; s < pack.segments; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real inverse = 1/root(difference.dot(difference));
        const Vector<Real> t = difference*inverse;
        const Vector<Real> a = gaussianVector<W>(gaussian, pack.planar), b = gaussianVector<W>(gaussian, pack.planar);
        const Real across = property<Real>(pack, s, ChainPack::RootPerpendicular);
        const Real along = property<Real>(pack, s, ChainPack::RootParallel);
        const Vector<Real> force = (a*across+t*((along-across)*t.dot(a)))*(0.5*amplitude+Real{});
        const Real turn = property<Real>(pack, s, ChainPack::RootRotational);
        const Real stretch = property<Real>(pack, s, ChainPack::RootExtensional);
        const Real drift = thermal*property<Real>(pack, s, ChainPack::Drift);
        const Vector<Real> pair = (b*turn+t*((stretch-turn)*t.dot(b)))*(amplitude*inverse)+t*(drift*inverse);
        f[s] = f[s]+force-pair;
        f[s+1] = f[s+1]+force+pair;
    }
}

/** Velocities of all nodes under the forces f, in the flow. */
template <int W> void findVelocities(const ChainPack& pack, const Vector<typename Lanes<W>::Type>* x,
            const Vector<typename Lanes<W>::Type>* f, const BackgroundFlow& flow, Vector<typename Lanes<W>::Type>* v) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch scratch, couplings, vectors;
    Eliminated<Real>* nodes = scratch.reserve<Eliminated<Real>>(pack.nodes);
    if (flow.present) {
        Vector<Real>* dragged = vectors.reserve<Vector<Real>>(pack.nodes);
        std::copy(f, f+pack.nodes, dragged);
        addDrag<W>(pack, x, LaneFlow<W>(flow, pack, x[0]), dragged);
        f = dragged;
    }
    if (pack.closed)
        redistributeClosed<W>(pack, x, f, nodes, couplings.reserve<Matrix<Real>>(pack.nodes), v);
    else
        redistribute<W>(pack, x, f, nodes, v);
}

template <int W> Instability stepPack(const ChainPack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch vectors;
    const int n = pack.nodes;
    Vector<Real>* x = vectors.reserve<Vector<Real>>(3*n);
    Vector<Real>* f = x+n;
    Vector<Real>* v = f+n;
    gatherStart<W>(pack, positions, box, x);
    gatherForces<W>(pack, forces, f);
    if (settings.kT > 0)
        addRandomForces<W>(pack, x, settings, f);
    findVelocities<W>(pack, x, f, settings.flow, v);
    if (settings.scheme == Scheme::Midpoint) {
        const Real half = 0.5*settings.stepSize+Real{};
        for (int node = 0; node < n; node++)
            x[node] = x[node]+v[node]*half;
        findVelocities<W>(pack, x, f, settings.flow, v);
    }

    // Write displacements, and look for segments whose ends move apart.
    const double h = settings.stepSize;
    scatter<W>(pack, v, h, displacements);
    Instability result;
    for (int s = 0; s < pack.segments; s++) {
        const Vector<Real> change = v[s+1]-v[s];
        Real square = change.dot(change)*(h*h), limit = property<Real>(pack, s, ChainPack::RestLength);
        limit = limit*limit;
        for (int i = 0; i < W; i++)
            // Written so that NaN counts as unstable.
            if (!(lane(square, i) < lane(limit, i)) && s < pack.segmentsOfLane[i] && result.chain < 0) {
                result.chain = pack.chain[i];
                result.segment = s;
                result.change = std::sqrt(lane(square, i));
            }
    }
    return result;
}

#include "ChainCoordinates.h"
#include "ImplicitLoops.h"

template <int W> Instability stepPackAs(const ChainPack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    if (settings.scheme == Scheme::Implicit)
        return pack.closed ? stepPackImplicitly<W, true>(pack, positions, forces, box, settings, displacements) :
                stepPackImplicitly<W, false>(pack, positions, forces, box, settings, displacements);
    return stepPack<W>(pack, positions, forces, box, settings, displacements);
}

/** Call a function with as many lanes as a pack has. Those that the instruction set has not are not compiled. */
template <int W = CYLCHAIN_LANES, class Function> auto withLanesOf(const ChainPack& pack, Function function) {
    if constexpr (W > 1)
        if (pack.lanes < W)
            return withLanesOf<W/2>(pack, function);
    return function(std::integral_constant<int, W>());
}

ChainEnergy addForcesOfPack(const ChainPack& pack, const double* positions, double* forces, const double* box,
            bool includeEnergy) {
    return withLanesOf(pack, [&] (auto lanes) {
        return addForcesTo<lanes>(pack, positions, forces, box, includeEnergy);
    });
}

Instability stepOfPack(const ChainPack& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) {
    return withLanesOf(pack, [&] (auto lanes) {
        return stepPackAs<lanes>(pack, positions, forces, box, settings, displacements);
    });
}

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
