#include "growth/SegmentLaws.h"
#include "mechanics/Inline.h"
#include <algorithm>
#include <cstdint>
#include <type_traits>

namespace cylchain {

namespace {

#include "lanes/VectorLanes-inl.h"
#include "mechanics/BendingModels-inl.h"
#include "mechanics/StretchingModels-inl.h"

/** Of quadrature, and how many standard deviations of a Gaussian it goes to. */
const int INTERVALS = 2000;
const double DEVIATIONS = 10;

template <class Function> double integrate(double from, double to, Function function) {
    const double width = (to-from)/INTERVALS;
    double sum = 0;
    for (int i = 0; i <= INTERVALS; i++)
        sum += (i == 0 || i == INTERVALS ? 1 : i%2 == 1 ? 4 : 2)*function(from+i*width);
    return sum*width/3;
}

double drawNormal(RandomNumbers& random) {
    const double radius = std::sqrt(2*random.exponential());
    return radius*std::cos(2*M_PI*random.uniform());
}

} // namespace

LengthLaw::LengthLaw(const Segment& segment, StretchingModel model, double kT, int dimensions) : model(model),
        restLength(segment.restLength), stiffness(segment.stiffness),
        inverse(hasRange(model) ? 1/segment.maximumExtension : 0), kT(kT), dimensions(dimensions),
        deviation(std::sqrt(kT/segment.stiffness)) {
    if (kT == 0)
        return;
    const double range = hasRange(model) ? std::min(segment.maximumExtension, DEVIATIONS*deviation) :
            DEVIATIONS*deviation;
    norm = std::log(integrate(std::max(-restLength, -range), range, [&] (double extension) {
        return std::exp(findExponent(extension));
    }));
}

double LengthLaw::findExponent(double extension) const {
    if (!(restLength+extension > 0) || (hasRange(model) && !(std::fabs(extension)*inverse < 1)))
        return -HUGE_VAL;
    return (dimensions-1)*std::log(1+extension/restLength)-stretchingEnergy(model, stiffness, extension, inverse)/kT;
}

double LengthLaw::findLogarithm(double extension) const {
    return kT == 0 ? 0 : findExponent(extension)-norm;
}

double LengthLaw::draw(RandomNumbers& random) const {
    if (kT == 0)
        return 0;
    // Each energy is that of a harmonic spring or more.
    const double largest = (dimensions-1)*std::log1p(DEVIATIONS*deviation/restLength);
    while (true) {
        const double normal = drawNormal(random), extension = deviation*normal;
        if (std::fabs(normal) < DEVIATIONS &&
                std::log(random.uniform()) < findExponent(extension)+0.5*normal*normal-largest)
            return extension;
    }
}

BendLaw::BendLaw(double jointStiffness, BendingModel model, double kT, bool planar) : model(model),
        stiffness(kT > 0 ? jointStiffness/kT : HUGE_VAL), planar(planar) {
    if (kT == 0)
        return;
    auto density = [&] (double bend) {
        return std::exp(findExponentOf(bend));
    };
    if (planar) {
        // The energy is at least that of a chord.
        const double range = std::min(M_PI, DEVIATIONS*M_PI/2/std::sqrt(std::max(stiffness, 1e-9)));
        norm = std::log(integrate(-range, range, density));
    }
    else
        norm = std::log(integrate(1-std::min(2.0, 0.5*DEVIATIONS*DEVIATIONS/std::max(stiffness, 1e-9)), 1.0, density));
}

double BendLaw::findExponent(double cosine, double sineSquared) const {
    // Where a joint folds back, an energy may be infinite.
    const double least = -1+1e-12;
    if (cosine < least)
        return findExponent(least, (1-least)*(1+least));
    return stiffness == 0 ? 0 : -bendingEnergy(model, stiffness, cosine, sineSquared);
}

double BendLaw::findExponentOf(double bend) const {
    if (planar)
        return findExponent(std::cos(bend), std::sin(bend)*std::sin(bend));
    return findExponent(bend, std::max(0.0, (1-bend)*(1+bend)));
}

double BendLaw::findLogarithm(double bend) const {
    return std::isinf(stiffness) ? 0 : findExponentOf(bend)-norm;
}

double BendLaw::draw(RandomNumbers& random) const {
    if (std::isinf(stiffness))
        return planar ? 0 : 1;
    // Each energy is that of Kratky and Porod, b (1-c), or more, and in a plane that is 2 b (angle/pi)^2 or more.
    while (true) {
        double bend, proposed;
        if (!planar) {
            const double rest = random.uniform();
            const double square = stiffness > 1e-9 ? -std::log1p(rest*std::expm1(-2*stiffness))/stiffness : 2*rest;
            bend = std::max(-1.0, 1-square);
            proposed = -stiffness*square;
        }
        else if (stiffness > 1) {
            bend = drawNormal(random)*0.5*M_PI/std::sqrt(stiffness);
            proposed = -2*stiffness*bend*bend/(M_PI*M_PI);
            if (std::fabs(bend) > M_PI)
                continue;
        }
        else {
            bend = M_PI*(2*random.uniform()-1);
            proposed = 0;
        }
        if (std::log(random.uniform()) < findExponentOf(bend)-proposed)
            return bend;
    }
}

} // namespace cylchain
