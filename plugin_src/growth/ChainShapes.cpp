#include "growth/ChainShapes.h"
#include "growth/Directions.h"
#include <algorithm>
#include <cmath>
#include <tuple>

using namespace cylchain;
using namespace std;

namespace {

/** Turn a direction in its plane by an angle. */
Vec3d turnInPlane(const Vec3d& v, double angle) {
    const double c = cos(angle), s = sin(angle);
    return {c*v.x-s*v.y, s*v.x+c*v.y, v.z};
}

} // namespace

ChainShapes::ChainShapes(const GrowthSystem& system, const vector<BendingModel>& bending,
        const vector<StretchingModel>& stretching, const vector<char>& planar) : system(system), bending(bending),
        stretching(stretching), planar(planar) {
    vector<tuple<int, BendingModel, StretchingModel, char> > known;
    for (size_t i = 0; i < system.chains.size(); i++) {
        const auto key = make_tuple(system.chains[i].table, bending[i], stretching[i], planar[i]);
        lawsOf.push_back(find(known.begin(), known.end(), key)-known.begin());
        if (lawsOf[i] == static_cast<int>(known.size()))
            known.push_back(key);
    }
    laws.resize(known.size());
}

const LengthLaw& ChainShapes::getLengths(int index, int monomers, double kT) {
    Laws& own = laws[lawsOf[index]];
    const MonomerTable& table = tableOf(index);
    if (own.kT != kT) {
        own = Laws();
        own.kT = kT;
        own.lengths.resize(table.segments.size()+1);
        own.bends.resize(table.joints.size()+2);
    }
    unique_ptr<LengthLaw>& law = own.lengths[monomers];
    if (!law)
        law = make_unique<LengthLaw>(table.getSegment(monomers), stretching[index], kT, planar[index] ? 2 : 3);
    return *law;
}

const BendLaw& ChainShapes::getBends(int index, int monomersOfBoth, double kT) {
    getLengths(index, 1, kT);
    unique_ptr<BendLaw>& law = laws[lawsOf[index]].bends[monomersOfBoth];
    if (!law)
        law = make_unique<BendLaw>(tableOf(index).getJoint(monomersOfBoth), bending[index],
                kT, planar[index]);
    return *law;
}

double ChainShapes::drawLength(int index, int monomers, double kT, RandomNumbers& random) {
    return restLengthOf(index, monomers)+getLengths(index, monomers, kT).draw(random);
}

vector<double> ChainShapes::findLengths(int index, MonomerRange range) const {
    const double length = restLengthOf(index, 1);
    vector<double> result(1, range.first*length);
    if (range.size() == 0)
        return result;
    const SegmentDivision division(range, tableOf(index).monomersPerSegment);
    int monomer = range.first;
    for (int s = 0; s < division.countSegments(); s++) {
        monomer += division.getMonomers(s);
        result.push_back(monomer*length);
    }
    return result;
}

vector<Vec3d> ChainShapes::draw(int index, MonomerRange range, const Vec3d& start, const Vec3d& direction, double kT,
        RandomNumbers& random) {
    const SegmentDivision division(range, tableOf(index).monomersPerSegment);
    vector<Vec3d> nodes = {start};
    Vec3d along = direction;
    for (int s = 0; s < division.countSegments(); s++) {
        const int monomers = division.getMonomers(s);
        if (s > 0)
            along = bendFrom(along, isPlanar(index), getBends(index, division.getMonomers(s-1)+monomers, kT), random);
        nodes.push_back(nodes.back()+along*drawLength(index, monomers, kT, random));
    }
    return nodes;
}

CarriedEnd ChainShapes::carryEnd(int index, MonomerRange before, MonomerRange after, int end,
        const vector<Vec3d>& nodes, double kT, RandomNumbers& random) {
    const int perSegment = tableOf(index).monomersPerSegment;
    const SegmentDivision old(before, perSegment), next(after, perSegment);
    // Outwards, from the node that stays.
    const int count = nodes.size(), staying = min(old.countSegments(), next.countSegments())-1;
    CarriedEnd result;
    result.segmentsBefore = old.countSegments()-staying;
    result.segmentsAfter = next.countSegments()-staying;
    auto at = [&] (int i) -> const Vec3d& {
        return nodes[end == 1 ? i : count-1-i];
    };
    const Vec3d along = at(staying+1)-at(staying);
    const double length = sqrt(along.squared());
    const int innerBefore = old.getMonomersFrom(end, result.segmentsBefore-1);
    const int inner = next.getMonomersFrom(end, result.segmentsAfter-1);
    Vec3d direction = along*(1/length);
    if (staying > 0) {
        const int behind = old.getMonomersFrom(end, result.segmentsBefore);
        direction = turn(unit(at(staying)-at(staying-1)), direction, isPlanar(index),
                getBends(index, behind+innerBefore, kT), getBends(index, behind+inner, kT), random);
    }
    // One that is of two segments, or becomes so, is another.
    const bool isCarried = result.segmentsAfter == 1 && (result.segmentsBefore == 1 || inner <= innerBefore);
    const double restLength = restLengthOf(index, inner);
    const double extension = isCarried ? carry(getLengths(index, innerBefore, kT), getLengths(index, inner, kT),
            length-restLengthOf(index, innerBefore), random) : getLengths(index, inner, kT).draw(random);
    for (int i = 0; i <= staying; i++)
        result.nodes.push_back(at(i));
    result.nodes.push_back(at(staying)+direction*(restLength+extension));
    if (result.segmentsAfter > 1) {
        const int last = next.getMonomersFrom(end, 0);
        const Vec3d further = bendFrom(direction, isPlanar(index), getBends(index, inner+last, kT), random);
        result.nodes.push_back(result.nodes.back()+further*drawLength(index, last, kT, random));
    }
    if (result.segmentsBefore > result.segmentsAfter)
        result.joint = min(1.0, static_cast<double>(innerBefore)/inner);
    if (result.segmentsBefore < result.segmentsAfter)
        result.joint = min(1.0, static_cast<double>(inner)/innerBefore);
    if (end == 0)
        reverse(result.nodes.begin(), result.nodes.end());
    return result;
}

/** Turn a segment to where its bend against the one behind it is carried: in the plane of both. */
Vec3d ChainShapes::turn(const Vec3d& along, const Vec3d& direction, bool flat, const BendLaw& from, const BendLaw& to,
        RandomNumbers& random) const {
    if (flat) {
        const double bend = atan2(along.x*direction.y-along.y*direction.x, along.dot(direction));
        const double carried = carry(from, to, bend, random);
        return carried == bend ? direction : turnInPlane(along, carried);
    }
    const double cosine = max(-1.0, min(1.0, along.dot(direction))), carried = carry(from, to, cosine, random);
    if (carried == cosine)
        return direction;
    Vec3d across = direction-along*cosine;
    across = across.squared() > 1e-20 ? unit(across) : findAcross(along);
    return along*carried+across*sqrt(max(0.0, (1-carried)*(1+carried)));
}

/** Draw the direction of a segment that is new. */
Vec3d ChainShapes::bendFrom(const Vec3d& along, bool flat, const BendLaw& law, RandomNumbers& random) const {
    const double bend = law.draw(random);
    if (flat)
        return turnInPlane(along, bend);
    const double azimuth = 2*M_PI*random.uniform(), sine = sqrt(max(0.0, (1-bend)*(1+bend)));
    return along*bend+findAcross(along, azimuth)*sine;
}
