#ifndef OPENMM_STATEDIGEST_H_
#define OPENMM_STATEDIGEST_H_

#include <cstdint>

namespace OpenMM {

/**
 * A number by which a state beside positions is told from that of another time, or of a Context to which other things
 * have happened.
 */
class StateDigest {
public:
    /**
     * Take account of a number.
     */
    void mix(std::uint64_t value) {
        // One round of the generator splitmix64.
        digest += value+0x9e3779b97f4a7c15ull;
        digest = (digest^(digest>>30))*0xbf58476d1ce4e5b9ull;
        digest = (digest^(digest>>27))*0x94d049bb133111ebull;
        digest ^= digest>>31;
    }
    /**
     * Get the digest: below 2^52, so that it is exact as the value of a parameter.
     */
    double get() const {
        return (double) (digest>>12);
    }
private:
    std::uint64_t digest = 0;
};

} // namespace OpenMM

#endif /*OPENMM_STATEDIGEST_H_*/
