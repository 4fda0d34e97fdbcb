%module(package="openmm_cylchain") plugin

// What is inherited is in OpenMM's own module. Of its classes, no more need be known here.

%import(module="openmm") "openmm_bases.i"
%include "swig/typemaps.i"
%include <std_map.i>
%include <std_string.i>
%include <std_vector.i>

namespace std {
    %template() vector<int>;
    %template() map<int, double>;
    %template() vector<string>;
}

%{
#include "openmm/CylinderChainCoupling.h"
#include "openmm/CylinderChainException.h"
#include "openmm/CylinderChainBindingForce.h"
#include "openmm/CylinderChainContactForce.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/CylinderChainGrowthForce.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/CylinderChainLinkForce.h"
#include "openmm/CylinderChainWallForce.h"
#include "openmm/Context.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/serialization/XmlSerializer.h"
#include <sstream>

using namespace OpenMM;
%}

%feature("autodoc", "0");
%nodefaultctor;

/*
 * Exceptions keep their text and become openmm.OpenMMException.  Those that say where chains are wrong become
 * CylinderChainException, with that as attributes.
 */

%{
static PyObject* newNumber(long long number) {
    if (number >= 0)
        return PyLong_FromLongLong(number);
    Py_INCREF(Py_None);
    return Py_None;
}

static PyObject* newException(PyObject* type, const std::exception& e) {
    const CylinderChainException* own = dynamic_cast<const CylinderChainException*>(&e);
    if (own == NULL)
        return PyObject_CallFunction(type, "s", e.what());
    const CylinderChainException::Place& place = own->getPlace();
    return PyObject_CallFunction(type, "ssNNNNNNN", e.what(), own->getKindName(), newNumber(place.chain),
            newNumber(place.segment), newNumber(place.particle), newNumber(place.step), newNumber(place.link),
            newNumber(place.otherChain), newNumber(place.otherSegment));
}

static void raiseException(const std::exception& e) {
    const bool own = (dynamic_cast<const CylinderChainException*>(&e) != NULL);
    PyObject* module = PyImport_ImportModule(own ? "openmm_cylchain.plugin" : "openmm");
    PyObject* type = NULL;
    if (module != NULL)
        type = PyObject_GetAttrString(module, own ? "CylinderChainException" : "OpenMMException");
    PyObject* exception = (type == NULL ? NULL : newException(type, e));
    if (exception != NULL)
        PyErr_SetObject(type, exception);
    Py_XDECREF(exception);
    Py_XDECREF(type);
    Py_XDECREF(module);
}
%}

%exception {
    try {
        $action
    }
    catch (std::exception& e) {
        raiseException(e);
        SWIG_fail;
    }
}

%exception OpenMM::CylinderChainIntegrator::step {
    PyThreadState* threadState = PyEval_SaveThread();
    try {
        $action
    }
    catch (std::exception& e) {
        PyEval_RestoreThread(threadState);
        raiseException(e);
        SWIG_fail;
    }
    PyEval_RestoreThread(threadState);
}

/*
 * Getters return tuples, and units where OpenMM would.
 */

%typemap(out) const std::vector<int>& {
    $result = PyTuple_New($1->size());
    for (size_t i = 0; i < $1->size(); i++)
        PyTuple_SetItem($result, i, PyLong_FromLong((*$1)[i]));
}

%typemap(out) const std::map<int, double>& {
    $result = PyDict_New();
    for (auto& entry : *$1) {
        PyObject* key = PyLong_FromLong(entry.first);
        PyObject* value = PyFloat_FromDouble(entry.second);
        PyDict_SetItem($result, key, value);
        Py_DECREF(key);
        Py_DECREF(value);
    }
}

%apply int& OUTPUT {int& bendingModel, int& stretchingModel, int& chain, int& node, int& particle, int& steps,
        int& particles, int& chain1, int& segment1, int& chain2, int& segment2, int& hand1, int& hand2,
        int& table, int& pool, int& firstMonomer, int& lastMonomer, int& leastMonomers, int& monomersPerSegment,
        int& initialState, int& minusState, int& plusState, int& order, int& monomers, int& region, int& nucleator,
        int& end, int& freeState, int& heldState, int& direction, int& sites};

%typemap(in, numinputs=0) Vec3& point (OpenMM::Vec3 value) {
    $1 = &value;
}

%typemap(argout, fragment="Vec3_to_PyVec3") Vec3& point {
    $result = SWIG_Python_AppendOutput($result, Vec3_to_PyVec3(*$1), 1);
}

%typemap(argout) const Vec3& point {
}

%typemap(in, numinputs=0) std::vector<double>& tensions (std::vector<double> value) {
    $1 = &value;
}
%typemap(argout) std::vector<double>& tensions {
    PyObject* tuple = PyTuple_New($1->size());
    for (size_t i = 0; i < $1->size(); i++)
        PyTuple_SetItem(tuple, i, PyFloat_FromDouble((*$1)[i]));
    $result = SWIG_Python_AppendOutput($result, tuple, 1);
}
%apply int& OUTPUT {int& first1, int& second1, int& first2, int& second2, int& nextNumber};
%apply double& OUTPUT {double& fraction1, double& fraction2};

%{
static bool takeNumber(PyObject* object, double& value) {
    value = PyFloat_AsDouble(object);
    return !(value == -1 && PyErr_Occurred());
}

static bool takeNumber(PyObject* object, int& value) {
    const long number = PyLong_AsLong(object);
    if (number == -1 && PyErr_Occurred())
        return false;
    value = (int) number;
    if (value == number)
        return true;
    PyErr_SetString(PyExc_OverflowError, "a number is too large");
    return false;
}

template <class T>
static bool takeNumbers(PyObject* object, std::vector<T>& values) {
    PyObject* sequence = PySequence_Tuple(object);
    if (sequence == NULL)
        return false;
    values.resize(PyTuple_Size(sequence));
    bool taken = true;
    for (size_t i = 0; i < values.size() && taken; i++)
        taken = takeNumber(PyTuple_GetItem(sequence, i), values[i]);
    Py_DECREF(sequence);
    return taken;
}
%}

%typemap(in) const std::vector<int>& numbers (std::vector<int> value) {
    if (!takeNumbers($input, value))
        SWIG_fail;
    $1 = &value;
}
%typemap(in) const std::vector<double>& fractions (std::vector<double> value) {
    if (!takeNumbers($input, value))
        SWIG_fail;
    $1 = &value;
}
%typemap(freearg) const std::vector<int>& numbers, const std::vector<double>& fractions {
}
%typemap(in, numinputs=0) std::vector<int>& numbers (std::vector<int> value) {
    $1 = &value;
}
%typemap(argout) std::vector<int>& numbers {
    PyObject* tuple = PyTuple_New($1->size());
    for (size_t i = 0; i < $1->size(); i++)
        PyTuple_SetItem(tuple, i, PyLong_FromLong((*$1)[i]));
    $result = SWIG_Python_AppendOutput($result, tuple, 1);
}
// What is constant goes in and does not come out.
%typemap(argout) const std::vector<int>& numbers {
}
%typemap(argout) const std::vector<double>& fractions {
}
%apply std::vector<int>& numbers {std::vector<int>& ends, std::vector<int>& models, std::vector<int>& active,
        std::vector<int>& types, std::vector<int>& anchors, std::vector<int>& chains};
%apply const std::vector<int>& numbers {const std::vector<int>& ends, const std::vector<int>& models,
        const std::vector<int>& active, const std::vector<int>& types, const std::vector<int>& anchors,
        const std::vector<int>& chains, const std::vector<int>& particles};
%apply std::vector<int>& numbers {std::vector<int>& particles};
%apply std::vector<double>& tensions {std::vector<double>& fractions, std::vector<double>& points,
        std::vector<double>& parameters, std::vector<double>& places, std::vector<double>& gaps,
        std::vector<double>& forces, std::vector<double>& sums, std::vector<double>& loads,
        std::vector<double>& rotationalFriction, std::vector<double>& stiffness, std::vector<double>& rest,
        std::vector<double>& friction, std::vector<double>& bends, std::vector<double>& twists};
%apply const std::vector<double>& fractions {const std::vector<double>& points,
        const std::vector<double>& parameters, const std::vector<double>& places, const std::vector<double>& loads,
        const std::vector<double>& rotationalFriction, const std::vector<double>& stiffness,
        const std::vector<double>& rest, const std::vector<double>& friction, const std::vector<double>& bends,
        const std::vector<double>& twists};

%typemap(in, numinputs=0) std::vector<Vec3>& vectors (std::vector<OpenMM::Vec3> value) {
    $1 = &value;
}
%typemap(argout, fragment="Vec3_to_PyVec3") std::vector<Vec3>& vectors {
    PyObject* tuple = PyTuple_New($1->size());
    for (size_t i = 0; i < $1->size(); i++)
        PyTuple_SetItem(tuple, i, Vec3_to_PyVec3((*$1)[i]));
    $result = SWIG_Python_AppendOutput($result, tuple, 1);
}
%apply std::vector<Vec3>& vectors {std::vector<Vec3>& jointForces, std::vector<Vec3>& directions};
%apply Vec3& point {Vec3& direction, Vec3& vector, Vec3& velocity, Vec3& gradientX, Vec3& gradientY, Vec3& gradientZ,
        Vec3& origin};
%apply const Vec3& point {const Vec3& direction, const Vec3& vector, const Vec3& velocity, const Vec3& gradientX,
        const Vec3& gradientY, const Vec3& gradientZ, const Vec3& origin};
%apply double& OUTPUT {double& restLength, double& stretchingStiffness, double& maximumExtension,
        double& parallelFriction, double& perpendicularFriction, double& rotationalFriction,
        double& extensionalFriction, double& length, double& stiffness, double& stretching, double& bending,
        double& propulsion, double& work, double& bindingRate, double& reach, double& unbindingRate,
        double& strainShare, double& unbindingForce, double& catchRate, double& catchForce, double& speed,
        double& stallForce, double& volume, double& concentration, double& elementLength, double& stretchingModulus,
        double& bendingRigidity, double& shortening, double& rate, double& angle,
        double& distance, double& beyond, double& range, double& friction, double& diffusion, double& leastCosine,
        double& largestCosine, double& position, double& captureProbability, double& releaseRate,
        double& torque, double& angularVelocity, double& offRate, double& pitch, double& stallTorque};
%apply bool& OUTPUT {bool& walksBackward, bool& holdsAtEnds, bool& sameChain, bool& vanishes, bool& isRegular,
        bool& bindsThere, bool& tracks, bool& planar, bool& excluded, bool& transActivated, bool& reversible};
%apply long long& OUTPUT {long long& bindings, long long& unbindings};

%pythoncode %{
import openmm
from openmm import unit


class CylinderChainException(openmm.OpenMMException):
    """Chains cannot be advanced: what is wrong, and where.

    Attributes
    ----------
    kind : {"torn-chain", "length-out-of-range", "unstable-chain", "unstable-particle", "link-out-of-range", \
            "unknown-links", "nothing-recorded"}
    chain, segment, particle, step, link : int or None
        None where it is not known. Steps count from 1.
    other_chain, other_segment : int or None
        The other segment of a contact or link.
    """

    def __init__(self, message="", kind=None, chain=None, segment=None, particle=None, step=None, link=None,
                 other_chain=None, other_segment=None):
        super().__init__(message)
        self.kind = kind
        self.chain = chain
        self.segment = segment
        self.particle = particle
        self.step = step
        self.link = link
        self.other_chain = other_chain
        self.other_segment = other_segment


_LENGTH = unit.nanometer
_ENERGY = unit.kilojoule_per_mole
_FORCE = unit.kilojoule_per_mole/unit.nanometer
_STIFFNESS = unit.kilojoule_per_mole/unit.nanometer**2
_VELOCITY = unit.nanometer/unit.picosecond
_FRICTION = unit.kilojoule_per_mole*unit.picosecond/unit.nanometer**2
_ROTATIONAL_FRICTION = unit.kilojoule_per_mole*unit.picosecond
_SEGMENT_UNITS = (_LENGTH, _STIFFNESS, _LENGTH, _FRICTION, _FRICTION, _ROTATIONAL_FRICTION, _ROTATIONAL_FRICTION)
%}

%pythonappend OpenMM::CylinderChainForce::getSegmentParameters(int, int, double&, double&, double&, double&, double&,
        double&, double&) const %{
    val = [unit.Quantity(v, u) for v, u in zip(val, _SEGMENT_UNITS)]
%}
%pythonappend OpenMM::CylinderChainForce::getSegmentPropulsion(int, int, double&) const %{
    val = unit.Quantity(val, _FORCE)
%}
%pythonappend OpenMM::CylinderChainForce::getBeamChainPropulsion(int, double&) const %{
    val = unit.Quantity(val, _FORCE)
%}
%pythonappend OpenMM::CylinderChainForce::getChainNodeFriction(int) const %{
    val = unit.Quantity(val, _FRICTION)
%}
%pythonappend OpenMM::CylinderChainForce::getJointParameters(int, int, double&) const %{
    linear = self.getChainModels(chain)[0] == CylinderChainForce.BondDifference
    val = unit.Quantity(val, _STIFFNESS if linear else _ENERGY)
%}
%pythonappend OpenMM::CylinderChainForce::getTetherParameters(int, int&, int&, Vec3&, double&) const %{
    val[2] = unit.Quantity(val[2], _LENGTH)
    val[3] = unit.Quantity(val[3], _STIFFNESS)
%}
%pythonappend OpenMM::CylinderChainForce::getBeamChainParameters(int, double&, double&, double&, double&, double&,
        double&) const %{
    friction = _FRICTION/_LENGTH
    units = (_LENGTH, _FORCE, _ENERGY*_LENGTH, unit.dimensionless, friction, friction)
    val = [unit.Quantity(v, u) for v, u in zip(val, units)]
%}
%pythonappend OpenMM::CylinderChainForce::computeEnergies(Context&, double&, double&) const %{
    val = [unit.Quantity(v, _ENERGY) for v in val]
%}
%pythonappend OpenMM::CylinderChainLinkForce::getLinkPlaces(int, int&, int&, double&, int&, int&, double&,
        Vec3&) const %{
    val[6] = unit.Quantity(val[6], _LENGTH)
%}
%pythonappend OpenMM::CylinderChainLinkForce::getDefaultLinkParameters(int&, double&, double&, double&) const %{
    units = (_LENGTH, _STIFFNESS, _LENGTH)
    val = [val[0], *(unit.Quantity(v, u) for v, u in zip(val[1:], units))]
%}
%pythonappend OpenMM::CylinderChainLinkForce::getLinkParameters(int, int&, double&, double&, double&) const %{
    units = (_LENGTH, _STIFFNESS, _LENGTH)
    val = [val[0], *(unit.Quantity(v, u) for v, u in zip(val[1:], units))]
%}
%pythonappend OpenMM::CylinderChainContactForce::getContacts(Context&, std::vector<int>&, std::vector<double>&,
        std::vector<double>&, std::vector<double>&, std::vector<Vec3>&) %{
    val = [val[0], val[1], unit.Quantity(val[2], _LENGTH), unit.Quantity(val[3], _FORCE), val[4]]
%}
%define %unitsOfMeanForces(Class)
%pythonappend OpenMM::Class::takeMeanForces(Context&, int, std::vector<double>&, std::vector<int>&,
        std::vector<double>&, std::vector<double>&) %{
    val = [unit.Quantity(val[0], unit.picosecond), unit.Quantity(val[1], _FORCE), val[2],
           *(unit.Quantity(v, _FORCE) for v in val[3:])]
%}
%enddef
%unitsOfMeanForces(CylinderChainContactForce)
%unitsOfMeanForces(CylinderChainWallForce)
%pythonappend OpenMM::CylinderChainContactForce::getStiffness() const %{
    val = unit.Quantity(val, _STIFFNESS)
%}
%pythonappend OpenMM::CylinderChainContactForce::getChainDiameter(int) const %{
    val = unit.Quantity(val, _LENGTH)
%}
%pythonappend OpenMM::CylinderChainContactForce::getSphereDiameter(int) const %{
    val = unit.Quantity(val, _LENGTH)
%}
%pythonappend OpenMM::CylinderChainWallForce::getStiffness() const %{
    val = unit.Quantity(val, _STIFFNESS)
%}
%pythonappend OpenMM::CylinderChainWallForce::getParticleRadius(int) const %{
    val = unit.Quantity(val, _LENGTH)
%}
%pythonappend OpenMM::CylinderChainWallForce::getRegion(Vec3&, Vec3&, double&) const %{
    # Directions have no unit.
    kind = _LENGTH if val[0] in ("box", "ellipsoid", "capsule", "torus") else unit.dimensionless
    val = [val[0], unit.Quantity(val[1], _LENGTH), unit.Quantity(val[2], kind), unit.Quantity(val[3], _LENGTH)]
%}
%pythonappend OpenMM::CylinderChainIntegrator::getTemperature() const %{
    val = unit.Quantity(val, unit.kelvin)
%}
%pythonappend OpenMM::CylinderChainIntegrator::computeSystemTemperature() const %{
    val = unit.Quantity(val, unit.kelvin)
%}
%pythonappend OpenMM::CylinderChainIntegrator::getFriction() const %{
    val = unit.Quantity(val, 1/unit.picosecond)
%}
%pythonappend OpenMM::CylinderChainForce::getBody(int, std::vector<int>&, std::vector<double>&, double&,
        std::vector<double>&, bool&) const %{
    units = (unit.dimensionless, _LENGTH, _FRICTION, _FRICTION*_LENGTH**2, unit.dimensionless)
    val = [v if u == unit.dimensionless else unit.Quantity(v, u) for v, u in zip(val, units)]
%}
%pythonappend OpenMM::CylinderChainIntegrator::getFlow(Vec3&, Vec3&, Vec3&, Vec3&, Vec3&) const %{
    units = (_VELOCITY, 1/unit.picosecond, 1/unit.picosecond, 1/unit.picosecond, _LENGTH)
    val = [unit.Quantity(v, u) for v, u in zip(val, units)]
%}
%pythonappend OpenMM::CylinderChainIntegrator::getMeanTensions(int, std::vector<double>&, std::vector<Vec3>&,
        std::vector<Vec3>&) const %{
    val = [unit.Quantity(val[0], _FORCE), unit.Quantity(val[1], _FORCE), val[2]]
%}
%pythonappend OpenMM::CylinderChainIntegrator::getParticleFrictions() const %{
    val = {particle: unit.Quantity(friction, _FRICTION) for particle, friction in val.items()}
%}

/*
 * XmlSerializer.deserialize() and System.getForce() return objects of the base class: cast() and isinstance() deal with
 * those.  Copies and pickles go through XML.
 */

%define %castable(Class, Base)
%extend OpenMM::Class {
    static OpenMM::Class& cast(OpenMM::Base& object) {
        OpenMM::Class* result = dynamic_cast<OpenMM::Class*>(&object);
        if (result == NULL)
            throw OpenMM::OpenMMException("The object is not a " #Class);
        return *result;
    }
    static bool isinstance(OpenMM::Base& object) {
        return dynamic_cast<OpenMM::Class*>(&object) != NULL;
    }
}
%enddef

%define %concreteClass(Class, Base)
%castable(Class, Base)
%newobject OpenMM::Class::_fromXml;
%extend OpenMM::Class {
    static OpenMM::Class* _fromXml(const std::string& xml) {
        std::stringstream stream(xml);
        OpenMM::Base* object = OpenMM::XmlSerializer::deserialize<OpenMM::Base>(stream);
        OpenMM::Class* result = dynamic_cast<OpenMM::Class*>(object);
        if (result == NULL) {
            delete object;
            throw OpenMM::OpenMMException("The object is not a " #Class);
        }
        return result;
    }
    %pythoncode %{
    def __getstate__(self):
        attributes = {key: value for key, value in self.__dict__.items() if key != "this"}
        return openmm.XmlSerializer.serialize(self), attributes

    def __setstate__(self, state):
        xml, attributes = state
        self.this = Class._fromXml(xml).this
        self.__dict__.update(attributes)

    def __copy__(self):
        return self.__deepcopy__({})

    def __deepcopy__(self, memo):
        from copy import deepcopy
        duplicate = self.__class__.__new__(self.__class__)
        duplicate.__setstate__(deepcopy(self.__getstate__(), memo))
        return duplicate
    %}
}
%enddef

%castable(CylinderChainCoupling, Force)
%concreteClass(CylinderChainForce, Force)
%concreteClass(CylinderChainBindingForce, Force)
%concreteClass(CylinderChainContactForce, Force)
%concreteClass(CylinderChainGrowthForce, Force)
%concreteClass(CylinderChainLinkForce, Force)
%concreteClass(CylinderChainWallForce, Force)
%concreteClass(CylinderChainIntegrator, Integrator)

%ignore findPlaces;
%ignore OpenMM::CylinderChainForce::getChains;
%ignore OpenMM::CylinderChainForce::describeChains;
%ignore OpenMM::CylinderChainContactForce::getBodies;
%ignore OpenMM::CylinderChainForce::getBodies;
%ignore OpenMM::CylinderChainWallForce::getWalls;
%ignore OpenMM::CylinderChainBindingForce::getState;
%ignore OpenMM::CylinderChainBindingForce::getHand;
%ignore OpenMM::CylinderChainBindingForce::getBranchJoint;
%ignore OpenMM::CylinderChainBindingForce::getLinkerType;
%ignore OpenMM::CylinderChainBindingForce::getBarriers;
%ignore OpenMM::CylinderChainGrowthForce::getSystem;
%ignore OpenMM::CylinderChainGrowthForce::getRanges;
%ignore OpenMM::CylinderChainGrowthForce::getState;
%ignore OpenMM::CylinderChainGrowthForce::setMonomers;
%ignore OpenMM::CylinderChainLinkForce::getTable;
%ignore OpenMM::CylinderChainLinkForce::setTable;
%import "mechanics/Enumerators.h"
%import "mechanics/BendingModels.h"
%import "mechanics/StretchingModels.h"
%import "dynamics/Schemes.h"
%import "dynamics/Precisions.h"
%include "openmm/CylinderChainCoupling.h"
%include "openmm/CylinderChainForce.h"
%include "openmm/CylinderChainBindingForce.h"
%include "openmm/CylinderChainContactForce.h"
%include "openmm/CylinderChainGrowthForce.h"
%include "openmm/CylinderChainLinkForce.h"
%include "openmm/CylinderChainWallForce.h"
%include "openmm/CylinderChainIntegrator.h"
