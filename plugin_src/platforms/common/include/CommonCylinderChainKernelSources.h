#ifndef OPENMM_COMMONCYLINDERCHAINKERNELSOURCES_H_
#define OPENMM_COMMONCYLINDERCHAINKERNELSOURCES_H_

namespace OpenMM {

/**
 * The sources of the kernels for GPU platforms: the files in platforms/common/kernels.
 */
struct CommonCylinderChainKernelSources {
    static const char* const layout;
    static const char* const noise;
    static const char* const particles;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONCYLINDERCHAINKERNELSOURCES_H_*/
