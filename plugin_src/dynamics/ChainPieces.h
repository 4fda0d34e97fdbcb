#ifndef CYLCHAIN_CHAIN_PIECES_H_
#define CYLCHAIN_CHAIN_PIECES_H_

#include "dynamics/ChainEngine.h"
#include <memory>
#include <mutex>
#include <vector>

namespace cylchain {

/** How a chain is cut into pieces of the same number of nodes, of which each shares some with the next one. */
struct PieceLayout {
    int nodes, pieces, nodesOfPiece;
    int firstNode(int piece) const;
    /** Where displacements pass from those of the piece before to those of a piece: no node is in two joints. */
    int firstJoined(int piece, int overlap) const;
    int endOfJoined(int piece, int overlap) const;
};

/**
 * Implicit steps of a pack of few long chains, taken piece by piece.
 *
 * What a force does to the nodes of a chain in a step decays along it: its tension turns bends as it goes. So chains
 * are cut into pieces that overlap, with ends that are free. The pieces lie side by side in lanes, and stay in the
 * cache. Where two of them overlap, displacements pass from those of one piece to those of the other. The step is not
 * taken so if these differ there by more than an iteration may leave, or if the equations of a piece are not solved.
 * Twists follow from how far segments turn, which passes from one piece to the other at once, and from the areas that
 * the joined displacements sweep: so linking numbers are kept. See docs/design/implicit_scheme.md.
 */
class ChainPieces {
public:
    /**
     * @param members     the chains of a pack, in this order the longest first
     * @param lanes       the number of lanes in double precision
     * @param wideLanes   the same in single precision
     */
    ChainPieces(const std::vector<Chain>& chains, const std::vector<int>& members, int lanes, int wideLanes);
    ~ChainPieces();
    /** Whether chains may be long enough for any step. */
    static bool mayBeUsed(const std::vector<Chain>& chains, const std::vector<int>& members, int wideLanes);
    /** Whether to take a step piece by piece. */
    bool isUsed(const StepSettings& settings) const;
    /**
     * Take a step. It is for one thread at a time, and so is isMixed().
     *
     * @param displacements   receives those of the chains if the step is taken, see ChainEngine::step()
     * @return whether the step is taken
     */
    bool step(const double* positions, const double* forces, const double* box, const StepSettings& settings,
            double* displacements, Instability& result);
    /** The number of chains that are cut into pieces. */
    int getNumChains() const {
        return chains.size();
    }
    /** Whether the pieces take a step in mixed precision. */
    bool isMixed(const StepSettings& settings);
    /** Find the nodes of each chain where one piece is joined to the next. */
    std::vector<std::vector<bool> > findJoined(const StepSettings& settings);
private:
    /** What the decay along a chain follows from: the least frictions of nodes, and the greatest stiffnesses. */
    struct Response {
        double along, across, length, lengthFriction, bend, angle, twist, turn;
        int dimensions;
        /** The number of nodes in which what a force does decays by a factor of e. */
        double decayLength(const StepSettings& settings) const;
    };
    /** The pieces, and the nodes that neighbours share at least. */
    struct Cut;
    const int lanes, wideLanes;
    std::vector<Chain> chains;
    std::vector<int> numbers;
    Response response;
    std::unique_ptr<Cut> cut;
    std::mutex cutting;
    static Response responseOf(const std::vector<Chain>& chains);
    int lanesOfStep(const StepSettings& settings) const {
        return settings.precision == Precision::Double ? lanes : wideLanes;
    }
    /** Of pieces that overlap by so many nodes, as many of each chain as are taken in the shortest time. */
    static PieceLayout layoutFor(int nodes, int chains, int overlap, int lanes);
    /** How many nodes are taken one after the other, in all lanes. */
    static double costOf(const PieceLayout& layout, int chains, int lanes);
    /** The nodes that neighbours share, or as many as the longest chain has if that is too many. */
    int overlapFor(const StepSettings& settings) const;
    Cut& cutFor(const StepSettings& settings);
    /**
     * Pass from the displacements of one piece to those of the next in some nodes, or return false if they differ by
     * too much.
     *
     * @param first           the first of these nodes
     * @param before, behind  the displacements from that node on
     */
    static bool join(const Chain& chain, int first, int count, Scheme scheme, const double* before,
            const double* behind, double* displacements);
    /**
     * Find how the twists of a chain change when displacements have been joined, or return false if segments turn by
     * too different angles in two pieces.
     *
     * @param ofPieces  changes of the twists of its first piece, which those of the others follow
     * @param turns     the same of how far segments turn
     */
    static bool joinTwists(const Chain& chain, const PieceLayout& layout, int overlap, const double* ofPieces,
            const double* turns, const double* positions, const double* box, const double* displacements,
            std::vector<double>& changes);
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_PIECES_H_*/
