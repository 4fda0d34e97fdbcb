#ifndef OPENMM_COMMONCYLINDERCHAINKERNELSOURCES_H_
#define OPENMM_COMMONCYLINDERCHAINKERNELSOURCES_H_

namespace OpenMM {

/**
 * The sources of the kernels for GPU platforms: the files in platforms/common/kernels.
 */
struct CommonCylinderChainKernelSources {
    static const char* const layout;
    static const char* const constants;
    static const char* const vectors;
    static const char* const noise;
    static const char* const potentials;
    static const char* const workspace;
    static const char* const workItems;
    static const char* const stages;
    static const char* const tensionBand;
    static const char* const equations;
    static const char* const metricForces;
    static const char* const solverOfItem;
    static const char* const solverOfGroup;
    static const char* const implicitStep;
    static const char* const explicitStep;
    static const char* const chainForces;
    static const char* const chainKernels;
    static const char* const particles;
    static const char* const couplings;
    static const char* const contacts;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONCYLINDERCHAINKERNELSOURCES_H_*/
