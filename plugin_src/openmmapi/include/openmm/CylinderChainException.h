#ifndef OPENMM_CYLINDERCHAINEXCEPTION_H_
#define OPENMM_CYLINDERCHAINEXCEPTION_H_

#include "mechanics/Enumerators.h"
#include "openmm/OpenMMException.h"
#include <string>

/**
 * What may be wrong with chains.
 *
 * - TornChain: positions were wrapped into a periodic box particle by particle.
 * - ElementTooLong: beam elements are too long for their persistence length.
 * - LengthOutOfRange: a segment has a length at which its energy is infinite.
 * - UnstableChain: a chain has blown up.
 * - UnstableParticle: a particle outside chains has blown up.
 * - LinkOutOfRange: a link has a length at which its energy is infinite.
 * - UnknownLinks: it is not known which links a Context has.
 * - NothingRecorded: no tensions were recorded in the last step.
 */
#define CYLCHAIN_EXCEPTION_KINDS(ENTRY) \
    ENTRY(TornChain, "torn-chain") \
    ENTRY(ElementTooLong, "element-too-long") \
    ENTRY(LengthOutOfRange, "length-out-of-range") \
    ENTRY(UnstableChain, "unstable-chain") \
    ENTRY(UnstableParticle, "unstable-particle") \
    ENTRY(LinkOutOfRange, "link-out-of-range") \
    ENTRY(UnknownLinks, "unknown-links") \
    ENTRY(NothingRecorded, "nothing-recorded")

namespace OpenMM {

/**
 * This is thrown where chains cannot be advanced, and says what is wrong, and where.
 */
class CylinderChainException : public OpenMMException {
public:
    enum Kind : int {CYLCHAIN_EXCEPTION_KINDS(CYLCHAIN_ENUMERATOR)};
    /**
     * Where and when something is wrong.  What is not known is -1.
     */
    struct Place {
        int chain = -1, segment = -1, particle = -1;
        /**
         * The number of the step, from 1 on.
         */
        long long step = -1;
        /**
         * The number of the link.
         */
        long long link = -1;
        /**
         * The other segment of a contact or link.
         */
        int otherChain = -1, otherSegment = -1;
    };
    CylinderChainException(Kind kind, const Place& place, const std::string& message);
    ~CylinderChainException();
    Kind getKind() const {
        return kind;
    }
    /**
     * Get the name of the kind.
     */
    const char* getKindName() const;
    const Place& getPlace() const {
        return place;
    }
private:
    Kind kind;
    Place place;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINEXCEPTION_H_*/
