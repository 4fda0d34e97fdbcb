#ifndef CYLCHAIN_GAP_RESPONSES_H_
#define CYLCHAIN_GAP_RESPONSES_H_

#include "networks/CoupledEquations.h"
#include "networks/Gap.h"
#include "networks/LinkYielding.h"
#include <cstddef>
#include <vector>

namespace cylchain {

/**
 * How forces on gaps move gaps that share their chains.
 *
 * Each chain has ports: the places of gaps on it, in the order in which these have been added. Their responses to each
 * other, with what links of the chain yield, are a symmetric matrix for each chain, which grows as gaps are added: what
 * is known stays until forget(), although the chain is linearised anew in each iteration.
 */
class GapResponses {
public:
    /** The place of a gap on a chain that moves. */
    struct Port {
        int gap, side;
    };
    /** The ports of a chain. */
    struct ChainPorts {
        std::vector<Port> ports;
        /** The number of the first one among those of all chains. */
        int first = 0;
        int count() const {
            return ports.size();
        }
        /** How a force on a port moves all of them. */
        const double* responsesOf(int port) const {
            return &responses[(std::size_t) port*stride];
        }
        /** A row of the Cholesky factor of these responses. */
        const double* rootOf(int port) const {
            return &roots[(std::size_t) port*stride];
        }
        /** Whether the last call of find() has found responses, or takeForNew() was called since. */
        bool areNew() const {
            return isNew;
        }
    private:
        friend class GapResponses;
        void grow(int newLinks);
        bool findRoot();
        /** How many ports have responses, how long rows are, and the number of links. */
        int known = 0, stride = 0, links = 0;
        bool isNew = false;
        std::vector<double> responses, roots;
        /** How forces on all ports move the links of the chain: three rows for each link. */
        std::vector<double> movesOfLinks;
    };
    /** Begin a step without gaps. */
    void begin(int numChains);
    /** Take note of the links, which are all equations before those of gaps. */
    void setLinks(const std::vector<CouplingEquation>& equations);
    /** Add the ports of gaps that have none yet. */
    void addPorts(const std::vector<Gap>& gaps);
    /** Whether all responses are known, or those of a chain. */
    bool isComplete() const;
    bool isComplete(int chain) const {
        return chains[chain].known == chains[chain].count();
    }
    /** The same of one of a gap's chains. */
    bool areNew(int gap) const {
        bool result = false;
        forPorts(gap, [&] (const ChainPorts& chain, int) {
            result |= chain.areNew();
        });
        return result;
    }
    /** Take all responses for new ones. */
    void takeForNew() {
        for (int chain : used)
            chains[chain].isNew = true;
    }
    /** Whether links join chains. */
    bool haveLinks() const {
        return !links.getLinks().empty();
    }
    /**
     * Find the responses that are not known: by a substitution for a port of each lane of a pack at a time.
     *
     * @param firstEquations  the number of the first equation of each gap: it has one for each lever
     * @param single          whether the vectors of substitutions are in single precision
     */
    void find(const std::vector<Gap>& gaps, const std::vector<std::size_t>& firstEquations,
            const std::vector<PackStep*>& packs, CoupledEquations& coupled, Precision precision, bool single,
            const Loop& loop);
    /** The chains of a gap may have turned so far that their responses must be found again. */
    void forget(int gap);
    /** The chains that have ports. */
    const std::vector<int>& getChains() const {
        return used;
    }
    int getNumChains() const {
        return chains.size();
    }
    int numberOf(const ChainPorts& chain) const {
        return &chain-chains.data();
    }
    const ChainPorts& getPorts(int chain) const {
        return chains[chain];
    }
    int countPorts() const {
        return numPorts;
    }
    /** The number of a gap's port among those of all chains, or -1. */
    int getPort(int gap, int side) const {
        const PlaceOfPort& own = places[2*gap+side];
        return own.chain < 0 ? -1 : chains[own.chain].first+own.port;
    }
    /** Call a function with the ports of the chain, the number among these, for each port of a gap. */
    template <class Function> void forPorts(int gap, Function function) const {
        for (int side = 0; side < 2; side++)
            if (const PlaceOfPort& own = places[2*gap+side]; own.chain >= 0)
                function(chains[own.chain], own.port);
    }
    /** How far a force on a gap moves it. */
    double getOwn(int gap) const {
        return own[gap];
    }
    /** The same if no link joined its two chains. */
    double getOfChains(int gap) const {
        return ofChains[gap];
    }
private:
    /** Where a port of a gap is: its chain, or -1, and its number there. */
    struct PlaceOfPort {
        int chain = -1, port = 0;
    };
    template <class Number> void findOfPack(const std::vector<Gap>& gaps,
            const std::vector<std::size_t>& firstEquations, PackStep& step, int pack,
            std::vector<int>& chainsOfPack, const CoupledEquations& coupled);
    void yield(int chain);
    double yieldOf(int gap) const;
    void findOwn(const Loop& loop);
    std::vector<ChainPorts> chains;
    std::vector<int> used;
    /** For each gap and side. */
    std::vector<PlaceOfPort> places;
    int numPorts = 0;
    std::vector<double> own, ofChains;
    LinkYielding links;
};

} // namespace cylchain

#endif /*CYLCHAIN_GAP_RESPONSES_H_*/
