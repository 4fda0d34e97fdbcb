#include "openmm/CylinderChainException.h"

using namespace OpenMM;
using namespace std;

CylinderChainException::CylinderChainException(Kind kind, const Place& place, const string& message) :
        OpenMMException(message), kind(kind), place(place) {
}

// The type is known by this library alone, whichever throws it.

CylinderChainException::~CylinderChainException() {
}

const char* CylinderChainException::getKindName() const {
    static const char* const NAMES[] = {CYLCHAIN_EXCEPTION_KINDS(CYLCHAIN_NAME)};
    return NAMES[kind];
}
