#include "mechanics/ChainList.h"
#include <cctype>

using namespace cylchain;
using namespace std;

int ChainList::addEntry(ChainKind kind, int index) {
    const int number = size();
    entries.push_back({kind, index, "Chain "+to_string(number)});
    numbers[static_cast<int>(kind)].push_back(number);
    return number;
}

int ChainList::add(const Chain& chain) {
    chains.push_back(chain);
    return addEntry(ChainKind::StraightSegments, chains.size()-1);
}

int ChainList::add(const BeamChain& beam) {
    beams.push_back(beam);
    return addEntry(ChainKind::BeamElements, beams.size()-1);
}

string ChainList::getNameInSentence(int number) const {
    string name = entries[number].name;
    if (!name.empty())
        name[0] = tolower(static_cast<unsigned char>(name[0]));
    return name;
}
