// The classes of OpenMM from which those of this module are derived, and that which their methods take.

namespace OpenMM {

class Context {
};

class Force {
};

class Integrator {
};

class System {
};

} // namespace OpenMM
