#include "TestChains.h"
int main() {return runTests({});}
