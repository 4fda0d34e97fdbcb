#include "dynamics/ModePack.h"
#include <cmath>

using namespace cylchain;
using namespace std;

/** The mean of exp(-t) for t between 0 and x. */
static double meanDecay(double x) {
    return x > 0 ? -expm1(-x)/x : 1;
}

template <class Scalar> ModeFamily<Scalar>::ModeFamily(const BeadModes& modes, int nodes) : modes(modes), nodes(nodes),
        stepSize(0), kT(0) {
}

template <class Scalar> shared_ptr<const CosineTables<Scalar> > ModeFamily<Scalar>::getTables() const {
    lock_guard<mutex> lock(access);
    if (!tables)
        tables = CosineTables<Scalar>::ofLength(nodes);
    return tables;
}

template <class Scalar> static shared_ptr<const ModeCoefficients<Scalar> > findCoefficients(const BeadModes& modes,
        int nodes, double h, double kT) {
    shared_ptr<ModeCoefficients<Scalar> > result = make_shared<ModeCoefficients<Scalar> >();
    const double mobility = h/modes.nodeFriction;
    double bonds = 0;
    for (int p = 0; p < nodes; p++) {
        const double bending = h*modes.bendingRate(p, nodes), stretching = h*modes.stretchingRate(p, nodes);
        const double variance = 2*kT*mobility*meanDecay(2*bending);
        result->slow.push_back(mobility*meanDecay(bending)/nodes);
        result->fast.push_back(mobility*exp(-bending)*meanDecay(stretching)/nodes);
        result->noise.push_back(sqrt(variance/(p == 0 ? nodes : 2*nodes)));
        bonds += variance*2/nodes*pow(2*sin(0.5*M_PI*p/nodes), 2);
    }
    // Ten standard deviations of a component.
    const double restLength = modes.contourForce/modes.stiffness;
    result->largestChange = restLength*restLength+100*bonds;
    return result;
}

template <class Scalar> shared_ptr<const ModeCoefficients<Scalar> > ModeFamily<Scalar>::getCoefficients(
        double stepSize, double kT) const {
    lock_guard<mutex> lock(access);
    if (!coefficients || stepSize != this->stepSize || kT != this->kT) {
        coefficients = findCoefficients<Scalar>(modes, nodes, stepSize, kT);
        this->stepSize = stepSize;
        this->kT = kT;
    }
    return coefficients;
}

template class cylchain::ModeFamily<float>;
template class cylchain::ModeFamily<double>;
