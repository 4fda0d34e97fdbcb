// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The flow for each lane: in a periodic box, with the image of the lane's chain whose first node is nearest to the
 * origin.
 */
template <int W> class LaneFlow {
    typedef typename Lanes<W>::Type Real;
public:
    /**
     * @param planar  whether chains do not move along z
     * @param x       the first nodes of the chains
     */
    LaneFlow(const BackgroundFlow& flow, bool planar, const Vector<Real>& x) : planar(planar) {
        std::copy(flow.gradient, flow.gradient+9, gradient);
        for (int i = 0; i < W && flow.present; i++) {
            // What a node at zero would have to be carried along with.
            Vector<Real> first = x;
            const double r[] = {lane(first.x, i), lane(first.y, i), lane(first.z, i)};
            double u[3];
            flow.getVelocity(r, u);
            for (int k = 0; k < 3; k++)
                for (int j = 0; j < 3; j++)
                    u[k] -= flow.gradient[3*k+j]*r[j];
            lane(velocity.x, i) = u[0];
            lane(velocity.y, i) = u[1];
            lane(velocity.z, i) = u[2];
        }
    }
    CYLCHAIN_INLINE Vector<Real> at(const Vector<Real>& x) const {
        const Scalar* g = gradient;
        return {velocity.x+x.x*g[0]+x.y*g[1]+x.z*g[2], velocity.y+x.x*g[3]+x.y*g[4]+x.z*g[5],
                planar ? Real{} : velocity.z+x.x*g[6]+x.y*g[7]+x.z*g[8]};
    }
private:
    Vector<Real> velocity = {};
    Scalar gradient[9];
    bool planar;
};
