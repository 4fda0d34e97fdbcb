#include "couplings/TwistedContour.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

TwistedContour::Middle TwistedContour::findMiddle(double position) const {
    const int count = chain.segments.size();
    const int first = contours.findSegment(number, contours.getBegin(number));
    const int segment = contours.findSegment(number, position);
    const double length = contours.getSegmentLength(segment);
    const double beyond = position-contours.getStart(segment)-0.5*length;
    int before = beyond >= 0 ? segment-first : segment-first-1;
    // Beyond the middles at ends there is one segment alone.
    if (!chain.closed && before < 0)
        return {0, 0, length};
    if (!chain.closed && before == count-1)
        return {before, 0, length};
    before = (before+count)%count;
    const double distance = 0.5*(contours.getSegmentLength(first+before)+
            contours.getSegmentLength(first+(before+1)%count));
    const double along = beyond >= 0 ? beyond : distance+beyond;
    return {before, min(1.0, max(0.0, along/distance)), distance};
}

double TwistedContour::twistOf(int joint) const {
    const int count = chain.segments.size(), own = chain.closed ? (joint+count)%count : joint;
    return twists[own]-chain.twist.rest[chain.closed ? own : own-1];
}

double TwistedContour::torqueOf(int joint) const {
    const ChainTwist& twist = chain.twist;
    const int count = chain.segments.size();
    if (chain.closed)
        return twist.stiffness[(joint+count)%count]*twistOf(joint);
    if (joint > 0 && joint < count)
        return twist.stiffness[joint-1]*twistOf(joint);
    const EndFrame& frame = twist.ends[joint == 0 ? 0 : 1];
    if (frame.stiffness > 0)
        return frame.stiffness*twists[joint];
    return joint == 0 ? -frame.torque : frame.torque;
}

double TwistedContour::findTorque(double position, double range) const {
    const int count = chain.segments.size();
    const Middle middle = findMiddle(position);
    double result = 0;
    for (int side : {1, -1}) {
        double sum = 0, length = 0;
        int number = 0;
        for (int i = 1; 2*i <= count && (number == 0 || length < range); i++) {
            const int joint = side > 0 ? middle.segment+1+i : middle.segment+1-i;
            if (!chain.closed && (joint < 0 || joint > count))
                break;
            sum += torqueOf(joint);
            length += middle.distance;
            number++;
        }
        result += number > 0 ? side*sum/number : 0;
    }
    return result;
}

double TwistedContour::findTwist(const Middle& from, const Middle& to) const {
    const int count = chain.segments.size();
    int passed = to.segment-from.segment;
    if (chain.closed)
        passed -= count*static_cast<int>(round(passed/static_cast<double>(count)));
    double result = 0;
    for (int i = 1; i <= abs(passed); i++)
        result += passed > 0 ? twistOf(from.segment+i) : -twistOf(from.segment+1-i);
    result += to.share > 0 ? to.share*twistOf(to.segment+1) : 0;
    return result-(from.share > 0 ? from.share*twistOf(from.segment+1) : 0);
}

TurnedPair TwistedContour::describe(const HandOnHelix& hand, double position, double walked, double stepSize) const {
    const Middle middle = findMiddle(position);
    double before = position-walked;
    if (chain.closed)
        before -= contours.getLength(number)*floor(before/contours.getLength(number));
    const double turn = 2*M_PI/hand.pitch*walked+(walked == 0 ? 0 : findTwist(findMiddle(before), middle));
    const double shares[] = {1-middle.share, middle.share}, torque = -hand.friction*turn/stepSize;
    TurnedPair pair;
    pair.segment = middle.segment;
    pair.first = hand.friction*shares[0]*shares[0];
    pair.mixed = hand.friction*shares[0]*shares[1];
    pair.second = hand.friction*shares[1]*shares[1];
    for (int k = 0; k < 2; k++)
        pair.torque[k] = torque*shares[k];
    return pair;
}

void cylchain::addTurnedPair(vector<TurnedPair>& pairs, const TurnedPair& added) {
    const auto found = find_if(pairs.begin(), pairs.end(), [&] (const TurnedPair& pair) {
        return pair.segment == added.segment;
    });
    if (found == pairs.end()) {
        pairs.push_back(added);
        return;
    }
    found->first += added.first;
    found->mixed += added.mixed;
    found->second += added.second;
    for (int k = 0; k < 2; k++)
        found->torque[k] += added.torque[k];
}
