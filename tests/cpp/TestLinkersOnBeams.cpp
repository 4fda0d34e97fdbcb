/**
 * This tests linkers on curves of beam elements that stand still: numbers and places in equilibrium against partition
 * functions, how they walk along a curve and against a load, and what is found around places.
 */

#include "TestLinkerSystems.h"
#include <set>

static const double ALONG_Y[] = {0, 1, 0};

static const double ON_ARC[] = {0, -50, 0};

static Rods twoArcs() {
    Rods arcs;
    const double start[] = {0, -60, 15}, aside[] = {0.8, 0, 0.6};
    arcs.addArc(ON_ARC, ALONG_Y, ALONG_X, 50, 2, 50);
    arcs.addArc(start, ALONG_Y, aside, 75, 4, 25);
    return arcs;
}

/** Elements bend by a radian, so that the line between their nodes is far from the curve. */
static void testEquilibriumOnCurves() {
    Rods mixed;
    const double start[] = {-50, 20, 0};
    mixed.addArc(ON_ARC, ALONG_X, ALONG_Y, 50, 2, 50);
    mixed.add(start, ALONG_X, 2, 50);
    checkEquilibrium(twoArcs(), 0.05, 20, 70, 0.6, 10);
    checkEquilibrium(mixed, 0.02, 0, 120, 0.3, 0.5);
}

static void testEquilibriumInShortSteps() {
    checkEquilibrium(twoArcs(), 0.02, 0, 120, 0, 0.1);
}

/** On an arc, of which the curve of elements that bend by half a radian is hardly anything else. */
static void testWalkingAlongAnArc() {
    Rods rods;
    rods.addArc(ORIGIN, ALONG_X, ALONG_Y, 200, 8, 100);
    for (int direction : {1, -1}) {
        Hand hand = handOf(0, 100, 0, {0});
        hand.speed = 3*direction;
        LinkerKinetics kinetics(anchoredSystem(hand, 0, ORIGIN), rods.chains);
        LinkerState state = boundLinkers(1, 400);
        for (int i = 1; i <= 100; i++) {
            kinetics.advance(state, stepOf(rods.x, 1), SERIAL);
            vector<Link> links;
            kinetics.describe(state, links);
            double place[3];
            locate(links[0].first, rods.x.data(), NULL, place);
            const double angle = (400+3.0*direction*i)/200;
            const double expected[] = {200*cos(angle), 200*sin(angle), 0};
            for (int k = 0; k < 3; k++)
                checkClose(expected[k], place[k], 200, 3e-4, "on an arc");
        }
    }
}

/** Under a spring so soft that its force stays what it is: the tangent of the curve turns against it. */
static void testSpeedUnderLoadOnAnArc() {
    Rods rods;
    rods.addArc(ORIGIN, ALONG_X, ALONG_Y, 200, 8, 100);
    for (double force : {-2.0, 3.0})
        for (double position : {30.0, 160.0, 400.0, 777.0}) {
            Hand hand = handOf(0, 100, 0, {0});
            hand.speed = 2;
            hand.stallForce = 4;
            hand.walksBackward = true;
            const double far = 1e6, point[] = {force > 0 ? far : -far, 0, 0};
            LinkerKinetics kinetics(anchoredSystem(hand, fabs(force)/far, point), rods.chains);
            LinkerState state = boundLinkers(1, position);
            kinetics.advance(state, stepOf(rods.x, 0.01), SERIAL);
            const double along = -sin(position/200)*force, moved = state.linkers[0].hands[1].position-position;
            checkClose(2*min(2.0, 1+along/4), moved/0.01, 1, 2e-3, "speed on an arc");
        }
}

/** All places of curves within reach are in pieces that are found, however the curves bend and stretch. */
static void testCurvesAround() {
    NormalNumbers normal(5);
    const double box[] = {300, 0, 0, 70, 280, 0, -60, 40, 310};
    Rods rods;
    for (int i = 0; i < 60; i++) {
        BeamChain beam;
        beam.elementLength = 40;
        Array node = normal(3);
        for (double& value : node)
            value *= 200;
        for (int j = 0; j < 4; j++) {
            const Array turn = normal(3), apart = normal(3);
            const int first = rods.x.size()/3;
            beam.particles.insert(beam.particles.end(), {first, first+1});
            rods.x.insert(rods.x.end(), node.begin(), node.end());
            for (int k = 0; k < 3; k++)
                rods.x.push_back(node[k]+8*turn[k]);
            for (int k = 0; k < 3; k++)
                node[k] += 20*apart[k];
        }
        rods.chains.add(beam);
    }
    const Contours contours(rods.chains);
    check(contours.getNumSegments() == 180 && contours.getLength(7) == 120, "lengths of curves");
    for (const double* ofCells : {(const double*) NULL, box})
        for (double reach : {7.0, 35.0, 70.0}) {
            SegmentCells cells;
            cells.build(contours, rods.x.data(), reach, ofCells, NULL, true);
            for (int i = 0; i < 200; i++) {
                double point[3];
                const int segment = 7*i%180;
                const double along = 40*(i%13)/13.0;
                locate(contours.placeOn(segment, along/40), rods.x.data(), NULL, point);
                const bool ofPiece = i%2 == 0;
                const SegmentCells::Around found = ofPiece ?
                        cells.lookAround(cells.findPiece(contours, segment, along)) : cells.lookAround(point);
                set<pair<int, double> > around;
                for (int number = 0; number < found.numPieces; number++) {
                    const SegmentPiece& piece = cells.getAround(found, number);
                    around.insert({piece.segment, piece.start});
                }
                for (int s = 0; s < contours.getNumSegments(); s++)
                    for (double fraction = 0.0625; fraction < 1; fraction += 0.125) {
                        double place[3], square = 0;
                        locate(contours.placeOn(s, fraction), rods.x.data(), NULL, place);
                        for (int k = 0; k < 3; k++)
                            place[k] -= point[k];
                        if (ofCells != NULL)
                            takeToNearestImage(place, ofCells);
                        for (double component : place)
                            square += component*component;
                        const SegmentPiece& piece = cells.getPiece(cells.findPiece(contours, s, 40*fraction));
                        check(square > reach*reach || around.count({piece.segment, piece.start}) == 1,
                                "a place in reach is not found");
                    }
            }
        }
}

int main() {
    return runTests({testCurvesAround, testWalkingAlongAnArc, testSpeedUnderLoadOnAnArc, testEquilibriumOnCurves},
            {testEquilibriumInShortSteps});
}
