#ifndef CYLCHAIN_GAP_H_
#define CYLCHAIN_GAP_H_

#include "lanes/Noise.h"
#include "networks/ChainPlaces.h"
#include <cstdint>

namespace cylchain {

/** Gaps that are closed with a chance of less than exp(-this) are left out: they have a thousandth of all forces. */
const double LARGEST_GAP_EXPONENT = 4;
/** By how much responses of gaps that are found from lengths may be too small. */
const double GAP_RESPONSE_MARGIN = 1.2;

/** How a gap is held open in a step: see ReflectedMotion. */
enum class GapLaw {
    /** By a hard surface at a random depth behind the soft one. */
    Reflection,
    /** By the spring of the soft surface, and a hard surface on the other side, at a depth that it stays behind. */
    Spring,
    /** By the same spring behind the surface alone, where nothing moves thermally. */
    SpringBehind
};

/** Where a force on a gap acts: on the first place along the gradient, and on the second one against it. */
struct GapLever {
    PlaceOnChain places[2];
    /** How the gap changes when the first place moves against the second, times the share of the force. */
    double gradient[3] = {};
};

/** The gap of a contact, or of a particle before a wall, in a step. */
struct Gap {
    /** One lever half-way through the step, or those of its start and its end, with half of the force each. */
    GapLever levers[4];
    int numLevers = 0;
    /** At the start, and where the last iteration has led, from where the surface is hard. */
    double start = 0, end = 0;
    /** How deep a gap that is held by the spring stays. */
    double ceiling = 0;
    /** The stiffness of the surface. */
    double stiffness = 0;
    /** About how far a force on the gap moves it, or more. */
    double response = 0;
    GapLaw law = GapLaw::Reflection;
    /** Whether it is a gap in this iteration: capsules may come to touch elsewhere. */
    bool present = true;
    /** What its random numbers belong to. */
    std::uint32_t key[2] = {};
    /** How a force along the gradient turns with the first place: a symmetric matrix for a unit force, or zero. */
    double turning[6] = {};
    /** The pack of one of the chains of which it is a gap, by side, or -1. */
    int packOf(int side) const {
        return levers[0].places[side].pack;
    }
    int chainOf(int side) const {
        return levers[0].places[side].chain;
    }
};

/** The random numbers of gaps in a step. */
class GapNoise {
public:
    GapNoise() = default;
    explicit GapNoise(const NoiseKey& step);
    /** Draw the exponential variates that the hard surfaces of gaps are found with, from the keys of these. */
    void drawSurfaces(const std::uint32_t* first, const std::uint32_t* second, int count, double* variates) const;
    double drawSurface(const Gap& gap) const {
        double variate;
        drawSurfaces(&gap.key[0], &gap.key[1], 1, &variate);
        return variate;
    }
    /**
     * Draw numbers for the parts of a step, one after the other for each gap.
     *
     * @param gaps         some gaps
     * @param bridges      receives normal numbers, first for the one place of each gap and then for the other
     * @param reflections  receives others
     */
    void draw(const Gap* gaps, int count, int parts, double* bridges, double* reflections) const;
    /** The limit of the depths of hard surfaces in this step: see placeHardSurface(). */
    double getLimit() const {
        return limit;
    }
private:
    NoiseKey step = {};
    double limit = 0;
};

/**
 * Decide how a gap is held open, and measure its start from there.
 *
 * The potential k g^2/2 of a gap g < 0 is that of hard surfaces: exp(-k g^2/2 k_B T) is the chance that a surface
 * at the depth D with k D^2/2 k_B T > E' for an exponential variate E' is not reached. So one is drawn that is
 * consistent with the start, D^2 = min(g, 0)^2+2 k_B T E'/k, and the start is g+D from it.
 *
 * From one step to the next that changes a deep gap by little, and would not let it out where nothing presses. So D
 * is at most d, a limit between 3 and 9 times (k_B T/k)^(1/2) that is drawn afresh in each step, and what begins
 * deeper than d stays so, held by the spring of the soft surface: both parts keep their equilibrium, whatever d is,
 * and a gap passes from one to the other as d changes. All gaps have the same d: the contact of a segment may go on
 * to the next one, which must not be kept out where this one is kept in. What is much deeper than any d is not
 * stopped on its way out.
 *
 * @param limit    d over (k_B T/k)^(1/2)
 * @param variate  E'
 * @param deepest  d is not more than this: no surface is beyond an axis
 * @param begun    g at the start
 * @param gap      its stiffness is known; receives its law and start
 * @return D: by how much gaps are longer from the hard surface
 */
double placeHardSurface(double kT, double limit, double variate, double deepest, double begun, Gap& gap);

} // namespace cylchain

#endif /*CYLCHAIN_GAP_H_*/
