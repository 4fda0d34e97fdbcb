#ifndef CYLCHAIN_REST_GAP_H_
#define CYLCHAIN_REST_GAP_H_

namespace cylchain {

/**
 * The gap b below which a wall or a contact pushes in an implicit step: with the force k (b-g) where the gap g < b.
 *
 * The stiffness is k, and a unit force moves what it acts on by c in the step. What is linear then gets to the gap
 * g = g*+a (b-g), with a = k c, where g* is predicted without the force.
 *
 * A step that does not resolve the potential, a >= 1, takes it for a hard wall at the depth d = (pi k_B T/2k)^(1/2)
 * behind the surface. So much room a soft wall has beyond its surface in equilibrium, the integral of
 * exp(-k x^2/2 k_B T). What would be behind that, g* < -d, comes back to the gap g0 with which the step began:
 *
 *     b = g0+(g0-g*)/a.
 *
 * The forces of others make a smaller than that of a chain alone, so that the gap would not get back to g0: correct()
 * takes a = (g-g*)/(b-g) from the iterations.
 *
 * This is a move that Metropolis refuses. Where a step without walls keeps detailed balance and is linear, one that
 * comes back keeps it, too: with y = y*+C n (g0-g*)/(n C n), and C the response of the step to forces, the covariances
 * of the beginning and of the end of the step with g* are the same. So it is whether the motion is diffusion or relaxes
 * within the step, and the mean push on a wall, (g0-g*)/c, is k_B T times the density before it. A mirror, which throws
 * what gets there to 2d+|g*|, does so for diffusion alone: bends that relax within the step would be thrown to and fro,
 * which friction does not balance. With several contacts at once, which come back each by itself, it is an
 * approximation.
 *
 * A step that resolves the potential has b = -beta g* with a share beta from 0 on, so that the surface excess is that
 * of equilibrium, (pi k_B T/2k)^(1/2).
 */
class RestGap {
public:
    RestGap() = default;
    /**
     * Find b from what is predicted.
     *
     * @param predicted  g*
     * @param before     g0; what began behind the wall is brought to its surface
     * @param softness   a
     * @param depth      d, of findDepthOfWall()
     */
    RestGap(double predicted, double before, double softness, double depth);
    /** Correct b for the gap that an iteration has found with it. */
    void correct(double gap);
    double get() const {
        return value;
    }
private:
    double value = 0, predicted = 0, before = 0;
    /** That of a gap that comes back to g0, and 0 for others. */
    double softness = 0, depth = 0;
    int corrections = 0;
};

/** Find how far behind their surfaces walls of a stiffness stand in steps that do not resolve them. */
double findDepthOfWall(double kT, double stiffness);

} // namespace cylchain

#endif /*CYLCHAIN_REST_GAP_H_*/
