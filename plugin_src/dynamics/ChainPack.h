#ifndef CYLCHAIN_CHAIN_PACK_H_
#define CYLCHAIN_CHAIN_PACK_H_

#include "dynamics/ChainEngine.h"
#include "lanes/Noise.h"
#include <cstddef>
#include <memory>
#include <vector>

namespace cylchain {

/** A tether of the chain in a lane, and its number among those of the chain. */
struct LaneTether : Tether {
    int lane, number;
};

/** Twist of the chains of a pack: see ChainTwist. What fills up has no stiffness. */
template <class Scalar> struct PackTwist {
    /** Of the joint at each node, [node][lane]: the stiffness, and the angle at rest, a double as twists are. */
    std::vector<Scalar> stiffness;
    std::vector<double> rest;
    /**
     * Of end frames, [end][lane], with the sign that twist has there: the torque, how fast they are turned, and by how
     * much less for each torque of their joint.
     */
    std::vector<double> torque, angularVelocity, frameMobility;
    /** Their directions, [end][axis][lane]. */
    std::vector<double> directions;
    /** Of each segment, [segment][lane]; nothing if chains have no twist. */
    std::vector<Scalar> friction;
    /** One for each lane whose chain has a joint to a frame at both ends, or is closed: all of it shares a torque. */
    std::vector<Scalar> held;
    /** The bends at rest of the joint at each node, [node][component][lane]; nothing if all joints are straight. */
    std::vector<Scalar> bends;
    /** Whether a chain is held. */
    bool isHeld = false;
    PackTwist() = default;
    PackTwist(int segments, int lanes) {
        const std::size_t numbers = (std::size_t) (segments+1)*lanes;
        stiffness.resize(numbers);
        rest.resize(numbers);
        torque.resize(2*lanes);
        angularVelocity.resize(2*lanes);
        frameMobility.resize(2*lanes);
        // Far from zero, so that joints have that of the segment which is there, and from where floats end.
        friction.resize(numbers-lanes, 1e30);
        directions.resize(6*lanes);
        held.resize(lanes);
    }
    bool isPresent() const {
        return !friction.empty();
    }
    bool isBentAtRest() const {
        return !bends.empty();
    }
};

/** What packs of the same chains have in common in each precision. */
struct PackShape {
    /** The number of nodes includes those that come twice; that of segments does not. */
    int nodes, segments;
    BendingModel bending;
    StretchingModel stretching;
    bool closed, planar;
    /** Whether nodes have friction, and whether segments have. */
    bool hasNodeFriction, hasSegmentFriction;
};

/**
 * Chains side by side: the numbers of all chains for one segment lie next to each other, one in each lane. Chains that
 * are shorter than the longest one are filled up with segments without friction whose nodes are fixed, and so are lanes
 * without a chain.
 *
 * Closed chains are unrolled: their first two nodes come once more behind the last one, so that the joint of the first
 * node finds the segment after it there. All closed chains of a pack have the same number of nodes.
 */
template <class Scalar> struct ChainPack : PackShape {
    /**
     * The properties of a segment and of its first node, each of them for all lanes. Drift is the thermal torque (15)
     * over k_B T, which is d+1-(d-1)gamma_def/gamma_rot in d dimensions. Joint is the stiffness of the joint at the
     * node, which is zero at ends. Mobile is one if the node moves, and zero if it does not.
     */
    enum Property {RestLength, InverseRestLength, Stiffness, InverseExtension, Parallel, Perpendicular, Rotational,
            Extensional, RootParallel, RootPerpendicular, RootRotational, RootExtensional, Drift, Joint, Mobile,
            NumProperties};
    int lanes;
    /** Number of each lane's chain, or -1, of its nodes and of its segments. */
    std::vector<int> chain, nodesOfLane, segmentsOfLane;
    /** The number of each lane's first node in its chain, which is not zero in a piece of one. */
    std::vector<int> firstNode;
    /** Particle of each node and lane, [node][lane]; -1 for a node that only fills up. */
    std::vector<int> particles;
    /** The same particles, each of them once, chain by chain. */
    std::vector<int> particlesOfChains;
    /** Properties, [row][property][lane], which packs that are alike share; and the row of each node. */
    std::shared_ptr<const std::vector<Scalar> > properties;
    std::vector<int> rows;
    /** One for each lane whose chain has no node that is fixed; zero for others. */
    std::vector<Scalar> free;
    /**
     * One over the friction of each lane's chain as a rod against turning, or twice that if it has joints; zero if it
     * is held.
     */
    std::vector<double> turning;
    /** Friction of the nodes of each lane, and its square root. */
    std::vector<Scalar> nodeFriction, rootNodeFriction;
    /** The tethers of all lanes, by their nodes. */
    std::vector<LaneTether> tethers;
    /** The number of the first tether of each node, or of the one that follows, and how many there are. */
    std::vector<int> firstTethers;
    /** Half the propulsion of each segment, [segment][lane], or nothing if there is none. */
    std::vector<Scalar> propulsions;
    PackTwist<Scalar> twist;
    /** Nodes that do not come twice. */
    int ownNodes() const {
        return closed ? nodes-2 : nodes;
    }
};

template <class Scalar> struct ModePack;
class PackStep;

/** The loops over a wide pack of open chains, in single precision. */
struct WideKernels {
    /** The number of lanes of all such packs. */
    int lanes;
    /** A step of an implicit scheme. */
    Instability (*step)(const ChainPack<float>& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements);
    /** A new object that takes an implicit step of a pack whose chains are coupled to others. */
    PackStep* (*createStep)(const ChainPack<float>& pack);
    /** See Noise.h. */
    void (*drawNormals)(const NoiseKey& key, NoiseKind kind, const std::uint32_t* chains, const std::uint32_t* parts,
            int count, double* normals);
    /** A step by the modes of chains. */
    Instability (*stepOfModes)(const ModePack<float>& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements);
    /** See CosineTables.h. */
    void (*transformCosines)(int length, int count, double* values, bool inverse);
};

/** The loops over a pack, compiled for one instruction set. */
struct ChainKernels {
    const char* instructionSet;
    /** The largest number of lanes that fits a register. */
    int lanes;
    ChainEnergy (*addForces)(const ChainPack<double>& pack, const double* positions, double* forces, const double* box,
            bool includeEnergy, const std::vector<std::vector<double> >* twists);
    Instability (*step)(const ChainPack<double>& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements);
    /** A new object that takes an implicit step of a pack whose chains are coupled to others. */
    PackStep* (*createStep)(const ChainPack<double>& pack);
    /** See Noise.h. */
    void (*drawWords)(const NoiseKey& key, NoiseKind kind, std::uint32_t draw, const std::uint32_t* chains,
            const std::uint32_t* parts, int count, std::uint32_t* words);
    void (*drawNormals)(const NoiseKey& key, NoiseKind kind, const std::uint32_t* chains, const std::uint32_t* parts,
            int count, double* normals);
    void (*drawFeneCoordinates)(const NoiseKey& key, const std::uint32_t* chains, const std::uint32_t* segments,
            const double* stiffness, int count, double* coordinates);
    /** A step by the modes of chains. */
    Instability (*stepOfModes)(const ModePack<double>& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements);
    /** See CosineTables.h. */
    void (*transformCosines)(int length, int count, double* values, bool inverse);
    /**
     * The area on the unit sphere that the great circle from a to b sweeps as it moves to that from newA to newB, for
     * the directions of these vectors, of three numbers each.
     */
    double (*findSweptArea)(const double* a, const double* b, const double* newA, const double* newB);
    const WideKernels& wide;
};

const ChainKernels& baselineKernels();
const WideKernels& baselineWideKernels();
const ChainKernels& avx2Kernels();
const WideKernels& avx2WideKernels();
const ChainKernels& avx512Kernels();
const WideKernels& avx512WideKernels();

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_PACK_H_*/
