#ifndef CYLCHAIN_CONTACT_REST_H_
#define CYLCHAIN_CONTACT_REST_H_

#include "couplings/CapsuleGeometry.h"
#include "couplings/Capsules.h"

namespace cylchain {

/** Two capsules in a step that touch. */
struct ContactCourse {
    /** At the beginning, and where an iteration has led. */
    SegmentPair begun, now;
    /** The sum of the radii, and a = k c, see ContactRest. */
    double radii, softness;
    /** Whether they have passed through each other although contacts behind the wall came back: they are lines. */
    bool passed = false;
};

/**
 * Where a contact comes back to in an implicit step.
 *
 * Its stiffness is k, and a unit force moves one capsule against the other by c in the step. A step with a = k c < 1
 * resolves the potential: the force is k (b-g) along the normal where the gap g < b, as with a RestGap.
 *
 * For other steps the contact is a hard wall at the depth d behind the surface, see findDepthOfWall(). It is open while
 * g > -d. Where the step would lead behind that, the contact comes back to where the step began, with the force
 *
 *     K n (b-n.r),   b = n.r0+(n.r0-n.r*)/(K c),   K = 5 k,
 *
 * in the rest of the step. Here r is the vector between two places, one on each capsule; r0 is that of the beginning,
 * and r* that where an iteration has led. What began behind the wall is brought to the wall.
 *
 * Two that cross at an angle are lines, which cannot pass each other along their normal. The places and n are those
 * where they are nearest in the middle of the step: then their distance comes back to the third order of what they
 * move, although they turn and slide along each other. With n and the places of the end, or of the beginning, it would
 * differ by nanometers, which bends a dense bundle.
 *
 * Two that lie along each other are discs: r0 and r* are those across them, and n has the direction of r0+r*. Then
 * n.r = n.r0, and along the surface t.r = t.r* = -t.r0: they have their distance back, and have turned about each other
 * as far as they wanted to. n along r0 or r* would not do for discs, for it turns in the step. Spheres are as discs
 * are.
 *
 * This is a move that Metropolis refuses. Where a step without contacts keeps detailed balance and is linear, one in
 * which n.r comes back to n.r0 keeps it, too: with y = y*+C n (n C n)^-1 (n.r0-n.r*), and C the response of the step to
 * forces, the covariances of the beginning and of the end of the step with n.r* are the same. Several contacts come
 * back together in this way. For discs with the same friction in both directions, (n, t.r0, n.r0) -> (n, -t.r0, n.r0)
 * is its own inverse, and each n.r* is as probable from one as from the other.
 *
 * What others push behind the wall in later iterations is held there, with k along the normal: if it came back as well,
 * its neighbours would follow, and the step would not end. k does not hold what is pushed through the other one, nor do
 * discs see that they have turned about each other too far: once all has settled, pairs that have passed through each
 * other come back as lines. They are few, and the step would have to be divided otherwise.
 */
class ContactRest {
public:
    /** A contact that has not been looked at. */
    ContactRest() = default;
    /**
     * Look at a contact for the first time.
     *
     * @param softness   a; where that is not less than 1, anything between
     * @param predicted  the gap g* that is predicted without contacts; 0 if none touched
     */
    ContactRest(double softness, double predicted);
    bool isKnown() const {
        return softness >= 0;
    }
    /** Get whether the step resolves the potential. */
    bool isResolved() const {
        return softness < LEAST_STIFF;
    }
    /** Get whether the contact comes back. */
    bool isBack() const {
        return back;
    }
    /** Get b of a contact that is resolved, and 0 for others. */
    double getGap() const {
        return gap;
    }
    /**
     * Look where an iteration has led a contact that is not resolved: it may come back from now on.
     *
     * @param contact  receives the places and the normal of lines that come back
     * @param depth    d
     * @param largest  the largest gap that it comes back to
     */
    void look(const ContactCourse& course, Contact& contact, double depth, double largest);
    /** Get whether it comes back to where the step began, as lines do. */
    bool isInMiddle() const {
        return inMiddle;
    }
    /** Find anew where such lines are nearest in the middle of the step. */
    void follow(const SegmentPair& begun, const SegmentPair& now, Contact& contact);
    /** Find the force on the first capsule where r is now, and K n nT. */
    void findForce(const Vec3d& now, double stiffness, double* force, double* projection) const;
    /** K/k. */
    static constexpr double STIFFENING = 5;
private:
    static constexpr double LEAST_STIFF = 1;
    double softness = -1, gap = 0;
    bool back = false, inMiddle = false;
    Vec3d normal;
    /** b, and by how much it is beyond where the contact comes back to. */
    double target, beyond;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTACT_REST_H_*/
