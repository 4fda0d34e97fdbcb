#include "openmm/internal/CylinderChainLinkForceImpl.h"
#include "openmm/CylinderChainException.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/LinkDescription.h"
#include <algorithm>
#include <sstream>

using namespace OpenMM;
using namespace std;

CylinderChainLinkForceImpl::CylinderChainLinkForceImpl(const CylinderChainLinkForce& owner) : SpringForceImpl(owner),
        owner(owner), upToDate(false), version(0) {
}

void CylinderChainLinkForceImpl::initialize(ContextImpl& context) {
    const System& system = context.getSystem();
    places.reset(new PlaceResolver(system));

    // Each such Force of a System has a parameter of its own.

    int before = 0;
    for (int i = 0; i < system.getNumForces(); i++) {
        const Force* force = &system.getForce(i);
        if (force == &owner)
            parameter = "CylinderChainLinks"+to_string(before);
        if (dynamic_cast<const CylinderChainLinkForce*>(force) != NULL)
            before++;
    }
    const cylchain::LinkChange change = history.getTable().changeTo(owner.getTable());
    check(change);
    history = cylchain::LinkHistory(owner.getTable());
    initializeLinks(context, owner.usesPeriodicBoundaryConditions());
}

map<string, double> CylinderChainLinkForceImpl::getDefaultParameters() {
    return {{parameter, (double) history.getTable().getDigest()}};
}

void CylinderChainLinkForceImpl::check(const cylchain::LinkChange& change) const {
    for (const cylchain::LinkEntry& entry : change.put) {
        checkLink(entry.link, *places);
        if (!owner.getJoinsTangents())
            continue;
        for (const cylchain::Place* place : {&entry.link.first, &entry.link.second})
            if (!place->isPoint() && !places->resolveTangent(*place).isTangent())
                throw OpenMMException("CylinderChainLinkForce: Link "+to_string(entry.link.number)+
                        " joins tangents, but is not on the curve of a beam element, "+describePlaces(entry.link)+
                        ": take places between neighbouring nodes of chains of beam elements");
    }
}

void CylinderChainLinkForceImpl::follow() {
    const double value = context->getParameter(parameter);
    if (value == (double) history.getTable().getDigest())
        return;
    upToDate = false;
    version++;
    if (value >= 0 && value < 0x1p52 && history.goBack((uint64_t) value))
        return;
    if (value == (double) owner.getTable().getDigest()) {
        history.change(history.getTable().changeTo(owner.getTable()));
        return;
    }
    throw CylinderChainException(CylinderChainException::UnknownLinks, {},
            "CylinderChainLinkForce: The links of this Context are not known: it was reinitialized, or has got a State "
            "or checkpoint of another Context, or one from more than "+to_string(cylchain::LinkHistory::CHANGES)+
            " changes ago. Give it the links that belong to it by setLinksInContext(), or Crosslinks.set_table() in "
            "Python. The checkpoints of a CylinderChainIntegrator, and States that hold its parameters "
            "(getState(integratorParameters=True)), restore links themselves");
}

void CylinderChainLinkForceImpl::accept(const cylchain::LinkChange& change) {
    check(change);
    if (change.size() > 0 || change.nextNumber != history.getTable().getNextNumber())
        history.change(change);
    upToDate = false;
    version++;
    context->setParameter(parameter, (double) history.getTable().getDigest());
}

cylchain::Place CylinderChainLinkForceImpl::resolve(const cylchain::Place& place) const {
    return owner.getJoinsTangents() ? places->resolveTangent(place) : places->resolve(place);
}

const cylchain::LinkTable& CylinderChainLinkForceImpl::getTable() {
    follow();
    return history.getTable();
}

long long CylinderChainLinkForceImpl::getVersion() {
    follow();
    return version;
}

void CylinderChainLinkForceImpl::change(const cylchain::LinkChange& change) {
    follow();
    accept(change);
}

void CylinderChainLinkForceImpl::setTable(const cylchain::LinkTable& table) {
    accept(history.getTable().changeTo(table));
}

const vector<cylchain::Link>& CylinderChainLinkForceImpl::getLinks() {
    follow();
    if (!upToDate) {
        links.clear();
        for (const cylchain::LinkEntry& entry : history.getTable().getEntries())
            if (entry.active) {
                links.push_back(entry.link);
                links.back().first = resolve(entry.link.first);
                links.back().second = resolve(entry.link.second);
            }
        upToDate = true;
    }
    return links;
}

double CylinderChainLinkForceImpl::calcForcesAndEnergy(ContextImpl&, bool includeForces, bool includeEnergy,
        int groups) {
    if (!isIn(groups))
        return 0.0;

    // An implicit step computes the forces itself, but it must begin within the range of each link.

    const vector<cylchain::Link>& present = getLinks();
    const bool anyRange = any_of(present.begin(), present.end(), [] (const cylchain::Link& link) {
        return hasRange(link.model);
    });
    if (isExcluded() && !anyRange)
        return 0.0;
    int outOfRange = -1;
    const double energy = computeLinks(includeForces && !isExcluded(), includeEnergy && !isExcluded(), outOfRange);
    if (outOfRange != -1)
        reportLink(outOfRange);
    return energy;
}

vector<cylchain::Place> CylinderChainLinkForceImpl::findPlaces(const PlaceResolver&) {
    vector<cylchain::Place> found;
    for (const cylchain::Link& link : getLinks())
        found.insert(found.end(), {link.first, link.second});
    return found;
}

StateColumns CylinderChainLinkForceImpl::storeState(bool) {
    return storeTable(getTable());
}

void CylinderChainLinkForceImpl::restoreState(const StateColumns& columns) {
    setTable(restoreTable(columns));
}

void CylinderChainLinkForceImpl::reportLink(int index) {
    const cylchain::Link& link = links[index];
    const double length = findPull(link.number).length;
    stringstream message;
    message << "Link " << link.number << " " << describePlaces(history.getTable().find(link.number)->link) <<
            " has blown up: its length of " << length << " nm is outside " << link.restLength << " -/+ " <<
            link.maximumExtension << " nm of the FENE potential. Use a smaller time step, or look for places that are "
            "too far apart.";
    CylinderChainException::Place place;
    place.link = link.number;
    throw CylinderChainException(CylinderChainException::LinkOutOfRange, place, message.str());
}
