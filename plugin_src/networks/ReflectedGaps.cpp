#include "networks/ReflectedGaps.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** What the last iteration may change of a gap, over the thermal scale. */
const double OF_ITERATIONS = 0.03;
/** Gaps that end farther than this from where the equations have led them have turned: others keep their responses. */
const double OF_RESPONSES = 0.1;
/** What responses lack may go back and forth between gaps that links move together: it changes by this share then. */
const double DAMPING_OF_GAPS = 0.5;
/** A ceiling pulls a gap back by less than this, over the way that it would go beyond and its thermal motion. */
const double LARGEST_PULL = 10;
/** What iterations may leave to change of a gap where nothing moves thermally, in nm. */
const double LEAST_CHANGE_OF_GAPS = 1e-7;
/** A gap that has just been found is pushed if its exponential variate is less than this. */
const double LARGE_REFLECTION = 4;

} // namespace

void ReflectedGaps::begin(const StepSettings& settings, const ChainPlaces& places) {
    responses.begin(places.getNumChains());
    motion.begin(settings);
    kT = settings.kT;
    precision = settings.precision;
    gaps.clear();
    for (vector<double>* values : {&forces, &free, &predicted, &changes, &corrections, &applied, &lacking})
        values->clear();
    turned.clear();
}

void ReflectedGaps::turn(int number, const Gap& gap) {
    gaps[number] = gap;
    if (number < (int) turned.size())
        turned[number] = 1;
}

int ReflectedGaps::add(const Gap& gap) {
    gaps.push_back(gap);
    return gaps.size()-1;
}

void ReflectedGaps::addEquations(vector<CouplingEquation>& equations, const Loop& loop) {
    if (!gaps.empty())
        responses.setLinks(equations);
    firstEquations.resize(gaps.size()+1);
    size_t next = equations.size();
    for (size_t i = 0; i < gaps.size(); i++) {
        firstEquations[i] = next;
        next += gaps[i].numLevers;
    }
    firstEquations[gaps.size()] = next;
    equations.resize(next);
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int i) {
        for (int lever = 0; lever < gaps[i].numLevers; lever++) {
            CouplingEquation& equation = equations[firstEquations[i]+lever];
            copy_n(gaps[i].levers[lever].places, 2, equation.places);
            fill_n(equation.force, 3, 0.0);
            const double force = gaps[i].present ? max(0.0, getForce(i)) : 0;
            for (int k = 0; k < 6; k++)
                equation.stiffness[k] = force*gaps[i].turning[k];
        }
    });
}

/** Find the part of each gap in an iteration from the chains that need it. */
void ReflectedGaps::findRoles(const vector<char>& goingOn) {
    roles.assign(gaps.size(), GapRole::Apart);
    hasPushed.assign(responses.getNumChains(), 0);
    auto anyChainIs = [&] (int gap, const vector<char>& marks) {
        bool result = false;
        responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int) {
            result |= marks[responses.numberOf(chain)] != 0;
        });
        return result;
    };
    for (size_t i = 0; i < gaps.size(); i++)
        if (anyChainIs(i, goingOn)) {
            roles[i] = GapRole::Pushed;
            responses.forPorts(i, [&] (const GapResponses::ChainPorts& chain, int) {
                hasPushed[responses.numberOf(chain)] = 1;
            });
        }
    for (size_t i = 0; i < gaps.size(); i++)
        if (roles[i] == GapRole::Apart && anyChainIs(i, hasPushed))
            roles[i] = GapRole::Beside;
}

/** Find the responses and random numbers that are not known. */
void ReflectedGaps::complete(const vector<PackStep*>& packs, CoupledEquations& coupled, bool single,
        const Loop& loop) {
    if (responses.isComplete() && motion.isComplete())
        return;
    responses.find(gaps, firstEquations, packs, coupled, precision, single, loop);
    if (motion.chooseParts()) {
        responses.takeForNew();
        roles.assign(gaps.size(), GapRole::Pushed);
        hasPushed.assign(responses.getNumChains(), 1);
    }
    motion.draw(loop);
}

/** Whether the chain of a gap's side takes part in the iteration. */
bool ReflectedGaps::takesPart(int i, int side) const {
    return gaps[i].packOf(side) >= 0 && (*active)[gaps[i].packOf(side)];
}

/** Whether it does not, and has a gap whose force is found. */
bool ReflectedGaps::waits(int i, int side) const {
    return isPushed(i, side) && !takesPart(i, side);
}

/** Whether it has a gap whose force is found. */
bool ReflectedGaps::isPushed(int i, int side) const {
    return roles[i] != GapRole::Apart && gaps[i].packOf(side) >= 0 && hasPushed[gaps[i].chainOf(side)];
}

/** Find where gaps end without their forces. */
void ReflectedGaps::findFreeEnds(const CoupledEquations& coupled, const Loop& loop) {
    motion.moveSides([&] (int i, int side) {
        return waits(i, side) ? applied[2*i+side] : 0;
    }, loop);
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int i) {
        double ofWaiting = 0, ofOthers = 0;
        for (int side = 0; side < 2; side++)
            if (takesPart(i, side)) {
                lacking[2*i+side] = 0;
                ofOthers += corrections[2*i+side];
            }
            else if (waits(i, side)) {
                lacking[2*i+side] = -motion.getMotion(i, side);
                ofWaiting += lacking[2*i+side];
            }
        if (roles[i] != GapRole::Pushed)
            return;
        predicted[i] = gaps[i].end;
        for (int lever = 0; lever < gaps[i].numLevers; lever++)
            predicted[i] += dot(gaps[i].levers[lever].gradient,
                    &coupled.getMoves()[3*(firstEquations[i]+lever-firstEquations[0])]);
        free[i] = predicted[i]+ofOthers+ofWaiting;
    });
}

/** Find where the equations lead gaps with their forces, and what responses lack of that. */
void ReflectedGaps::predictEnds(const CoupledEquations& coupled, const Loop& loop) {
    motion.moveSides([&] (int i, int side) {
        return isPushed(i, side) ? forces[i] : 0;
    }, loop);
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int i) {
        double more[2] = {}, pushed = 0;
        for (int side = 0; side < 2; side++) {
            if (waits(i, side))
                lacking[2*i+side] += motion.getMotion(i, side);
            if (!takesPart(i, side))
                continue;
            applied[2*i+side] = forces[i];
            if (!hasPushed[gaps[i].chainOf(side)])
                continue;
            double way = 0;
            for (int lever = 0; lever < gaps[i].numLevers; lever++)
                way += dot(gaps[i].levers[lever].gradient, coupled.getPushedMove(firstEquations[i]+lever, side).data());
            way = side == 0 ? way : -way;
            pushed += way;
            // Responses may be those of an iteration before, and others push through links.
            more[side] = way-motion.getMotion(i, side)-corrections[2*i+side];
        }
        const double change = more[0]+more[1];
        const bool isBack = coupled.joinsPlaces() && change*changes[i] < 0;
        for (int side = 0; side < 2; side++)
            corrections[2*i+side] += isBack ? DAMPING_OF_GAPS*more[side] : more[side];
        if (roles[i] != GapRole::Pushed)
            return;
        changes[i] = change;
        predicted[i] += pushed+lacking[2*i]+lacking[2*i+1];
    });
}

void ReflectedGaps::push(const vector<PackStep*>& packs, const PackFlags& newActive, const vector<char>& goingOn,
        CoupledEquations& coupled, const CoupledEquations::Demands& demands, const Loop& loop) {
    const size_t count = gaps.size();
    if (count == 0)
        return;
    active = &newActive;
    for (vector<double>* values : {&forces, &free, &predicted, &changes})
        values->resize(count, 0.0);
    for (vector<double>* values : {&corrections, &applied, &lacking})
        values->resize(2*count, 0.0);
    turned.assign(count, 0);
    const size_t first = firstEquations[0];
    responses.addPorts(gaps);
    motion.addGaps();
    findRoles(goingOn);
    complete(packs, coupled, demands.single, loop);
    coupled.predictMoves(packs, first, loop);
    findFreeEnds(coupled, loop);
    motion.findForces(roles, free, forces, loop);
    vector<double> loads(3*(firstEquations[count]-first));
    runInChunks(loop, count, CHUNK_OF_GAPS, [&] (int i) {
        for (int lever = 0; lever < gaps[i].numLevers; lever++)
            for (int k = 0; k < 3; k++)
                loads[3*(firstEquations[i]+lever-first)+k] = forces[i]*gaps[i].levers[lever].gradient[k];
    });
    coupled.push(packs, first, loads, demands, loop);
    predictEnds(coupled, loop);
}

/** Whether a gap that no iteration knows of yet may be pushed. */
bool ReflectedGaps::wouldPush(const Gap& gap) const {
    if (gap.law != GapLaw::Reflection)
        return gap.law == GapLaw::Spring || gap.end < 0;
    return gap.end < 0 || gap.start*gap.end < LARGE_REFLECTION*kT*gap.response;
}

/**
 * Whether a gap ends behind the surface that reflects it: forces without bound have led it there, or it has become one
 * after forces were found.
 */
bool ReflectedGaps::isBehind(int i) const {
    return gaps[i].present && gaps[i].law == GapLaw::Reflection &&
            gaps[i].end < -motion.getScale(i)-LEAST_CHANGE_OF_GAPS;
}

bool ReflectedGaps::isUnfinished(int i) const {
    return deviates(i, OF_ITERATIONS) || isBehind(i);
}

/** Whether a gap is farther from where the equations have led it than a share of its thermal scale. */
bool ReflectedGaps::deviates(int i, double share) const {
    if (!gaps[i].present)
        return false;
    if (i >= (int) predicted.size())
        return wouldPush(gaps[i]);
    const double *const lack = &lacking[2*(size_t) i], end = gaps[i].end+lack[0]+lack[1];
    return !(max({fabs(end-predicted[i]), fabs(changes[i]), fabs(lack[0]), fabs(lack[1])}) <=
            share*motion.getScale(i)+LEAST_CHANGE_OF_GAPS);
}

bool ReflectedGaps::anyUnfinished(const Loop& loop) {
    enum : char {Finished, Unfinished, HasTurned};
    progress.resize(gaps.size());
    runInChunks(loop, gaps.size(), CHUNK_OF_GAPS, [&] (int i) {
        progress[i] = Finished;
        if (isUnfinished(i))
            progress[i] = i < (int) predicted.size() && deviates(i, OF_RESPONSES) ? HasTurned : Unfinished;
    });
    bool any = false;
    for (size_t i = 0; i < gaps.size(); i++) {
        any |= progress[i] != Finished;
        // Its chains may have turned so far that their responses have changed.
        if (progress[i] == HasTurned)
            responses.forget(i);
    }
    return any;
}

/** Mark the chains of a gap. */
template <class Flags> void ReflectedGaps::markChains(int i, Flags& chains) const {
    for (int side = 0; side < 2; side++)
        if (gaps[i].packOf(side) >= 0)
            chains[gaps[i].chainOf(side)] = true;
}

void ReflectedGaps::markUnfinished(vector<char>& chains) const {
    for (size_t i = 0; i < gaps.size(); i++) {
        // Those that have just been found or turned, or have become none, change what chains are pushed by.
        const bool isOther = i >= predicted.size() || turned[i] || (!gaps[i].present && forces[i] != 0);
        if (isOther || isUnfinished(i))
            markChains(i, chains);
    }
    for (int chain : responses.getChains())
        if (!responses.isComplete(chain))
            chains[chain] = 1;
}

/**
 * Whether a gap that is held behind a ceiling is pulled back by much more than it would come out: where its contact has
 * gone on to another gap, which is pushed out, both turn their chains against each other.
 */
bool ReflectedGaps::isTorn(int i) const {
    const Gap& gap = gaps[i];
    if (gap.law != GapLaw::Spring || !(gap.ceiling < HUGE_VAL) || !(getForce(i) < 0))
        return false;
    return -forces[i]*responses.getOwn(i) > LARGEST_PULL*(fabs(free[i]-gap.ceiling)+sqrt(kT*responses.getOwn(i)));
}

void ReflectedGaps::findFailures(vector<bool>& failed) const {
    for (size_t i = 0; i < gaps.size(); i++)
        if (isUnfinished(i) || isTorn(i))
            markChains(i, failed);
}
