#ifndef CYLCHAIN_FRAME_TURNS_H_
#define CYLCHAIN_FRAME_TURNS_H_

#include "lanes/Noise.h"
#include <cstdint>
#include <vector>

namespace cylchain {

/**
 * How the segments of a chain whose joints are bent at rest turn about themselves in a step, while its nodes rest.
 *
 * The energy of turns f is, with the mean g = (f_(s-1)+f_s)/2 of both segments of a joint,
 *
 *     V = sum_s (stiffness/2) (f_s-f_(s-1))^2 + torque (f_s-f_(s-1)) - cosine cos(g) - sine sin(g).
 *
 * With e = k_B T h/friction of each segment, z = f+e^(1/2) random is drawn, and then f from exp(-V/k_B T-(f-z)^2/2e).
 * That leaves exp(-V/k_B T) as it is at any h, and is Brownian motion for short steps; without the cosines, it is the
 * implicit step with theta = 1. The second draw takes blocks of segments, whose neighbours rest: from the Gaussian near
 * the minimum of a block, accepted by Metropolis. See docs/design/twist.md.
 */
class FrameTurns {
public:
    /** A joint before a segment; that to what is beyond an end has no cosine and no sine. */
    struct Joint {
        double stiffness, torque, cosine, sine;
    };
    /** Begin with a chain; joint number N of a closed one is that before the first segment. */
    void begin(int segments, bool closed, double kT);
    Joint& joint(int number) {
        return joints[number];
    }
    /** Set the friction of a segment against turning over the step. */
    void setFriction(int segment, double friction) {
        stiffnesses[segment] = friction;
    }
    /** Turn all segments. */
    void take(const NoiseKey& key, std::uint32_t chain);
    /** Find by how much turns have changed the twist of a joint. */
    double changeOf(int number) const;
private:
    /** The energy of bending of a joint as a parabola of the mean turn. */
    struct Parabola {
        double slope, curvature;
    };
    int count;
    bool closed;
    double kT;
    std::vector<Joint> joints;
    /** Of segments: friction over the step and over k_B T, where they are drawn to, their turns, and normal numbers. */
    std::vector<double> stiffnesses, targets, turns, normals;
    /** Of a block. */
    std::vector<double> diagonal, coupling, right, found, border;
    std::vector<Parabola> parabolas;

    void draw(const NoiseKey& key, std::uint32_t chain, int part);
    void sweep(const NoiseKey& key, std::uint32_t chain, int part);
    double turnBlock(int first, int length, int number);
    void swapBlock(int first, int length);
    void linearise(int first, int length, bool withBends);
    void solve(int first, int length, const double* random);
    double findLacking(int first, int length) const;
    int segmentOf(int number) const {
        return number < count ? number : number-count;
    }
    /** The joint before a segment of a block, or behind the last one. */
    const Joint& jointBefore(int number) const {
        return joints[closed && number > count ? number-count : closed && number == 0 ? count : number];
    }
    /** What a segment next to a block has turned by; nothing turns beyond an end. */
    double turnBeside(int number) const {
        if (closed)
            return turns[number < 0 ? number+count : segmentOf(number)];
        return number < 0 || number == count ? 0 : turns[number];
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_FRAME_TURNS_H_*/
