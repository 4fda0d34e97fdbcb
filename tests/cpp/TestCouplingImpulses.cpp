/**
 * This tests sums of the forces of walls and contacts: who is told of which steps, and what is stored.
 */

#include "TestChains.h"
#include "couplings/CouplingImpulses.h"

static Push pushOn(int particle, int first, int second, double force) {
    Push push;
    push.particles[0] = particle;
    push.shares[0] = 1;
    push.force[2] = force;
    push.load = fabs(force);
    push.between = {first, second};
    return push;
}

static void testWhatIsTold() {
    CouplingImpulses impulses(2);
    const int late = impulses.addReader();
    impulses.add(pushOn(1, 0, -1, 3), 0.5);
    impulses.beginStep();
    // The step before has not happened.
    impulses.add(pushOn(1, 0, -1, 2), 0.5);
    impulses.add(pushOn(1, 0, -1, -4), 0.25);
    impulses.finishStep(1);
    CouplingImpulses::Sums told = impulses.take(0);
    checkClose(1, told.time, 1, 0, "the time of a step");
    checkClose(0, told.particles[5], 1, 0, "the impulse on a particle");
    checkClose(2, told.loads[make_pair(0, -1)].size, 1, 0, "the load of a face");
    impulses.beginStep();
    impulses.add(pushOn(0, 1, -1, 1), 2);
    impulses.finishStep(2);
    told = impulses.take(late);
    checkClose(3, told.time, 1, 0, "the time of two steps");
    checkClose(2, told.particles[2], 1, 0, "the impulse of the second one");
    check(told.loads.size() == 2, "both faces have pushed");
    checkClose(2, impulses.take(0).time, 1, 0, "the time since the first one");
    checkClose(0, impulses.take(0).time, 1, 0, "no time at all");
}

static void testStorage() {
    CouplingImpulses impulses(1), other(1);
    impulses.add(pushOn(0, 0, -1, 1), 1);
    impulses.finishStep(1);
    impulses.addReader();
    impulses.add(pushOn(0, 0, -1, 5), 1);
    impulses.finishStep(1);
    other.restore(impulses.getLatest(), impulses.getReaders());
    for (int reader : {0, 1})
        checkClose(impulses.take(reader).particles[2], other.take(reader).particles[2], 1, 0, "a restored sum");
    other.restore(CouplingImpulses(1).getLatest(), CouplingImpulses(1).getReaders());
    checkClose(0, other.take(1).time, 1, 0, "a reader who is not in what was stored");
}

static void testPairsOfNobody() {
    for (bool asks : {false, true}) {
        CouplingImpulses impulses(1);
        if (asks)
            impulses.take(0);
        for (int i = 0; i < 100001; i++)
            impulses.add(pushOn(0, 0, i, 1), 1);
        impulses.finishStep(1);
        checkClose(asks ? 1 : 0, impulses.take(0).time, 1, 0, "sums of many pairs are kept for who asks");
    }
}

int main() {
    return runTests({testWhatIsTold, testStorage, testPairsOfNobody});
}
