#include "openmm/CylinderChainLinkForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/CylinderChainLinkForceImpl.h"
#include "openmm/internal/LinkDescription.h"

using namespace OpenMM;
using namespace std;

static LinkColumns oneRow(int first1, int second1, double fraction1, int first2, int second2, double fraction2,
        const Vec3& point, int model, double restLength, double stiffness, double maximumExtension) {
    return LinkColumns({first1, second1, first2, second2}, {fraction1, fraction2}, {point[0], point[1], point[2]},
            {model}, {restLength, stiffness, maximumExtension});
}

static int fillColumns(const cylchain::LinkTable& table, vector<int>& numbers, LinkColumns& columns,
        vector<int>& active) {
    for (const cylchain::LinkEntry& entry : table.getEntries()) {
        numbers.push_back(entry.link.number);
        active.push_back(entry.active);
        columns.add(entry.link);
    }
    return table.getNextNumber();
}

static void giveColumns(const cylchain::LinkTable& table, vector<int>& numbers, vector<int>& ends,
        vector<double>& fractions, vector<double>& points, vector<int>& models, vector<double>& parameters,
        vector<int>& active, int& nextNumber) {
    LinkColumns columns;
    numbers.clear();
    active.clear();
    nextNumber = fillColumns(table, numbers, columns, active);
    ends.swap(columns.ends);
    fractions.swap(columns.fractions);
    points.swap(columns.points);
    models.swap(columns.models);
    parameters.swap(columns.parameters);
}

CylinderChainLinkForce::CylinderChainLinkForce() : usePeriodic(false), joinsTangents(false) {
}

vector<string> CylinderChainLinkForce::getStretchingModelNames() {
    return cylchain::namesOf<cylchain::StretchingModel>();
}

int CylinderChainLinkForce::getNumLinks() const {
    return table.getEntries().size();
}

vector<int> CylinderChainLinkForce::getLinkNumbers() const {
    vector<int> numbers;
    for (const cylchain::LinkEntry& entry : table.getEntries())
        numbers.push_back(entry.link.number);
    return numbers;
}

int CylinderChainLinkForce::getNextLinkNumber() const {
    return table.getNextNumber();
}

int CylinderChainLinkForce::addLink(int first1, int second1, double fraction1, int first2, int second2,
        double fraction2, StretchingModel stretchingModel, double restLength, double stiffness,
        double maximumExtension) {
    if (first2 < 0)
        throw OpenMMException("CylinderChainLinkForce: Illegal particle index: "+to_string(first2));
    const int number = table.getNextNumber();
    table.apply(changeToAdd(table, oneRow(first1, second1, fraction1, first2, second2, fraction2, Vec3(),
            stretchingModel, restLength, stiffness, maximumExtension)));
    return number;
}

int CylinderChainLinkForce::addLinkToPoint(int first, int second, double fraction, const Vec3& point,
        StretchingModel stretchingModel, double restLength, double stiffness, double maximumExtension) {
    const int number = table.getNextNumber();
    table.apply(changeToAdd(table, oneRow(first, second, fraction, -1, -1, 0, point, stretchingModel, restLength,
            stiffness, maximumExtension)));
    return number;
}

void CylinderChainLinkForce::removeLink(int number) {
    table.apply(changeToRemove(table, {number}));
}

const cylchain::LinkEntry& CylinderChainLinkForce::getEntry(int number) const {
    return findEntry(table, number);
}

void CylinderChainLinkForce::replaceEntry(const cylchain::LinkEntry& entry) {
    cylchain::LinkChange change;
    change.nextNumber = table.getNextNumber();
    change.put.push_back(entry);
    table.apply(change);
}

void CylinderChainLinkForce::getLinkPlaces(int number, int& first1, int& second1, double& fraction1, int& first2,
        int& second2, double& fraction2, Vec3& point) const {
    const cylchain::Link& link = getEntry(number).link;
    first1 = link.first.first;
    second1 = link.first.second;
    fraction1 = link.first.fraction;
    first2 = link.second.first;
    second2 = link.second.second;
    fraction2 = link.second.fraction;
    point = Vec3(link.second.point[0], link.second.point[1], link.second.point[2]);
}

void CylinderChainLinkForce::setLinkPlaces(int number, int first1, int second1, double fraction1, int first2,
        int second2, double fraction2, const Vec3& point) {
    const cylchain::LinkEntry& old = getEntry(number);
    cylchain::LinkEntry entry = oneRow(first1, second1, fraction1, first2, second2, fraction2, point,
            static_cast<int>(old.link.model), old.link.restLength, old.link.stiffness,
            old.link.maximumExtension).getEntry(0, number);
    entry.active = old.active;
    replaceEntry(entry);
}

void CylinderChainLinkForce::getLinkParameters(int number, int& stretchingModel, double& restLength,
        double& stiffness, double& maximumExtension) const {
    const cylchain::Link& link = getEntry(number).link;
    stretchingModel = static_cast<int>(link.model);
    restLength = link.restLength;
    stiffness = link.stiffness;
    maximumExtension = link.maximumExtension;
}

void CylinderChainLinkForce::setLinkParameters(int number, StretchingModel stretchingModel, double restLength,
        double stiffness, double maximumExtension) {
    table.apply(changeParameters(table, {number}, {stretchingModel}, {restLength, stiffness, maximumExtension}));
}

void CylinderChainLinkForce::getDefaultLinkParameters(int& stretchingModel, double& restLength, double& stiffness,
        double& maximumExtension) const {
    stretchingModel = static_cast<int>(defaults.model);
    restLength = defaults.restLength;
    stiffness = defaults.stiffness;
    maximumExtension = defaults.maximumExtension;
}

void CylinderChainLinkForce::setDefaultLinkParameters(StretchingModel stretchingModel, double restLength,
        double stiffness, double maximumExtension) {
    // A link between any two particles, which is checked like all others.

    defaults = oneRow(0, -1, 0, 1, -1, 0, Vec3(), stretchingModel, restLength, stiffness, maximumExtension)
            .getEntry(0, 0).link;
}

bool CylinderChainLinkForce::isLinkActive(int number) const {
    return getEntry(number).active;
}

void CylinderChainLinkForce::setLinkActive(int number, bool active) {
    table.apply(changeToSwitch(table, {number}, active));
}

void CylinderChainLinkForce::getLinks(vector<int>& numbers, vector<int>& ends, vector<double>& fractions,
        vector<double>& points, vector<int>& models, vector<double>& parameters, vector<int>& active,
        int& nextNumber) const {
    giveColumns(table, numbers, ends, fractions, points, models, parameters, active, nextNumber);
}

void CylinderChainLinkForce::setLinks(const vector<int>& numbers, const vector<int>& ends,
        const vector<double>& fractions, const vector<double>& points, const vector<int>& models,
        const vector<double>& parameters, const vector<int>& active, int nextNumber) {
    table = makeTable(numbers, LinkColumns(ends, fractions, points, models, parameters), active, nextNumber);
}

CylinderChainLinkForceImpl& CylinderChainLinkForce::getImpl(Context& context) const {
    return dynamic_cast<CylinderChainLinkForceImpl&>(getImplInContext(context));
}

int CylinderChainLinkForce::addLinkInContext(Context& context, int first1, int second1, double fraction1, int first2,
        int second2, double fraction2, StretchingModel stretchingModel, double restLength, double stiffness,
        double maximumExtension) const {
    if (first2 < 0)
        throw OpenMMException("CylinderChainLinkForce: Illegal particle index: "+to_string(first2));
    CylinderChainLinkForceImpl& impl = getImpl(context);
    const int number = impl.getTable().getNextNumber();
    impl.change(changeToAdd(impl.getTable(), oneRow(first1, second1, fraction1, first2, second2, fraction2, Vec3(),
            stretchingModel, restLength, stiffness, maximumExtension)));
    return number;
}

int CylinderChainLinkForce::addLinkToPointInContext(Context& context, int first, int second, double fraction,
        const Vec3& point, StretchingModel stretchingModel, double restLength, double stiffness,
        double maximumExtension) const {
    CylinderChainLinkForceImpl& impl = getImpl(context);
    const int number = impl.getTable().getNextNumber();
    impl.change(changeToAdd(impl.getTable(), oneRow(first, second, fraction, -1, -1, 0, point, stretchingModel,
            restLength, stiffness, maximumExtension)));
    return number;
}

int CylinderChainLinkForce::addLinksInContext(Context& context, const vector<int>& ends,
        const vector<double>& fractions, const vector<double>& points, const vector<int>& models,
        const vector<double>& parameters) const {
    CylinderChainLinkForceImpl& impl = getImpl(context);
    const int number = impl.getTable().getNextNumber();
    impl.change(changeToAdd(impl.getTable(), LinkColumns(ends, fractions, points, models, parameters)));
    return number;
}

void CylinderChainLinkForce::removeLinksInContext(Context& context, const vector<int>& numbers) const {
    CylinderChainLinkForceImpl& impl = getImpl(context);
    impl.change(changeToRemove(impl.getTable(), numbers));
}

void CylinderChainLinkForce::setLinksActiveInContext(Context& context, const vector<int>& numbers,
        bool active) const {
    CylinderChainLinkForceImpl& impl = getImpl(context);
    impl.change(changeToSwitch(impl.getTable(), numbers, active));
}

void CylinderChainLinkForce::setLinkParametersInContext(Context& context, const vector<int>& numbers,
        const vector<int>& models, const vector<double>& parameters) const {
    CylinderChainLinkForceImpl& impl = getImpl(context);
    impl.change(changeParameters(impl.getTable(), numbers, models, parameters));
}

void CylinderChainLinkForce::getLinksInContext(Context& context, vector<int>& numbers, vector<int>& ends,
        vector<double>& fractions, vector<double>& points, vector<int>& models, vector<double>& parameters,
        vector<int>& active, int& nextNumber) const {
    giveColumns(getImpl(context).getTable(), numbers, ends, fractions, points, models, parameters, active,
            nextNumber);
}

void CylinderChainLinkForce::setLinksInContext(Context& context, const vector<int>& numbers,
        const vector<int>& ends, const vector<double>& fractions, const vector<double>& points,
        const vector<int>& models, const vector<double>& parameters, const vector<int>& active,
        int nextNumber) const {
    getImpl(context).setTable(makeTable(numbers, LinkColumns(ends, fractions, points, models, parameters),
            active, nextNumber));
}

int CylinderChainLinkForce::getNextLinkNumberInContext(Context& context) const {
    return getImpl(context).getTable().getNextNumber();
}

string CylinderChainLinkForce::getDigestParameter(Context& context) const {
    return getImpl(context).getDigestParameter();
}

void CylinderChainLinkForce::setUsesPeriodicBoundaryConditions(bool periodic) {
    usePeriodic = periodic;
}

bool CylinderChainLinkForce::usesPeriodicBoundaryConditions() const {
    // Differences of tangents have no images.

    return usePeriodic && !joinsTangents;
}

vector<cylchain::Place> CylinderChainLinkForce::findPlaces(const PlaceResolver& resolver) const {
    vector<cylchain::Place> places;
    for (const cylchain::LinkEntry& entry : table.getEntries())
        for (const cylchain::Place* place : {&entry.link.first, &entry.link.second})
            places.push_back(joinsTangents ? resolver.resolveTangent(*place) : resolver.resolve(*place));
    return places;
}

ForceImpl* CylinderChainLinkForce::createImpl() const {
    return new CylinderChainLinkForceImpl(*this);
}
