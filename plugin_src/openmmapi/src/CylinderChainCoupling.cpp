#include "openmm/CylinderChainCoupling.h"
#include "openmm/internal/PlaceResolver.h"

using namespace OpenMM;
using namespace std;

string CylinderChainCoupling::whyExplicit(const System& system) const {
    const PlaceResolver resolver(system);
    return resolver.whyExplicit(findPlaces(resolver));
}
