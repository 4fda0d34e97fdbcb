#ifndef CYLCHAIN_BODY_EQUATIONS_H_
#define CYLCHAIN_BODY_EQUATIONS_H_

namespace cylchain {

/**
 * The linear equations of a rigid body in an iteration of a step: those of six unknowns, the motion of its centre and a
 * turn. Matrices have 36 numbers, row by row; those of three rows are symmetric, see SymmetricMatrices.h. An arm leads
 * from the centre of the body to a place.
 */
namespace BodyEquations {

/** Find how a place moves with a motion of the centre and a turn. */
void findMove(const double* change, const double* arm, double* move);
/** Add the force on a place to that on the centre and to the torque. */
void addForce(const double* force, const double* arm, double* sums);
/** Add a symmetric matrix to one of the blocks on the diagonal. */
void addBlock(const double* block, double factor, int first, double* matrix);
/** Add the stiffness of what holds a place. */
void addStiffness(const double* stiffness, const double* arm, double* matrix);
/** Find how a force on a place moves it, by the inverse of the equations. */
void findCompliance(const double* inverse, const double* arm, double* compliance);
/** The inverse of a symmetric, positive definite matrix. */
void invertSix(const double* matrix, double* inverse);
/**
 * The same where some unknowns may be none: rows and columns of zeros.
 *
 * @param planar  whether the body moves in a plane of constant z alone, and turns about z alone
 * @param turns   whether it turns
 */
void invertSix(const double* matrix, bool planar, bool turns, double* inverse);
/** Find the product with a vector of six numbers. */
void multiplySix(const double* matrix, const double* vector, double* result);

} // namespace BodyEquations

} // namespace cylchain

#endif /*CYLCHAIN_BODY_EQUATIONS_H_*/
