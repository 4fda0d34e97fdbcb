#include "mechanics/MonomerTable.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

namespace {

int floorOfQuotient(int number, int divisor) {
    return number >= 0 ? number/divisor : -((-number+divisor-1)/divisor);
}

} // namespace

SegmentDivision::SegmentDivision(MonomerRange range, int monomersPerSegment) : range(range),
        perSegment(monomersPerSegment) {
    const int least = perSegment/2;
    firstJoint = -floorOfQuotient(-(range.first+least), perSegment);
    lastJoint = max(firstJoint-1, floorOfQuotient(range.last-least, perSegment));
}

int SegmentDivision::getMonomers(int segment) const {
    const int begin = segment == 0 ? range.first : (firstJoint+segment-1)*perSegment;
    const int end = segment == countSegments()-1 ? range.last : (firstJoint+segment)*perSegment;
    return end-begin;
}

void cylchain::setMonomers(Chain& chain, const MonomerTable& table, MonomerRange range) {
    vector<int> particles = chain.nodes;
    particles.insert(particles.end(), chain.spareNodes.begin(), chain.spareNodes.end());
    if (range.size() == 0) {
        chain.nodes.clear();
        chain.spareNodes.swap(particles);
        chain.fixed.clear();
        chain.segments.clear();
        chain.joints.clear();
        chain.start = 0;
        return;
    }
    const SegmentDivision division(range, table.monomersPerSegment);
    const int count = division.countSegments();
    chain.nodes.assign(particles.begin(), particles.begin()+count+1);
    chain.spareNodes.assign(particles.begin()+count+1, particles.end());
    chain.fixed.resize(count+1, false);
    chain.start = range.first*table.getSegment(1).restLength;
    chain.segments.resize(count);
    chain.joints.resize(count-1);
    for (int s = 0; s < count; s++)
        chain.segments[s] = table.getSegment(division.getMonomers(s));
    for (int joint = 0; joint < count-1; joint++)
        chain.joints[joint] = table.getJoint(division.getMonomers(joint)+division.getMonomers(joint+1));
}
