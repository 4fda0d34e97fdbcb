#include "openmm/internal/LinkDescription.h"
#include "openmm/OpenMMException.h"
#include <algorithm>
#include <cmath>
#include <climits>
#include <sstream>

using namespace cylchain;
using namespace std;

namespace OpenMM {

static void refuse(const string& message) {
    throw OpenMMException("CylinderChainLinkForce: "+message);
}

static void refuseLink(const Link& link, const string& message) {
    refuse("Link "+to_string(link.number)+" "+message);
}

static void checkColumn(const char* name, size_t size, size_t expected) {
    if (size != expected)
        refuse(string("There must be ")+to_string(expected)+" "+name+", but there are "+to_string(size));
}

LinkColumns::LinkColumns(const vector<int>& ends, const vector<double>& fractions, const vector<double>& points,
        const vector<int>& models, const vector<double>& parameters) : ends(ends), fractions(fractions),
        points(points), models(models), parameters(parameters) {
    checkColumn("ends", ends.size(), 4*size());
    checkColumn("fractions", fractions.size(), 2*size());
    checkColumn("parameters", parameters.size(), 3*size());
    if (points.empty())
        this->points.assign(3*size(), 0);
    checkColumn("coordinates of points", this->points.size(), 3*size());
}

void LinkColumns::add(const Link& link) {
    ends.insert(ends.end(), {link.first.first, link.first.second, link.second.first, link.second.second});
    fractions.insert(fractions.end(), {link.first.fraction, link.second.fraction});
    points.insert(points.end(), link.second.point, link.second.point+3);
    models.push_back(static_cast<int>(link.model));
    parameters.insert(parameters.end(), {link.restLength, link.stiffness, link.maximumExtension});
}

static Place makePlace(int first, int second, double fraction) {
    Place place;
    place.first = first;
    place.second = second;
    // What has no effect is not kept, so that equal places have equal digests.
    place.fraction = second == -1 ? 0 : fraction;
    return place;
}

static void setParameters(Link& link, int model, const double* parameters) {
    if (!isEntry<StretchingModel>(model))
        refuseLink(link, "has an illegal stretching model: "+to_string(model));
    link.model = static_cast<StretchingModel>(model);
    link.restLength = parameters[0];
    link.stiffness = parameters[1];
    link.maximumExtension = hasRange(link.model) ? parameters[2] : 0;
}

LinkEntry LinkColumns::getEntry(size_t row, uint32_t number) const {
    LinkEntry entry;
    Link& link = entry.link;
    link.number = number;
    link.first = makePlace(ends[4*row], ends[4*row+1], fractions[2*row]);
    link.second = makePlace(ends[4*row+2], ends[4*row+3], fractions[2*row+1]);
    if (link.second.isPoint())
        copy(&points[3*row], &points[3*row]+3, link.second.point);
    setParameters(link, models[row], &parameters[3*row]);
    checkLink(link);
    return entry;
}

static void checkPlace(const Link& link, const Place& place) {
    if (place.isPoint()) {
        if (place.first != -1 || place.second != -1)
            refuseLink(link, "has an illegal particle index: "+to_string(min(place.first, place.second)));
        for (double coordinate : place.point)
            if (!isfinite(coordinate))
                refuseLink(link, "has a point that is not finite");
        return;
    }
    if (place.second < -1)
        refuseLink(link, "has an illegal particle index: "+to_string(place.second));
    if (place.first == place.second)
        refuseLink(link, "has a place between particle "+to_string(place.first)+" and itself");
    if (!(place.fraction >= 0 && place.fraction <= 1))
        refuseLink(link, "has a fraction that is not between 0 and 1");
}

static void checkNotNegative(const Link& link, double value, const char* name) {
    if (!(value >= 0 && isfinite(value)))
        refuseLink(link, string("has a ")+name+" that is negative or not finite");
}

void checkLink(const Link& link) {
    checkPlace(link, link.first);
    checkPlace(link, link.second);
    if (link.first.isPoint())
        refuseLink(link, "joins no particle with its first place: give a point as the second");
    if (areSame(link.first, link.second))
        refuseLink(link, "joins a place to itself, "+describePlaces(link));
    checkNotNegative(link, link.restLength, "rest length");
    checkNotNegative(link, link.stiffness, "stiffness");
    if (hasRange(link.model) && !(link.maximumExtension > 0 && isfinite(link.maximumExtension)))
        refuseLink(link, "has a maximum extension that is not positive and finite");
}

void checkLink(const Link& link, const PlaceResolver& places) {
    const System& system = places.getSystem();
    for (const Place* place : {&link.first, &link.second})
        for (int particle : {place->first, place->second}) {
            if (particle >= system.getNumParticles())
                refuseLink(link, "has particle "+to_string(particle)+", which does not exist; the System has "+
                        to_string(system.getNumParticles()));
            if (particle >= 0 && places.isControlPoint(particle))
                refuseLink(link, "has particle "+to_string(particle)+", a control point of beam elements, which is on "
                        "no curve: take places between nodes");
        }
    if (areSame(places.resolve(link.first), places.resolve(link.second)))
        refuseLink(link, "joins a place to itself, "+describePlaces(link)+
                ": one is a virtual site at the other");
}

StateColumns storeTable(const LinkTable& table) {
    vector<int> numbers, active;
    LinkColumns links;
    for (const LinkEntry& entry : table.getEntries()) {
        numbers.push_back(entry.link.number);
        active.push_back(entry.active);
        links.add(entry.link);
    }
    StateColumns columns;
    columns.put("nextNumber", table.getNextNumber());
    columns.put("numbers", numbers);
    columns.put("active", active);
    columns.put("ends", links.ends);
    columns.put("fractions", links.fractions);
    columns.put("points", links.points);
    columns.put("models", links.models);
    columns.put("parameters", links.parameters);
    return columns;
}

LinkTable restoreTable(const StateColumns& columns) {
    const LinkColumns links(columns.get<int>("ends"), columns.get<double>("fractions"), columns.get<double>("points"),
            columns.get<int>("models"), columns.get<double>("parameters"));
    return makeTable(columns.get<int>("numbers"), links, columns.get<int>("active"),
            columns.getOne<int>("nextNumber"));
}

LinkTable makeTable(const vector<int>& numbers, const LinkColumns& columns, const vector<int>& active,
        int nextNumber) {
    checkColumn("numbers", numbers.size(), columns.size());
    checkColumn("states of being on or off", active.size(), columns.size());
    LinkChange change;
    for (size_t i = 0; i < numbers.size(); i++) {
        if (numbers[i] < 0 || (i > 0 && numbers[i] <= numbers[i-1]))
            refuse("The numbers of links must ascend from 0 on");
        LinkEntry entry = columns.getEntry(i, numbers[i]);
        entry.active = (active[i] != 0);
        change.put.push_back(entry);
    }
    if (nextNumber < 0 || (!numbers.empty() && nextNumber <= numbers.back()))
        refuse("The next number must be above those of all links");
    change.nextNumber = nextNumber;
    LinkTable table;
    table.apply(change);
    return table;
}

static void describePlace(ostream& text, const Place& place) {
    if (place.isPoint())
        text << "the point (" << place.point[0] << ", " << place.point[1] << ", " << place.point[2] << ") nm";
    else if (place.isOnSegment())
        text << "the place " << place.fraction << " from particle " << place.first << " to " << place.second;
    else
        text << "particle " << place.first;
}

string describePlaces(const Link& link) {
    stringstream text;
    text << "between ";
    if (link.first.isOnSegment() || link.second.isOnSegment() || link.second.isPoint()) {
        describePlace(text, link.first);
        text << " and ";
        describePlace(text, link.second);
    }
    else
        text << "particles " << link.first.first << " and " << link.second.first;
    return text.str();
}

LinkChange changeToAdd(const LinkTable& table, const LinkColumns& columns) {
    LinkChange change;
    if (columns.size() > (size_t) INT_MAX-table.getNextNumber())
        refuse("There are no numbers left for further links");
    change.nextNumber = table.getNextNumber()+columns.size();
    for (size_t i = 0; i < columns.size(); i++)
        change.put.push_back(columns.getEntry(i, table.getNextNumber()+i));
    return change;
}

const LinkEntry& findEntry(const LinkTable& table, int number) {
    const LinkEntry* entry = number < 0 ? NULL : table.find(number);
    if (entry == NULL)
        refuse("Link "+to_string(number)+" does not exist");
    return *entry;
}

/** Entries of a table, in the order of their numbers, and where each number is among those that were given. */
static vector<pair<const LinkEntry*, size_t> > findEntries(const LinkTable& table, const vector<int>& numbers) {
    vector<pair<const LinkEntry*, size_t> > found;
    found.reserve(numbers.size());
    for (size_t i = 0; i < numbers.size(); i++)
        found.emplace_back(&findEntry(table, numbers[i]), i);
    // All are of one vector.
    sort(found.begin(), found.end());
    for (size_t i = 1; i < found.size(); i++)
        if (found[i].first == found[i-1].first)
            refuse("Link "+to_string(found[i].first->link.number)+" is named twice");
    return found;
}

LinkChange changeToRemove(const LinkTable& table, const vector<int>& numbers) {
    LinkChange change;
    change.nextNumber = table.getNextNumber();
    for (auto& one : findEntries(table, numbers))
        change.removed.push_back(one.first->link.number);
    return change;
}

LinkChange changeToSwitch(const LinkTable& table, const vector<int>& numbers, bool active) {
    LinkChange change;
    change.nextNumber = table.getNextNumber();
    for (auto& one : findEntries(table, numbers)) {
        change.put.push_back(*one.first);
        change.put.back().active = active;
    }
    return change;
}

LinkChange changeParameters(const LinkTable& table, const vector<int>& numbers, const vector<int>& models,
        const vector<double>& parameters) {
    checkColumn("models", models.size(), numbers.size());
    checkColumn("parameters", parameters.size(), 3*numbers.size());
    LinkChange change;
    change.nextNumber = table.getNextNumber();
    for (auto& one : findEntries(table, numbers)) {
        change.put.push_back(*one.first);
        Link& link = change.put.back().link;
        setParameters(link, models[one.second], &parameters[3*one.second]);
        checkLink(link);
    }
    return change;
}

} // namespace OpenMM
