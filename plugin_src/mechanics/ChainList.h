#ifndef CYLCHAIN_CHAIN_LIST_H_
#define CYLCHAIN_CHAIN_LIST_H_

#include "mechanics/BeamChain.h"
#include "mechanics/Chain.h"
#include <string>
#include <vector>

namespace cylchain {

/** What the parts of a chain are. */
enum class ChainKind : int {StraightSegments, BeamElements};

/** A chain that was cut: what was beyond a length along it belongs to another one, or to none if all has vanished. */
struct ChainCut {
    /** Their numbers among all chains, or -1 for none. */
    int chain, part;
    double along;
};

/**
 * The chains of a System in one list, each with its kind and its name.
 *
 * Each kind has an engine of its own, which takes the chains of this kind in the order of the list. Steps number those
 * of straight segments first, and those of beam elements behind them: getNumberOfStep() leads back to the list.
 */
class ChainList {
public:
    int size() const {
        return entries.size();
    }
    /** Add a chain; returns its number. Its name is "Chain" and the number. */
    int add(const Chain& chain);
    int add(const BeamChain& beam);
    ChainKind getKind(int number) const {
        return entries[number].kind;
    }
    /** Get a chain of straight segments, by its number in the list. */
    const Chain& getChain(int number) const {
        return chains[entries[number].index];
    }
    Chain& getChain(int number) {
        return chains[entries[number].index];
    }
    /** Get a chain of beam elements, by its number in the list. */
    const BeamChain& getBeam(int number) const {
        return beams[entries[number].index];
    }
    BeamChain& getBeam(int number) {
        return beams[entries[number].index];
    }
    /** Get all chains of straight segments. */
    const std::vector<Chain>& getChains() const {
        return chains;
    }
    /** Get all chains of beam elements. */
    const std::vector<BeamChain>& getBeams() const {
        return beams;
    }
    /** Get which one of all that have its kind a chain is. */
    int getIndex(int number) const {
        return entries[number].index;
    }
    /** Get the number in the list of the one of all that have a kind. */
    int getNumber(ChainKind kind, int index) const {
        return numbers[static_cast<int>(kind)][index];
    }
    /** Get the number in the list of a chain by the number that it has in steps. */
    int getNumberOfStep(int chain) const {
        const int count = chains.size();
        return chain < count ? getNumber(ChainKind::StraightSegments, chain) :
                getNumber(ChainKind::BeamElements, chain-count);
    }
    const std::string& getName(int number) const {
        return entries[number].name;
    }
    /** Get the name of a chain as it is within a sentence. */
    std::string getNameInSentence(int number) const;
    void setName(int number, const std::string& name) {
        entries[number].name = name;
    }

    /** Call a function with a chain, whatever its kind. */
    template <class Function> auto visit(int number, Function function) const {
        return getKind(number) == ChainKind::BeamElements ? function(getBeam(number)) : function(getChain(number));
    }
    template <class Function> auto visit(int number, Function function) {
        return getKind(number) == ChainKind::BeamElements ? function(getBeam(number)) : function(getChain(number));
    }
    bool isClosed(int number) const {
        return visit(number, [] (const auto& chain) {return chain.closed;});
    }
    bool isPlanar(int number) const {
        return visit(number, [] (const auto& chain) {return chain.planar;});
    }
    int getNumNodes(int number) const {
        return visit(number, [] (const auto& chain) {return chain.numNodes();});
    }
    /** Get the particles of a chain: its nodes, or the position and the control point of each node. */
    const std::vector<int>& getParticles(int number) const {
        return *visit(number, [] (const auto& chain) {return &chain.getParticles();});
    }
private:
    struct Entry {
        ChainKind kind;
        /** Which one of its kind. */
        int index;
        std::string name;
    };
    int addEntry(ChainKind kind, int index);
    std::vector<Entry> entries;
    std::vector<Chain> chains;
    std::vector<BeamChain> beams;
    /** The numbers of all chains of each kind. */
    std::vector<int> numbers[2];
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_LIST_H_*/
