/**
 * This tests when Newton's method ends: changes that become smaller by the same factor, or that go with the square of
 * the one before, leave less than the tolerance; what does not become smaller ends with the tolerance itself; what is
 * not a number does not end.
 */

#include "TestChains.h"
#include "dynamics/LastChange.h"

static const double TOLERANCE = 0.1;

/** Change a number from some distance to its limit, by Newton's method or the like; returns what is left at the end. */
template <class Function> static double findRest(double distance, Function next) {
    double before = 0;
    for (int iteration = 0; iteration < 100; iteration++) {
        const double after = next(distance), change = distance-after;
        if (isLastChange(change*change, before, TOLERANCE*TOLERANCE))
            return fabs(after);
        before = change*change;
        distance = after;
    }
    return fabs(distance);
}

static void testConvergence() {
    for (double begin : {0.5, 3.0, 20.0}) {
        for (double factor : {0.02, 0.1, 0.3, 0.5, -0.3}) {
            const double rest = findRest(begin, [&] (double distance) {return factor*distance;});
            check(rest < TOLERANCE, "what is left is within the tolerance");
        }
        auto square = [&] (double distance) {return distance*distance/(distance+1);};
        check(findRest(begin, square) < 0.1*TOLERANCE, "far less is left where changes are squared");
    }
    // A change of twice the tolerance after a far larger one is enough.
    check(isLastChange(4, 400, 1) && isLastChange(1, 0, 1), "it ends");
    check(!isLastChange(4, 0, 1), "nothing is known of the change before");
    check(!isLastChange(4, 16, 1), "changes become smaller too slowly");
    check(!isLastChange(10, 1e6, 1), "the last change is too large whatever came before");
}

/** Without a tolerance, nothing but no change is small enough. */
static void testEnds() {
    check(isLastChange(0, 0, 0) && isLastChange(0, 1, 0) && !isLastChange(1e-300, 1, 0), "no tolerance");
    check(!isLastChange(NAN, 1, 1) && !isLastChange(NAN, NAN, 1) && !isLastChange(4, NAN, 1), "not a number");
    check(!isLastChange(HUGE_VAL, HUGE_VAL, 1), "not finite");
}

int main() {
    return runTests({testConvergence, testEnds});
}
